//! The sampling loop: each tick it waits for the following data-ready edge, reads one burst, and checks the sensor's
//! health.
//!
//! [`run`] starts the sensor, waits for each tick and measures, and hands each measurement on. It knows nothing of the
//! foot. `watch` decides from the previous ticks whether a sample is trusted.
//!
//! [`run`] never misses a tick because of the sensor. Initialising the sensor takes 100 ms of waiting, during which every
//! tick is served with "no sample", and the initialisation continues between the ticks. A tick and the initialisation
//! never use the bus at the same time, because without a running sensor a tick has nothing to read.
//!
//! | fault | detected by | after at most |
//! |---|---|---|
//! | no edge, no new sample, an impossible status, or a failed transfer | three bad ticks in five | 3 ticks |
//! | all outputs repeat although they are marked new | [`FROZEN_REPEATS`] repeats | 4 ticks |
//! | the outputs of one sensor, or of one axis, repeat | [`FrozenDetector`](lsm6dsox::FrozenDetector) | 20 to 90 ticks |
//! | wrong identity, or data rates lost, as after a reset | reading back each second tick, after the estimate | 3 ticks |
//! | any other register of the configuration changed | as above, [`READ_BACK_TICKS`] for all of them | 45 ticks |
//! | too many or too few edges, if they are counted | three bad ticks in five | 3 ticks |
//! | outputs at the end of the range for long | [`SATURATED_TICKS`] in a row; until then each sample is flagged | 50 ticks |
//!
//! **Slow bus.** After three errors of the bus, each within 1000 samples of the previous one, its speed is
//! [reduced](BusSpeed::slower) by a step, which halves the clock of SPI, because long wires or a level shifter may leave
//! no time to read the data line. These count as errors:
//!
//! - a start, or a run of measurements, that ends because identity or registers read wrong (failed starts take no samples);
//! - a register that is read correctly only at the second attempt;
//! - a status that no part sends.
//!
//! A board with wires of unknown quality starts below the speed for which it is made. At each start of the sensor the next
//! faster speed is tried before the first sample: every register of the configuration is read back 32 times. A speed with
//! a wrong reading is not tried again, nor is a speed that was left after three errors.
//!
//! **Lost edges.** If edges are missing but samples are new, the fault is in the line of the edges. Samples are then
//! read at the end of the wait for an edge, and this is reported, until edges have come for 1000 ticks again. Reading by
//! the timer begins:
//!
//! - after the third missing edge, if single edges are missing, each within 50 ticks of the previous one;
//! - after one restart of the sensor, if no edge comes;
//! - after two restarts, if many edges are missing.
//!
//! While samples are read by the timer, a rate of edges that stays wrong is a fault of the sensor again.
//!
//! **No line for edges.** A cable with the wires of I²C alone has no wire for edges. Each tick then reads the newest
//! sample, which is at most 150 µs old. Its timestamp assumes the mean age, so it errs by 75 µs at most. A sensor at
//! a rate that is too low shows as samples that are not new.
//!
//! **Flags.** The sample of every bad tick is flagged, even of the first, so that the estimate is "not stable" before
//! the fault is identified. After each start samples stay flagged until each axis has changed, which takes some ten
//! ticks. So an axis that is stuck is never trusted.

mod watch;

use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;

use embedded_hal_async::delay::DelayNs;
use estimator_core::{ImuSample, Timestamp, Validity};
use lsm6dsox::asynch::{BOOT_MICROS, Lsm6dsox};
use lsm6dsox::{AsyncBus, BusSpeed, Config, Error, RawSample, SelfTest, SetBusSpeed, imu};
use wire::{Diagnosis, Fault};

use watch::{SampleIssue, Watch};

pub use watch::{FROZEN_REPEATS, ReadAt, SATURATED_TICKS};

/// Maximum time from a tick to its data-ready edge, µs. Edges are 150 µs apart. A sensor whose clock is a third too
/// slow still keeps this limit.
pub const EDGE_LIMIT_US: u64 = 200;

/// Mean age of the newest sample at the end of the wait for an edge, µs: half the period of the edges.
const MEAN_AGE_US: u64 = 75;

