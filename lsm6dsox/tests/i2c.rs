//! The drivers over I²C.

use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_hal::i2c::I2c as _;
use lsm6dsox::sim::I2cError;
use lsm6dsox::{Config, Error, I2c, Lsm6dsox, Sa0, asynch};

use crate::common::{QUIET, part};

#[test]
fn drivers_over_both_buses_read_the_same_bytes() {
    let on_spi = part(QUIET);
    let on_i2c = part(QUIET);
    let mut spi = Lsm6dsox::new(on_spi.spi(), Config::FRESH_KILOHERTZ);
    let bus = I2c::new(on_i2c.i2c(), Sa0::Low);
    let mut i2c = Lsm6dsox::new(bus, Config::FRESH_KILOHERTZ);
    spi.init(&mut on_spi.delay()).expect("an init over SPI");
    i2c.init(&mut on_i2c.delay()).expect("an init over I²C");
    for _ in 0..20 {
        on_spi.advance_by(1_000_000);
        on_i2c.advance_by(1_000_000);
        let samples = (spi.sample(), i2c.sample());
        let (Ok(over_spi), Ok(over_i2c)) = samples else {
            panic!("{samples:?}");
        };
        assert!(over_spi.is_fresh());
        assert_eq!(over_spi, over_i2c);
    }
    i2c.verify().expect("all registers, with I²C on");
}

#[test]
fn i2c_is_off_on_spi_and_on_on_i2c() {
    for is_i2c in [false, true] {
        let part = part(QUIET);
        if is_i2c {
            let bus = I2c::new(part.i2c(), Sa0::Low);
            let mut driver = Lsm6dsox::new(bus, Config::FRESH_KILOHERTZ);
            driver.init(&mut part.delay()).expect("an init");
        } else {
            let mut driver = Lsm6dsox::new(part.spi(), Config::FRESH_KILOHERTZ);
            driver.init(&mut part.delay()).expect("an init");
        }
        let answer = part.i2c().write_read(0x6A, &[0x0F], &mut [0]);
        assert_eq!(answer.is_ok(), is_i2c);
    }
}

#[test]
fn a_part_at_the_other_address_is_an_error_of_the_bus() {
    let part = part(QUIET);
    let bus = I2c::new(part.i2c(), Sa0::High);
    let mut driver = Lsm6dsox::new(bus, Config::FRESH_KILOHERTZ);
    assert_eq!(driver.init(&mut part.delay()), Err(Error::Bus(I2cError)));
}

#[test]
fn the_asynchronous_driver_runs_its_self_test_over_i2c() {
    let part = part(QUIET);
    let bus = I2c::new(part.i2c(), Sa0::Low);
    let mut driver = asynch::Lsm6dsox::new(bus, Config::FRESH_417_HERTZ);
    let mut delay = part.delay();
    let mut run = pin!(async {
        driver.init(&mut delay).await?;
        driver.self_test(&mut delay).await
    });
    let mut context = Context::from_waker(Waker::noop());
    let Poll::Ready(result) = run.as_mut().poll(&mut context) else {
        panic!("the simulated bus is always ready");
    };
    assert!(result.expect("a self-test").passed());
}
