//! Samples are unavailable after any failed step, as their scale could be wrong.

use std::cell::Cell;

use crate::common::{QUIET, part};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use lsm6dsox::sim::{SharedPart, SimSpi};
use lsm6dsox::{AccelFullScale, Config, Error, Lsm6dsox, Params, register};

const PRESET: Config = Config::FRESH_KILOHERTZ;

/// The preset at ±4 g.
fn other() -> Config {
    let mut params = Params::FRESH_KILOHERTZ;
    params.accel.full_scale = AccelFullScale::G4;
    params.validate().expect("the part has it")
}

/// The transfer that failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Failed;

impl embedded_hal::spi::Error for Failed {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// A bus on which one transfer fails.
struct FailsOnce<'a> {
    spi: SimSpi,
    /// Number of transfers that succeed before the one that fails.
    before: &'a Cell<Option<u32>>,
    transfers: &'a Cell<u32>,
    /// Whether the part is in its reset, and whether the transfer that failed has polled it.
    is_resetting: bool,
    has_polled: &'a Cell<bool>,
}

impl ErrorType for FailsOnce<'_> {
    type Error = Failed;
}

impl SpiDevice for FailsOnce<'_> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Failed> {
        self.transfers.set(self.transfers.get() + 1);
        match self.before.get() {
            Some(0) => {
                self.before.set(None);
                let reads = matches!(operations, [Operation::TransferInPlace(_)]);
                self.has_polled.set(self.is_resetting && reads);
                return Err(Failed);
            }
            left => self.before.set(left.map(|left| left - 1)),
        }
        if let [Operation::Write(bytes)] = operations
            && let [address, value] = **bytes
        {
            let reset = register::ctrl3_c::SW_RESET;
            self.is_resetting = address == register::CTRL3_C.address && reset.is_set(value);
        }
        self.spi.transaction(operations).map_err(|never| match never {})
    }
}

type Driver<'a> = Lsm6dsox<FailsOnce<'a>>;

/// Runs a change undisturbed, and then once with each of its transfers failing; `after` is
/// the configuration that the next init writes.
fn each_failing_step(
    after: Config,
    change: impl Fn(&mut Driver<'_>, &SharedPart) -> Result<(), Error<Failed>>,
) {
    let run = |fails: Option<u32>| {
        let part = part(QUIET);
        let (before, transfers) = (Cell::new(None), Cell::new(0));
        let has_polled = Cell::new(false);
        let bus = FailsOnce {
            spi: part.spi(),
            before: &before,
            transfers: &transfers,
            is_resetting: false,
            has_polled: &has_polled,
        };
        let mut sensor = Lsm6dsox::new(bus, PRESET);
        assert_eq!(sensor.sample(), Err(Error::Unconfigured), "not brought up");
        sensor.init(&mut part.delay()).expect("nothing fails yet");
        assert!(sensor.sample().is_ok());
        before.set(fails);
        transfers.set(0);
        let result = change(&mut sensor, &part);
        let Some(step) = fails else {
            assert_eq!(result, Ok(()));
            return transfers.get();
        };
        if has_polled.get() {
            // A part may not answer until its reset has ended.
            assert_eq!(result, Ok(()), "step {step}");
            return 0;
        }
        assert_eq!(result, Err(Error::Bus(Failed)), "step {step}");
        assert_eq!(sensor.sample(), Err(Error::Unconfigured), "step {step}");
        sensor.init(&mut part.delay()).expect("nothing fails any more");
        assert_eq!(*sensor.config(), after);
        let scale = sensor.sample().expect("it is up").specific_force.full_scale;
        assert_eq!(scale, after.params().accel.full_scale, "step {step}");
        0
    };
    for step in 0..run(None) {
        run(Some(step));
    }
}

#[test]
fn samples_are_unavailable_after_any_failed_step() {
    each_failing_step(PRESET, |sensor, part| sensor.init(&mut part.delay()));
    each_failing_step(other(), |sensor, part| sensor.reconfigure(other(), &mut part.delay()));
    each_failing_step(PRESET, |sensor, part| sensor.self_test(&mut part.delay()).map(|_| ()));
    each_failing_step(PRESET, |sensor, _| sensor.verify());
    each_failing_step(PRESET, |sensor, _| sensor.power_down());
}

#[test]
fn switched_off_part_has_no_samples() {
    let part = part(QUIET);
    let mut sensor = crate::common::sensor(&part, PRESET);
    sensor.sample().expect("it is up");
    sensor.power_down().expect("the part is sound");
    assert_eq!(sensor.sample(), Err(Error::Unconfigured));
    part.advance_by(100_000_000);
    let status = sensor.status().expect("the part answers");
    assert!(!status.accel_fresh() && !status.gyro_fresh());
}