/// Good ticks after which a restart counts as successful, so that the next one need not wait.
const SETTLED_TICKS: u32 = 1000;

/// First and longest wait between two attempts to start the sensor, ticks.
const BACK_OFF_TICKS: (u32, u32) = (10, 1000);

/// Errors of the bus after which its speed is reduced. The sensor's data line may be too slow for the clock.
const SLOW_AFTER: u32 = 3;

/// Number of times that all registers are read back at a higher speed of the bus before it is used.
const TRIALS: u32 = 32;

/// Wait before each of these readings, µs.
const TRIAL_MICROS: u32 = 1_000;

/// Identity of a sound part.
const IDENTITY: u8 = lsm6dsox::register::WHO_AM_I.reset;

/// Index of the last register of the configuration: a data rate.
const LAST_WRITE: usize = Config::WRITES - 1;

/// Ticks for reading back every register of the configuration once.
pub const READ_BACK_TICKS: usize = 2 * LAST_WRITE;

const _: () = assert!(READ_BACK_TICKS == 44);

/// Tick of the timer that drives the sampling, as observed by the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tick {
    /// Time of the tick.
    pub time: Timestamp,
    /// Time of the first data-ready edge after the tick, captured by hardware where the board can, else taken when the
    /// edge is noticed. `None` if no edge came within [`EDGE_LIMIT_US`].
    pub edge: Option<Timestamp>,
    /// Edges since the previous tick, if the hardware counts them.
    pub edges: Option<u16>,
    /// Ticks missed since the previous one, because its work took too long.
    pub missed: u32,
    /// Whether the board has no line for the edges. It then reads the sample at the tick itself.
    pub is_without_line: bool,
}

impl Tick {
    /// Returns the time of the newest sample. It is the time of the edge, or without an edge the expected time of the
    /// sample that is the newest at the end of the wait.
    #[must_use]
    pub fn sampled(&self) -> Timestamp {
        let wait = if self.is_without_line { 0 } else { EDGE_LIMIT_US };
        let expected = (self.time.as_micros() + wait).saturating_sub(MEAN_AGE_US);
        self.edge.unwrap_or(Timestamp::from_micros(expected))
    }
}

/// Timer and captured edges of a board.
pub trait Ticks {
    /// Waits for the next tick, and then for its data-ready edge, at most [`EDGE_LIMIT_US`]. A board without a line for
    /// the edges waits only for the tick.
    fn next(&mut self) -> impl Future<Output = Tick>;
}

/// Runs the sensor forever. Starts it, with its self-test if `self_test` is set, and reads it each tick. Restarts it
/// after a fault, after waits that double from 10 to 1000 ticks. `each` is called with every tick and its measurement.
pub async fn run<BUS: AsyncBus + SetBusSpeed>(
    mut sensor: Sensor<BUS>,
    mut delay: impl DelayNs,
    mut ticks: impl Ticks,
    mut self_test: bool,
    mut each: impl FnMut(&Tick, &Measurement),
) -> ! {
    // Restarts since the sensor last measured well.
    let mut failures = 0_u32;
    loop {
        // Starts the sensor, and tests it once. Each tick meanwhile is served without a sample.
        let (activity, counts) = (sensor.activity, sensor.counts());
        let start = sensor.start(&mut delay);
        let mut started = alongside(start, &mut ticks, |tick| {
            each(tick, &Measurement::absent(tick, activity, counts));
        })
        .await;
        if self_test && let Ok(lost) = started {
            let test = sensor.self_test(&mut delay);
            let tested = alongside(test, &mut ticks, |tick| {
                each(tick, &Measurement::absent(tick, Activity::SelfTest, counts));
            })
            .await;
            self_test = tested.is_err();
            started = tested.map(|failed| failed.or(lost));
        }
        // `reason` is the fault that ends this measuring, or that did not let it begin. `unreported` is the fault that the
        // next tick reports. A start can succeed and yet report a fault, such as a lost configuration or a failed self-test.
        let mut reason = None;
        let mut unreported = match started {
            Ok(fault) => {
                sensor.activity = Activity::Measuring;
                fault
            }
            Err(fault) => {
                reason = Some(fault.fault);
                Some(fault)
            }
        };
        while sensor.activity == Activity::Measuring {
            let tick = ticks.next().await;
            let mut measurement = sensor.measure(&tick).await;
            if let Some(fault) = measurement.fault {
                sensor.activity = Activity::Recovering;
                reason = Some(fault.fault);
            }
            measurement.fault = measurement.fault.or_else(|| unreported.take());
            if sensor.watch.good_ticks >= SETTLED_TICKS {
                failures = 0;
            }
            each(&tick, &measurement);
            // The frames of the tick are sent. The rest of it checks the sensor for the next ticks.
            if sensor.activity == Activity::Measuring {
                sensor.check(&tick).await;
            }
        }
        // Waits, before the next start.
        let (first, longest) = BACK_OFF_TICKS;
        if let Some(Fault::SensorWrongId | Fault::SensorConfigMismatch) = reason {
            sensor.count_bus_error();
        }
        // A first failure while measuring is followed by another attempt at once.
        let wait = if failures == 0 && unreported.is_none() {
            0
        } else {
            (first << failures.min(10)).min(longest)
        };
        failures = failures.saturating_add(1);
        sensor.activity = Activity::Recovering;
        for _ in 0..wait {
            let tick = ticks.next().await;
            let absent = Measurement::absent(&tick, Activity::Recovering, sensor.counts());
            let absent = Measurement { fault: unreported.take(), ..absent };
            each(&tick, &absent);
        }
        sensor.restarts = sensor.restarts.wrapping_add(1);
    }
}

