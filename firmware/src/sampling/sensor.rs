//! The sensor: its start, its self-test, and the measurement of a tick.

use embedded_hal_async::delay::DelayNs;
use estimator_core::{ImuSample, Validity};
use lsm6dsox::asynch::{BOOT_MICROS, Lsm6dsox};
use lsm6dsox::{AsyncBus, Config, Error, RawSample, SetSpiClock, SpiClock, imu};
use wire::Fault;

use super::fault::{SensorFault, failed_axes};
use super::watch::{ReadAt, SATURATED_TICKS, SampleIssue, Watch};
use super::{SETTLED_TICKS, SLOW_AFTER, Tick};

/// State of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// First configuration.
    #[default]
    Starting,
    /// Self-test.
    SelfTest,
    /// Measurement.
    Measuring,
    /// Initialisation after a failure.
    Recovering,
}

/// Result of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Sample for the estimator; invalid if none was read.
    pub sample: ImuSample,
    /// Codes of the sensor, if they could be read.
    pub raw: Option<RawSample>,
    /// State of the sensor.
    pub activity: Activity,
    /// Fault found on this tick.
    pub fault: Option<SensorFault>,
    /// Whether the sensor has been at the end of its range for longer than an impact lasts.
    pub saturated_for_long: bool,
    /// Event at which samples are read, if one was.
    pub read_at: ReadAt,
    /// Number of restarts of the sensor so far.
    pub restarts: u32,
    /// Number of registers so far that were read right at the second attempt.
    pub misreads: u32,
}

/// Sensor and the state of its health.
#[derive(Debug)]
pub struct Sensor<BUS> {
    pub(super) driver: Lsm6dsox<BUS>,
    conversion: imu::Conversion,
    pub(super) watch: Watch,
    pub(super) activity: Activity,
    pub(super) restarts: u32,
    pub(super) misreads: u32,
    /// Clock of the bus.
    clock: SpiClock,
    /// Errors of the bus that count for its clock, and [`Watch::turn`] of the last.
    bus_errors: u32,
    error_turn: usize,
    /// Fault of the register that was read back after the previous sample.
    found: Option<SensorFault>,
    /// Factor of the changes in the accelerometer's self-test.
    accelerometer_range: f32,
}

impl<BUS: AsyncBus + SetSpiClock> Sensor<BUS> {
    /// Creates a sensor that has not been started, with a new sample at least each tick.
    pub fn new(bus: BUS, config: Config) -> Self {
        Self {
            driver: Lsm6dsox::new(bus, config),
            conversion: imu::Conversion::default(),
            watch: Watch::default(),
            activity: Activity::Starting,
            restarts: 0,
            misreads: 0,
            clock: SpiClock::Full,
            bus_errors: 0,
            error_turn: 0,
            found: None,
            accelerometer_range: 1.0,
        }
    }

    /// Sets the range of the accelerometer for its self-test:
    /// [`Settings::accelerometer_range`](wire::Settings::accelerometer_range).
    #[must_use]
    pub fn with_accelerometer_range(self, range: f32) -> Self {
        Self { accelerometer_range: range, ..self }
    }

    /// Sets the clock with which the bus has been started.
    #[must_use]
    pub fn with_spi_clock(self, clock: SpiClock) -> Self {
        Self { clock, ..self }
    }

    /// Counts a misread, or a start that failed by one: [`SLOW_AFTER`] of them, each within a second of the one
    /// before, slow the bus down until the board starts again.
    pub(super) fn count_bus_error(&mut self) {
        let is_soon = self.watch.turn.wrapping_sub(self.error_turn) <= SETTLED_TICKS as usize;
        self.bus_errors = if is_soon { self.bus_errors + 1 } else { 1 };
        self.error_turn = self.watch.turn;
        if self.bus_errors >= SLOW_AFTER {
            self.bus_errors = 0;
            self.clock = self.clock.slower();
            self.driver.bus().set_spi_clock(self.clock);
        }
    }

    /// Reads the sample of a tick.
    pub async fn measure(&mut self, tick: &Tick) -> Measurement {
        self.watch.turn = self.watch.turn.wrapping_add(1);
        let read = self.driver.sample().await;
        let time = tick.sampled();
        let (raw, issue) = match read {
            Ok(raw) => {
                let issue = self.watch.issue(tick, &raw);
                (Some(raw), issue.or_else(|| self.unproven()))
            }
            Err(Error::Status { read, .. }) => {
                self.count_bus_error();
                (None, Some(SampleIssue::Status(read)))
            }
            Err(_) => (None, Some(SampleIssue::Bus)),
        };
        let fault = match self.watch.count(issue, time) {
            Some(issue) => Some(self.diagnose(issue, time).await),
            None => self.found.take(),
        };
        let mut sample = match &raw {
            Some(raw) => self.conversion.imu_sample(raw, time),
            None => imu::missing_sample(time),
        };
        if issue.is_some() && sample.validity != Validity::Invalid {
            sample.validity = Validity::Stale;
        }
        if fault.is_some() {
            sample.validity = Validity::Invalid;
        }
        Measurement {
            sample,
            raw,
            activity: Activity::Measuring,
            fault,
            saturated_for_long: self.watch.saturated_ticks >= SATURATED_TICKS,
            read_at: self.watch.read_at,
            restarts: self.restarts,
            misreads: self.misreads,
        }
    }

    /// Reads back one register, after the estimate: a difference is the next tick's fault.
    pub(super) async fn check(&mut self, tick: &Tick) {
        self.found = self.read_back_one_register(tick.time).await;
    }

    /// Issue of a sensor with an axis that has not changed yet since the start: it may be stuck, which is seen later.
    fn unproven(&self) -> Option<SampleIssue> {
        (!self.watch.frozen.every_axis_has_changed()).then_some(SampleIssue::Unproven)
    }

    /// Numbers of restarts and misreads so far.
    pub(super) const fn counts(&self) -> (u32, u32) {
        (self.restarts, self.misreads)
    }

    /// Measurement of a tick without a sample.
    pub(super) fn absent(
        tick: &Tick,
        activity: Activity,
        (restarts, misreads): (u32, u32),
    ) -> Measurement {
        Measurement {
            sample: imu::missing_sample(tick.time),
            raw: None,
            activity,
            fault: None,
            saturated_for_long: false,
            read_at: ReadAt::Edge,
            restarts,
            misreads,
        }
    }

    /// Starts the sensor. Returns [`Fault::SensorReset`] if it had lost its settings.
    pub(super) async fn start(
        &mut self,
        delay: &mut impl DelayNs,
    ) -> Result<Option<SensorFault>, SensorFault> {
        let mut lost = None;
        if self.activity == Activity::Recovering {
            delay.delay_us(BOOT_MICROS).await;
            if self.driver.check_identity().await.is_ok() {
                let verified = self.driver.verify().await;
                lost = verified.err().map(|error| self.fault_of(&error));
                lost = lost.filter(|fault| fault.fault == Fault::SensorReset);
            }
        }
        self.found = None;
        let result = self.driver.init(delay).await;
        result.map_err(|error| self.fault_of(&error))?;
        self.watch.restart();
        Ok(lost)
    }

    pub(super) async fn self_test(
        &mut self,
        delay: &mut impl DelayNs,
    ) -> Result<Option<SensorFault>, SensorFault> {
        let result = self.driver.self_test(delay).await;
        let mut result = result.map_err(|error| self.fault_of(&error))?;
        for change in &mut result.specific_force {
            *change *= self.accelerometer_range;
        }
        Ok((!result.passed())
            .then(|| SensorFault::new(Fault::SensorSelfTest, failed_axes(&result))))
    }
}
