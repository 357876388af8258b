//! The estimator with third-party drivers: an ICM-20948 in an asynchronous task, as embassy runs it, and a BMI270 in a
//! loop. Each driver has its own units. The estimator takes SI units.
//!
//! `main` runs the task on this machine with a part that rests: `cargo run -p footfall-estimator --example other_imus`.

use std::cell::Cell;
use std::convert::Infallible;
use std::future::Future as _;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use bmi2::Bmi2;
use bmi2::interface::{I2cAddr, I2cInterface};
use bmi2::types::{AxisData, Burst};
use embedded_hal::i2c::I2c;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::digital::Wait;
use embedded_hal_async::spi::{Operation, SpiDevice};
use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{
    AngularRate, ContactEstimate, ContactEstimator, Gravity, ImuSample, Params, ParamsError,
    Saturation, SpecificForce, Stream, Timestamp, Validity, Vec3,
};
use icm20948_async::{AccRange, AccUnit, GyrRange, GyrUnit, IcmBuilder, SetupError};

/// Sample rate of both sensors, Hz.
const RATE_HZ: f32 = 225.0;

fn estimator() -> Result<ContactEstimator, ParamsError> {
    let stream = Stream::new(RATE_HZ, Gravity::Included)?;
    Ok(ContactEstimator::new(&Params::DEFAULT.validate()?, stream))
}

/// Estimates at each edge of the data-ready pin. `now_us` is a clock that does not go back, and `send` takes the estimate.
async fn run_icm20948<SPI: SpiDevice>(
    spi: SPI,
    delay: impl DelayNs,
    mut data_ready: impl Wait,
    mut estimator: ContactEstimator,
    now_us: impl Fn() -> u64,
    mut send: impl FnMut(&ContactEstimate) -> bool,
) -> Result<(), SetupError<SPI::Error>> {
    // Landings reach 10 g, swings 1000 °/s.
    let imu = IcmBuilder::new_spi(spi, delay)
        .acc_range(AccRange::Gs16)
        .gyr_range(GyrRange::Dps2000)
        .acc_unit(AccUnit::Gs)
        .gyr_unit(GyrUnit::Rps)
        .initialize_6dof();
    let mut imu = imu.await?;
    loop {
        let edge = data_ready.wait_for_rising_edge().await;
        let timestamp = Timestamp::from_micros(now_us());
        let sample = match imu.read_6dof().await {
            Ok(data) if edge.is_ok() => ImuSample {
                timestamp,
                specific_force: SpecificForce(vector(data.acc, STANDARD_GRAVITY)),
                angular_rate: AngularRate(vector(data.gyr, 1.0)),
                validity: Validity::Valid,
            },
            _ => invalid(timestamp),
        };
        if !send(&estimator.update(&sample, None)) {
            return Ok(());
        }
    }
}

fn vector([x, y, z]: [f32; 3], unit: f32) -> Vec3 {
    Vec3::new(unit * x, unit * y, unit * z)
}

/// Reads a BMI270 that has been started at ±16 g and ±2000 °/s.
fn sample_of_bmi270<I2C: I2c, D: embedded_hal::delay::DelayNs>(
    imu: &mut Bmi2<I2cInterface<I2C>, D, 256>,
    timestamp: Timestamp,
) -> ImuSample {
    let Ok(data) = imu.get_data() else {
        return invalid(timestamp);
    };
    let codes = |axes: AxisData| [axes.x, axes.y, axes.z];
    let (force, rate) = (codes(data.acc), codes(data.gyr));
    let is_full = |codes: [i16; 3]| codes.iter().any(|code| code.unsigned_abs() >= 32_767);
    ImuSample {
        timestamp,
        specific_force: SpecificForce(vector(
            force.map(f32::from),
            16.0 * STANDARD_GRAVITY / 32_768.0,
        )),
        angular_rate: AngularRate(vector(rate.map(f32::from), 2000_f32.to_radians() / 32_768.0)),
        validity: match (is_full(force), is_full(rate)) {
            (false, false) => Validity::Valid,
            (true, false) => Validity::Saturated(Saturation::Accelerometer),
            (false, true) => Validity::Saturated(Saturation::Gyroscope),
            (true, true) => Validity::Saturated(Saturation::Both),
        },
    }
}

/// Returns a sample in place of a failed read, because a sample that is left out would be a gap.
fn invalid(timestamp: Timestamp) -> ImuSample {
    ImuSample { timestamp, validity: Validity::Invalid, ..ImuSample::default() }
}

/// A part at rest: 1 g along z at ±16 g, and the identity of an ICM-20948.
struct RestingPart;

impl embedded_hal::i2c::ErrorType for RestingPart {
    type Error = Infallible;
}

impl I2c for RestingPart {
    fn transaction(
        &mut self,
        _: u8,
        operations: &mut [embedded_hal::i2c::Operation<'_>],
    ) -> Result<(), Infallible> {
        if let [_, embedded_hal::i2c::Operation::Read(read)] = operations {
            read.fill(0);
            read[4..6].copy_from_slice(&2048_i16.to_le_bytes());
        }
        Ok(())
    }
}

impl embedded_hal::spi::ErrorType for RestingPart {
    type Error = Infallible;
}

impl SpiDevice for RestingPart {
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), Infallible> {
        if let [Operation::Write([address]), Operation::Read(read)] = operations {
            read.fill(0);
            match (*address & 0x7F, read) {
                (0x00, [identity]) => *identity = 0xEA,
                (0x2D, read) if read.len() >= 6 => {
                    read[4..6].copy_from_slice(&2048_i16.to_be_bytes());
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// A pin whose edge comes at once, and a delay that does not wait.
struct AtOnce;

impl embedded_hal::delay::DelayNs for AtOnce {
    fn delay_ns(&mut self, _: u32) {}
}

impl DelayNs for AtOnce {
    async fn delay_ns(&mut self, _: u32) {}
}

impl embedded_hal::digital::ErrorType for AtOnce {
    type Error = Infallible;
}

impl Wait for AtOnce {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

fn main() -> Result<(), ParamsError> {
    let ticks = Cell::new(0);
    let now_us = || {
        ticks.set(ticks.get() + 1);
        ticks.get() * 1_000_000 / RATE_HZ as u64
    };
    let has_time = || ticks.get() < 2 * RATE_HZ as u64;
    let mut last = ContactEstimate::default();
    let send = |estimate: &ContactEstimate| {
        last = *estimate;
        has_time()
    };
    let task = run_icm20948(RestingPart, AtOnce, AtOnce, estimator()?, now_us, send);
    // Nothing here waits, so one poll is the whole run.
    let result = pin!(task).poll(&mut Context::from_waker(Waker::noop()));
    assert!(matches!(result, Poll::Ready(Ok(()))), "{result:?}");
    println!("ICM-20948, after two seconds of rest: {:.2}", last.probabilities.stable);
    assert!(last.probabilities.stable > 0.95);

    ticks.set(0);
    let mut estimator = estimator()?;
    let mut imu = Bmi2::new_i2c(RestingPart, AtOnce, I2cAddr::Default, Burst::default());
    while has_time() {
        let sample = sample_of_bmi270(&mut imu, Timestamp::from_micros(now_us()));
        last = estimator.update(&sample, None);
    }
    println!("BMI270, after two seconds of rest: {:.2}", last.probabilities.stable);
    assert!(last.probabilities.stable > 0.95);
    Ok(())
}