/// Serves ticks without samples until `work` is done, and completes the tick in which that happens.
async fn alongside<T>(
    work: impl Future<Output = T>,
    ticks: &mut impl Ticks,
    mut each: impl FnMut(&Tick),
) -> T {
    let mut work = pin!(work);
    let mut done = None;
    loop {
        let tick = {
            let mut next = pin!(ticks.next());
            poll_fn(|context| {
                if done.is_none()
                    && let Poll::Ready(result) = work.as_mut().poll(context)
                {
                    done = Some(result);
                }
                next.as_mut().poll(context)
            })
            .await
        };
        each(&tick);
        if let Some(result) = done {
            return result;
        }
    }
}

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
    /// Event at which samples are read.
    pub read_at: ReadAt,
    /// Number of restarts of the sensor so far.
    pub restarts: u32,
    /// Number of registers so far that were read correctly only at the second attempt.
    pub misreads: u32,
    /// Health of the sensor's bus.
    pub bus: BusHealth,
}

/// Health of the sensor's bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusHealth {
    /// `WHO_AM_I` as last read; 0 before the first reading.
    pub identity: u8,
    /// Speed in use.
    pub speed: BusSpeed,
    /// Failed transfers and wrong readings so far, at each speed of [`BusSpeed::ALL`].
    pub errors: [u16; BusSpeed::ALL.len()],
}

impl BusHealth {
    /// Counts an error at the speed in use.
    fn count_error(&mut self) {
        if let Some(errors) = self.errors.get_mut(self.speed as usize) {
            *errors = errors.saturating_add(1);
        }
    }

    /// Writes it into a diagnosis.
    pub fn write(&self, diagnosis: &mut Diagnosis) {
        diagnosis.identity = self.identity;
        diagnosis.bus_clock = self.speed as u8;
        diagnosis.bus_errors = self.errors;
    }
}

impl Measurement {
    /// Measurement of a tick without a sample.
    fn absent(tick: &Tick, activity: Activity, counts: Counts) -> Self {
        Self {
            sample: imu::missing_sample(tick.time),
            raw: None,
            activity,
            fault: None,
            saturated_for_long: false,
            read_at: ReadAt::Edge,
            restarts: counts.restarts,
            misreads: counts.misreads,
            bus: counts.bus,
        }
    }
}

/// Counts since the start of the program, for a tick in which the sensor itself is in use.
#[derive(Clone, Copy, Debug)]
struct Counts {
    restarts: u32,
    misreads: u32,
    bus: BusHealth,
}

