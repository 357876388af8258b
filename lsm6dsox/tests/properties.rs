//! No bytes on the bus, in either direction, cause a panic.

use core::convert::Infallible;

use crate::common::{QUIET, part};
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use embedded_hal_mock::eh1::delay::NoopDelay;
use lsm6dsox::sim::{PartFault, PartOptions};
use lsm6dsox::{Config, FrozenDetector, Lsm6dsox, Pin, RawSample};
use proptest::prelude::*;

/// A bus that answers with arbitrary bytes.
struct Babble {
    bytes: Vec<u8>,
    next: usize,
}

impl Babble {
    fn fill(&mut self, buffer: &mut [u8]) {
        for byte in buffer {
            *byte = self.bytes[self.next % self.bytes.len()];
            self.next += 1;
        }
    }
}

impl ErrorType for Babble {
    type Error = Infallible;
}

impl SpiDevice for Babble {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            match operation {
                Operation::Read(buffer)
                | Operation::Transfer(buffer, _)
                | Operation::TransferInPlace(buffer) => self.fill(buffer),
                Operation::Write(_) | Operation::DelayNs(_) => {}
            }
        }
        Ok(())
    }
}

/// Calls every function of a driver, ignoring the results.
fn exercise<SPI: SpiDevice>(
    sensor: &mut Lsm6dsox<SPI>,
    delay: &mut impl embedded_hal::delay::DelayNs,
) {
    let _ = sensor.init(delay);
    let _ = sensor.verify();
    let mut frozen = FrozenDetector::new();
    for _ in 0..4 {
        if let Ok(sample) = sensor.sample() {
            frozen.update(&sample);
            let si = sample.to_si();
            assert!(si.specific_force.into_iter().all(|x| x.abs() < 157.0));
            assert!(si.angular_rate.into_iter().all(|x| x.abs() < 41.0));
        }
    }
    let _ = sensor.status();
    let _ = sensor.frequency_fine();
    let _ = sensor.self_test(delay);
    let _ = sensor.power_down();
}

proptest! {
    #[test]
    fn the_driver_bears_any_bytes(bytes in prop::collection::vec(any::<u8>(), 1..400)) {
        let mut sensor = Lsm6dsox::new(Babble { bytes, next: 0 }, Config::FRESH_KILOHERTZ);
        exercise(&mut sensor, &mut NoopDelay::new());
    }

    /// Mostly correct bytes get further into the driver than random ones.
    #[test]
    fn the_driver_bears_a_part_on_a_bad_line(seed in any::<u64>(), per_million in 0_u32..3_000) {
        let part = part(PartOptions { seed, noise: true, ..QUIET });
        part.inject(PartFault::BitFlips { per_million });
        let mut sensor = Lsm6dsox::new(part.spi(), Config::FRESH_KILOHERTZ);
        exercise(&mut sensor, &mut part.delay());
    }

    #[test]
    fn a_sample_is_decoded_from_any_bytes(bytes in any::<[u8; 16]>()) {
        let decoded = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ);
        prop_assert_eq!(decoded.is_ok(), bytes[0] < 8);
        if let Ok(sample) = decoded {
            prop_assert_eq!(sample.specific_force.codes[2].to_le_bytes(), [bytes[14], bytes[15]]);
        }
    }

    #[test]
    fn the_simulated_part_bears_any_transaction(
        transactions in prop::collection::vec(
            (prop::collection::vec(any::<u8>(), 1..40), 0_u64..3_000_000),
            1..60,
        ),
    ) {
        let part = part(PartOptions { noise: true, ..QUIET });
        part.advance_by(10_000_000);
        for (mut frame, ns) in transactions {
            part.spi().transfer_in_place(&mut frame).unwrap();
            part.advance_by(ns);
            for pin in [Pin::Int1, Pin::Int2] {
                let edge = part.next_rising_edge_ns(pin);
                prop_assert!(edge.is_none_or(|edge| edge >= part.now_ns()));
            }
        }
    }
}