/// Fault of the sensor, and the detail of its emergency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorFault {
    /// The fault.
    pub fault: Fault,
    /// Detail, with the meaning given by [`Fault::detail`].
    pub detail: u32,
}

impl SensorFault {
    const fn new(fault: Fault, detail: u32) -> Self {
        Self { fault, detail }
    }
}

/// Bit *i*: axis *i* failed.
fn failed_axes(result: &SelfTest) -> u32 {
    let passed = result.accel_passed().into_iter().chain(result.gyro_passed());
    (0..).zip(passed).fold(0, |bits, (axis, passed)| bits | u32::from(!passed) << axis)
}

/// Sensor and the state of its health.
#[derive(Debug)]
pub struct Sensor<BUS> {
    driver: Lsm6dsox<BUS>,
    conversion: imu::Conversion,
    watch: Watch,
    activity: Activity,
    restarts: u32,
    misreads: u32,
    /// Bus and its speed.
    bus: BusHealth,
    /// Fastest speed that may be tried.
    fastest: BusSpeed,
    /// Errors of the bus that count for its speed.
    bus_errors: u32,
    /// [`Watch::turn`] of the last of them.
    error_turn: usize,
    /// Fault of the register that was read back after the previous sample.
    found: Option<SensorFault>,
    /// Factor of the changes in the accelerometer's self-test.
    accelerometer_range: f32,
}

impl<BUS: AsyncBus + SetBusSpeed> Sensor<BUS> {
    /// Creates a sensor that has not been started. `config` must give a new sample at least each tick.
    pub fn new(bus: BUS, config: Config) -> Self {
        Self {
            conversion: imu::Conversion::new(&config),
            driver: Lsm6dsox::new(bus, config),
            watch: Watch::default(),
            activity: Activity::Starting,
            restarts: 0,
            misreads: 0,
            bus: BusHealth::default(),
            fastest: BusSpeed::Full,
            bus_errors: 0,
            error_turn: 0,
            found: None,
            accelerometer_range: 1.0,
        }
    }

    /// Sets the factor of the accelerometer's range, 1 for ±16 g and 2 for ±32 g, for its self-test:
    /// [`Settings::accelerometer_range`](wire::Settings::accelerometer_range).
    #[must_use]
    pub fn with_accelerometer_range(self, range: f32) -> Self {
        Self { accelerometer_range: range, ..self }
    }

    /// Sets the speed at which the bus has been started, and the fastest that may be tried.
    #[must_use]
    pub fn with_bus_speeds(self, speed: BusSpeed, fastest: BusSpeed) -> Self {
        Self { bus: BusHealth { speed, ..self.bus }, fastest, ..self }
    }

    /// Counts a misread, or a start that failed because of one. [`SLOW_AFTER`] of them, each within 1000 ticks of the
    /// previous one, reduce the speed of the bus by a step until the board restarts.
    fn count_bus_error(&mut self) {
        let is_soon = self.watch.turn.wrapping_sub(self.error_turn) <= SETTLED_TICKS as usize;
        self.bus_errors = if is_soon { self.bus_errors + 1 } else { 1 };
        self.error_turn = self.watch.turn;
        if self.bus_errors >= SLOW_AFTER {
            self.bus_errors = 0;
            self.fastest = self.bus.speed.slower();
            self.set_speed(self.fastest);
        }
    }

    fn set_speed(&mut self, speed: BusSpeed) {
        self.bus.speed = speed;
        self.driver.bus().set_bus_speed(speed);
    }

    /// Tries faster speeds of the bus, up to the fastest that may be tried. Returns whether a speed had a wrong reading.
    /// In that case the sensor must be started again, because a read may have arrived as a write.
    async fn raise_speed(&mut self, delay: &mut impl DelayNs) -> bool {
        while self.bus.speed < self.fastest {
            let proven = self.bus.speed;
            self.set_speed(proven.faster());
            for _ in 0..TRIALS {
                // The wait lets the ticks go on, because SPI may read all registers for half a millisecond without one.
                delay.delay_us(TRIAL_MICROS).await;
                let identity = self.driver.check_identity().await;
                if identity.is_err() || self.driver.verify().await.is_err() {
                    self.bus.count_error();
                    self.fastest = proven;
                    self.set_speed(proven);
                    return true;
                }
            }
        }
        false
    }

    /// Reads the sample of a tick.
    pub async fn measure(&mut self, tick: &Tick) -> Measurement {
        self.watch.turn = self.watch.turn.wrapping_add(1);
        let read = self.driver.sample().await;
        let time = tick.sampled();
        let (raw, issue) = match read {
            Ok(raw) => {
                let issue = self.watch.issue(tick, &raw);
                (Some(raw), issue.or_else(|| self.unchanged_axis()))
            }
            Err(Error::Status { read, .. }) => {
                self.bus.count_error();
                self.count_bus_error();
                (None, Some(SampleIssue::Status(read)))
            }
            Err(_) => {
                self.bus.count_error();
                (None, Some(SampleIssue::Bus))
            }
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
            bus: self.bus,
        }
    }

    /// Reads back one register, after the estimate. The next tick reports a difference as a fault.
    async fn check(&mut self, tick: &Tick) {
        self.found = self.read_back_one_register(tick.time).await;
    }

    /// Returns an issue if some axis has not changed since the start. Such an axis may be stuck, but that is detected
    /// only later.
    fn unchanged_axis(&self) -> Option<SampleIssue> {
        (!self.watch.frozen.every_axis_has_changed()).then_some(SampleIssue::AxisUnchanged)
    }

    const fn counts(&self) -> Counts {
        Counts { restarts: self.restarts, misreads: self.misreads, bus: self.bus }
    }

    /// Starts the sensor. Returns [`Fault::SensorReset`] if it had lost its settings.
    async fn start(
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
        let mut result = self.driver.init(delay).await;
        if result.is_ok() && self.raise_speed(delay).await {
            result = self.driver.init(delay).await;
        }
        match &result {
            Ok(()) => self.bus.identity = IDENTITY,
            Err(Error::Identity { read }) => self.bus.identity = *read,
            Err(_) => self.bus.count_error(),
        }
        result.map_err(|error| self.fault_of(&error))?;
        self.watch.restart();
        Ok(lost)
    }

    /// Tests the sensor. Returns [`Fault::SensorSelfTest`] if it has failed.
    async fn self_test(
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

    /// Reads back in turns the identity with a data rate, which a failed sensor loses first, and one other register of
    /// the configuration.
    ///
    /// A difference counts once it has been read twice. A difference that is not read again is a misread. An identity
    /// that reads as an idle line does not count: such a sensor gives no samples either, and the bad ticks raise the
    /// fault.
    async fn read_back_one_register(&mut self, now: Timestamp) -> Option<SensorFault> {
        let turn = self.watch.turn;
        let write = if turn.is_multiple_of(2) {
            None
        } else {
            self.driver.config().write(turn / 2 % LAST_WRITE)
        };
        for misreads in 0..2 {
            let result = match write {
                None => self.driver.check_identity_and_rate().await,
                Some(write) => self.driver.check(write).await,
            };
            if result.is_ok() {
                if misreads > 0 {
                    self.bus.count_error();
                    self.misreads = self.misreads.wrapping_add(misreads);
                    self.count_bus_error();
                }
                return None;
            }
        }
        match self.driver.check_identity().await {
            Err(Error::Identity { read: 0x00 | 0xFF }) => None,
            _ => Some(self.diagnose(SampleIssue::Stale, now).await),
        }
    }

    /// Finds the cause of bad ticks: checks the identity first, then every register, then takes the issue itself.
    async fn diagnose(&mut self, issue: SampleIssue, now: Timestamp) -> SensorFault {
        let silent_us = self.watch.last_good.and_then(|good| now.micros_since(good));
        let silent_us = silent_us.map_or(u32::MAX, |us| us.min(u64::from(u32::MAX)) as u32);
        let silence = SensorFault::new(Fault::SensorSilent, silent_us);
        let timing = SensorFault::new(Fault::SensorTiming, self.watch.bad_ticks);
        let without_edge = self.watch.without_edge;
        match self.driver.check_identity().await {
            // An idle line and no edges: no part, or one that is still booting.
            Err(Error::Identity { read: 0x00 | 0xFF }) if without_edge >= 2 => return silence,
            Err(error) => return self.fault_of(&error),
            Ok(()) => {}
        }
        if let Err(error) = self.driver.verify().await {
            return self.fault_of(&error);
        }
        match issue {
            SampleIssue::Repeat => SensorFault::new(Fault::SensorFrozen, self.watch.frozen_axes()),
            SampleIssue::Unannounced if without_edge >= 2 => {
                self.watch.read_by_timer();
                silence
            }
            SampleIssue::Unannounced if self.watch.has_lost_edges() => {
                self.watch.read_by_timer();
                timing
            }
            SampleIssue::Edge if without_edge >= 3 => silence,
            SampleIssue::Edge
            | SampleIssue::Unannounced
            | SampleIssue::Rate
            | SampleIssue::Stale
            | SampleIssue::AxisUnchanged => timing,
            SampleIssue::Status(read) => {
                self.fault_of(&Error::Status { register: lsm6dsox::register::STATUS_REG, read })
            }
            SampleIssue::Bus => silence,
        }
    }

    fn fault_of(&self, error: &Error<BUS::Error>) -> SensorFault {
        let registers =
            |address: u8, written: u8, read: u8| u32::from_le_bytes([address, written, read, 0]);
        match *error {
            Error::Identity { read } => SensorFault::new(Fault::SensorWrongId, u32::from(read)),
            Error::ReadBack { register, read, .. } if register.agree(read, register.reset) => {
                SensorFault::new(Fault::SensorReset, self.watch.bad_ticks)
            }
            Error::ReadBack { register, written, read } => SensorFault::new(
                Fault::SensorConfigMismatch,
                registers(register.address, written, read),
            ),
            Error::Status { register, read } => {
                SensorFault::new(Fault::SensorConfigMismatch, registers(register.address, 0, read))
            }
            Error::ResetTimeout { written, read } => SensorFault::new(
                Fault::SensorConfigMismatch,
                registers(lsm6dsox::register::CTRL3_C.address, written, read),
            ),
            Error::Bus(_) | Error::DataReadyTimeout { .. } | Error::Unconfigured => {
                SensorFault::new(Fault::SensorSilent, u32::MAX)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use core::task::{Context, Waker};

    use lsm6dsox::sim::{Part, PartOptions, Stimulus};

    use super::*;

    #[test]
    fn bus_is_raised_to_the_fastest_speed_that_reads_right() {
        // Delay of the part's data after the clock's edge, ns. It must be less than half a period, which is 200 ns at
        // the reduced and 400 ns at the lowest speed.
        for (sdo_delay_ns, speed) in [(25, BusSpeed::Reduced), (300, BusSpeed::Lowest)] {
            let options = PartOptions { sdo_delay_ns, ..PartOptions::DEFAULT };
            let part = Part::with_options(|_: f64| Stimulus::REST, options).shared();
            let mut spi = part.spi();
            spi.set_bus_speed(BusSpeed::Lowest);
            let mut sensor = Sensor::new(spi, Config::FRESH_KILOHERTZ)
                .with_bus_speeds(BusSpeed::Lowest, BusSpeed::Reduced);
            let mut delay = part.delay();
            let mut context = Context::from_waker(Waker::noop());
            let started = pin!(sensor.start(&mut delay)).poll(&mut context);
            assert_eq!(started, Poll::Ready(Ok(None)));
            assert_eq!((sensor.bus.speed, sensor.fastest), (speed, speed), "{sdo_delay_ns} ns");
        }
    }

    #[test]
    fn each_axis_that_fails_the_self_test_sets_its_bit() {
        for axis in 0..6 {
            // Within ST's limits: 0.05 g to 1.7 g, 150 °/s to 700 °/s.
            let mut result = SelfTest { specific_force: [4.9; 3], angular_rate: [7.0; 3] };
            assert_eq!(failed_axes(&result), 0);
            match axis {
                0..3 => result.specific_force[axis] = 0.0,
                _ => result.angular_rate[axis - 3] = 0.0,
            }
            assert_eq!(failed_axes(&result), 1 << axis);
        }
    }
}
