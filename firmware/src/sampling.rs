//! The sampling loop: each tick the data-ready edge that follows it, one burst, and a look at
//! whether the sensor is still itself.
//!
//! [`run`] never misses a tick for the sensor's sake. While the sensor is being initialised, which
//! takes 100 ms of waiting, both run side by side: every tick is served with "no sample", and the
//! initialisation goes on between them. Ticks and initialisation never use the bus together,
//! because without a running sensor a tick has nothing to read.
//!
//! | what is wrong | how it is noticed | after at most |
//! |---|---|---|
//! | no edge, nothing new, a status that no part sends, a transfer that fails | three bad ticks within twenty | 3 ticks |
//! | all outputs repeat, and say they are new | [`FROZEN_REPEATS`] repeats | 4 ticks |
//! | the outputs of one sensor, or of one axis, repeat | [`FrozenDetector`] | 20 to 90 ticks |
//! | another identity, data rates gone, as after a reset | read back in turns, one register a tick | 3 ticks |
//! | any other register of the configuration | as above, [`READ_BACK_TICKS`] for all of them | 66 ticks |
//! | edges too many or too few, where they are counted | three bad ticks within twenty | 3 ticks |
//! | at the end of the range for long | [`SATURATED_TICKS`] in a row; until then each sample is flagged | 50 ticks |
//!
//! After three failures in a row to read identity or registers right, the clock of the bus is halved:
//! at full speed the slowest data line that the part may have leaves no time to read it.
//!
//! From the first bad tick on its sample is flagged, so that the estimate says "not stable" before
//! the fault has a name. After outputs have repeated, samples stay flagged until each axis has
//! changed: an axis that is still stuck never gets to be believed again.

use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::SpiDevice;
use estimator_core::{ImuSample, Timestamp, Validity};
use lsm6dsox::asynch::{BOOT_MICROS, Lsm6dsox};
use lsm6dsox::config::Write;
use lsm6dsox::{Error, FrozenDetector, RawSample, SelfTest, SetSpiClock, SpiClock};
use wire::Fault;

use crate::imu;

/// How long after its tick a data-ready edge may come, µs. Edges are 150 µs apart; a sensor whose
/// clock is a third too slow still keeps within it.
pub const EDGE_LIMIT_US: u64 = 200;

/// Data-ready edges from one tick to the next, where they are counted: 6.67, give or take one and
/// 10 % of the sensor's clock.
const EDGES: core::ops::RangeInclusive<u16> = 5..=8;

/// How often a sample may repeat, with all six codes, before the sensor counts as frozen. With the
/// noise of the preset all six codes repeat by chance once in 137 000 samples at rest, three times in a
/// row once in 80 000 years; with half of that noise it would be three times a year, and once a day
/// where the mean of each axis lies in the middle of a code. Four repeats would take up to 5.0 ms.
pub const FROZEN_REPEATS: u16 = 3;

/// From here on a repeat is no longer taken for a sample.
const DOUBTFUL_REPEATS: u16 = 2;

/// Ticks at the end of the range from which on it is no impact any more.
pub const SATURATED_TICKS: u16 = 50;

/// A bad tick adds this to the count of bad ticks, a good one takes 1 away.
const BAD_TICK: u16 = 20;

/// Three bad ticks within twenty.
const TOO_BAD: u16 = 3 * BAD_TICK - 2;

/// Good ticks after which a restart counts as a success, so that the next one need not wait.
const SETTLED_TICKS: u32 = 1000;

/// The first and the longest wait between two attempts to start the sensor, ticks.
const BACK_OFF_TICKS: (u32, u32) = (10, 1000);

/// Wrong identities or registers in a row after which the bus is slowed down, until the board starts
/// again: the sensor's data line may be too slow for the clock.
const SLOW_AFTER: u32 = 3;

/// The configuration of the sensor as it was written; data rates come last.
static WRITES: [Write; imu::SENSOR.writes().len()] = imu::SENSOR.writes();

/// Ticks in which every register of the configuration is read back.
pub const READ_BACK_TICKS: usize = 3 * (WRITES.len() - 1);

const _: () = assert!(READ_BACK_TICKS == 66);

/// A tick of the timer that is master of the sampling, as the board saw it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tick {
    /// When the timer ticked.
    pub time: Timestamp,
    /// The first data-ready edge after it, captured by hardware; `None` where none came within
    /// [`EDGE_LIMIT_US`].
    pub edge: Option<Timestamp>,
    /// How many edges came since the tick before, where the hardware counts them.
    pub edges: Option<u16>,
    /// Ticks that went by unserved since the one before, because its work took too long.
    pub missed: u32,
}

/// The timer and the captured edges of a board.
pub trait Ticks {
    /// Waits for the next tick, and then for its data-ready edge, at most [`EDGE_LIMIT_US`].
    fn next(&mut self) -> impl Future<Output = Tick>;
}

/// A fault of the sensor, and what [`Fault::detail`] says of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trouble {
    /// Which.
    pub fault: Fault,
    /// Its detail.
    pub detail: u32,
}

impl Trouble {
    const fn new(fault: Fault, detail: u32) -> Self {
        Self { fault, detail }
    }
}

/// What the sensor is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// It is found and configured for the first time.
    #[default]
    Starting,
    /// It tests itself.
    SelfTest,
    /// It measures.
    Measuring,
    /// It has failed and is initialised again.
    Recovering,
}

/// What a tick gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// The sample for the estimator; invalid where there is none.
    pub sample: ImuSample,
    /// What the sensor said, where it said something.
    pub raw: Option<RawSample>,
    /// What the sensor is doing.
    pub activity: Activity,
    /// What was found wrong on this tick.
    pub trouble: Option<Trouble>,
    /// Whether the sensor has been at the end of its range for longer than an impact lasts.
    pub saturated_for_long: bool,
    /// How often the sensor was initialised again so far.
    pub restarts: u32,
}

/// The sensor and what is known about its health.
#[derive(Debug)]
pub struct Sensor<SPI> {
    driver: Lsm6dsox<SPI>,
    watch: Watch,
    activity: Activity,
    restarts: u32,
    standing: Standing,
}

/// Whether the sensor's samples are believed from the first one after its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Standing {
    /// They are.
    #[default]
    Trusted,
    /// Its outputs have repeated: only once each axis has changed.
    OnProbation,
}

/// What the recent ticks were like.
#[derive(Clone, Copy, Debug, Default)]
struct Watch {
    frozen: FrozenDetector,
    badness: u16,
    bad_ticks: u32,
    good_ticks: u32,
    saturated_ticks: u16,
    last_good: Option<Timestamp>,
    /// Ticks since the last edge.
    without_edge: u16,
    /// Whose turn it is to be read back.
    turn: usize,
}

/// What is wrong with one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Doubt {
    /// No edge came.
    Edge,
    /// The edges are not the sensor's.
    Rate,
    /// Nothing new was read.
    Stale,
    /// What was read is not a sample.
    Status(u8),
    /// The transfer failed.
    Bus,
    /// The sample repeats the one before, and not for the first time, or some of its axes have for
    /// long.
    Repeat,
    /// An axis has not changed since the start, which has followed repeats.
    Unproven,
}

impl<SPI: SpiDevice + SetSpiClock> Sensor<SPI> {
    /// A sensor that has not been touched yet.
    pub fn new(spi: SPI) -> Self {
        Self {
            driver: Lsm6dsox::new(spi, imu::SENSOR),
            watch: Watch::default(),
            activity: Activity::Starting,
            restarts: 0,
            standing: Standing::Trusted,
        }
    }

    /// Reads the sample of a tick, and one register back.
    pub async fn measure(&mut self, tick: &Tick) -> Measurement {
        self.watch.turn = self.watch.turn.wrapping_add(1);
        let read = self.driver.sample().await;
        let time = tick.edge.unwrap_or(tick.time);
        let (raw, doubt) = match read {
            Ok(raw) => {
                let doubt = self.watch.doubt(tick, &raw);
                (Some(raw), doubt.or_else(|| self.unproven()))
            }
            Err(Error::Status { read, .. }) => (None, Some(Doubt::Status(read))),
            Err(_) => (None, Some(Doubt::Bus)),
        };
        let trouble = match self.watch.judge(doubt, time) {
            Some(doubt) => Some(self.diagnose(doubt, time).await),
            None => self.look_at_one_register(time).await,
        };
        let mut sample = match &raw {
            Some(raw) => imu::imu_sample(raw, time),
            None => imu::missing_sample(time),
        };
        if doubt.is_some() && sample.validity != Validity::Invalid {
            sample.validity = Validity::Stale;
        }
        if let Some(trouble) = trouble {
            sample.validity = Validity::Invalid;
            if trouble.fault == Fault::SensorFrozen {
                self.standing = Standing::OnProbation;
            }
        }
        Measurement {
            sample,
            raw,
            activity: Activity::Measuring,
            trouble,
            saturated_for_long: self.watch.saturated_ticks >= SATURATED_TICKS,
            restarts: self.restarts,
        }
    }

    /// Whether a sensor on probation has yet to show that each axis is alive.
    fn unproven(&mut self) -> Option<Doubt> {
        if self.standing == Standing::Trusted {
            return None;
        }
        if self.watch.frozen.every_axis_has_changed() {
            self.standing = Standing::Trusted;
            return None;
        }
        Some(Doubt::Unproven)
    }

    /// What stands in for a sample while there is none.
    fn absent(tick: &Tick, activity: Activity, restarts: u32) -> Measurement {
        Measurement {
            sample: imu::missing_sample(tick.time),
            raw: None,
            activity,
            trouble: None,
            saturated_for_long: false,
            restarts,
        }
    }

    /// The identity, a data rate, which are what a failed sensor loses, and one register of the rest
    /// of the configuration, in turns. A difference counts once it
    /// has been read twice, and the identity is not that of a line at rest: then there is nothing
    /// new to read either, and bad ticks tell.
    async fn look_at_one_register(&mut self, now: Timestamp) -> Option<Trouble> {
        let turn = self.watch.turn;
        let write = match (turn % 3, WRITES.split_last()) {
            (0, _) | (_, None) => None,
            (1, Some((last, _))) => Some(*last),
            (_, Some((_, rest))) => rest.get(turn / 3 % (WRITES.len() - 1)).copied(),
        };
        for _ in 0..2 {
            let result = match write {
                None => self.driver.check_identity().await,
                Some(write) => self.driver.check(write).await,
            };
            if result.is_ok() {
                return None;
            }
        }
        match self.driver.check_identity().await {
            Err(Error::Identity { read: 0x00 | 0xFF }) => None,
            _ => Some(self.diagnose(Doubt::Stale, now).await),
        }
    }

    /// Looks for what is behind bad ticks: identity first, then every register.
    async fn diagnose(&mut self, doubt: Doubt, now: Timestamp) -> Trouble {
        let silent_us = self.watch.last_good.and_then(|good| now.micros_since(good));
        let silent_us = silent_us.map_or(u32::MAX, |us| us.min(u64::from(u32::MAX)) as u32);
        let silence = Trouble::new(Fault::SensorSilent, silent_us);
        let without_edge = self.watch.without_edge;
        match self.driver.check_identity().await {
            // A line at rest and no edges: nobody there, or a part that is still booting.
            Err(Error::Identity { read: 0x00 | 0xFF }) if without_edge >= 2 => return silence,
            Err(error) => return self.trouble_of(&error),
            Ok(()) => {}
        }
        if let Err(error) = self.driver.verify().await {
            return self.trouble_of(&error);
        }
        match doubt {
            Doubt::Repeat => Trouble::new(Fault::SensorFrozen, self.watch.frozen_axes()),
            Doubt::Edge if without_edge >= 3 => silence,
            Doubt::Edge | Doubt::Rate | Doubt::Stale | Doubt::Unproven => {
                Trouble::new(Fault::SensorTiming, self.watch.bad_ticks)
            }
            Doubt::Status(read) => self.trouble_of(&Error::Status {
                register: lsm6dsox::register::STATUS_REG,
                read,
            }),
            Doubt::Bus => silence,
        }
    }

    fn trouble_of(&self, error: &Error<SPI::Error>) -> Trouble {
        let registers =
            |address: u8, written: u8, read: u8| u32::from_le_bytes([address, written, read, 0]);
        match *error {
            Error::Identity { read } => Trouble::new(Fault::SensorWrongId, u32::from(read)),
            Error::ReadBack { register, read, .. } if read == register.reset => {
                Trouble::new(Fault::SensorReset, self.watch.bad_ticks)
            }
            Error::ReadBack {
                register,
                written,
                read,
            } => Trouble::new(
                Fault::SensorConfigMismatch,
                registers(register.address, written, read),
            ),
            Error::Status { register, read } => Trouble::new(
                Fault::SensorConfigMismatch,
                registers(register.address, 0, read),
            ),
            Error::ResetTimeout { written, read } => Trouble::new(
                Fault::SensorConfigMismatch,
                registers(lsm6dsox::register::CTRL3_C.address, written, read),
            ),
            Error::Bus(_) | Error::DataReadyTimeout { .. } | Error::Unconfigured => {
                Trouble::new(Fault::SensorSilent, u32::MAX)
            }
        }
    }

    /// Brings the sensor up. Where it answers with its settings gone, it says so.
    async fn start(&mut self, delay: &mut impl DelayNs) -> Result<Option<Trouble>, Trouble> {
        let mut lost = None;
        if self.activity == Activity::Recovering {
            delay.delay_us(BOOT_MICROS).await;
            if self.driver.check_identity().await.is_ok() {
                let verified = self.driver.verify().await;
                lost = verified.err().map(|error| self.trouble_of(&error));
                lost = lost.filter(|trouble| trouble.fault == Fault::SensorReset);
            }
        }
        let result = self.driver.init(delay).await;
        result.map_err(|error| self.trouble_of(&error))?;
        let turn = self.watch.turn;
        self.watch = Watch {
            turn,
            ..Watch::default()
        };
        Ok(lost)
    }

    async fn self_test(&mut self, delay: &mut impl DelayNs) -> Result<Option<Trouble>, Trouble> {
        let result = self.driver.self_test(delay).await;
        let result = result.map_err(|error| self.trouble_of(&error))?;
        Ok((!result.passed()).then(|| Trouble::new(Fault::SensorSelfTest, failed_axes(&result))))
    }
}

/// Bit *i*: axis *i* failed.
fn failed_axes(result: &SelfTest) -> u32 {
    let passed = result
        .accel_passed()
        .into_iter()
        .chain(result.gyro_passed());
    (0..)
        .zip(passed)
        .fold(0, |bits, (axis, passed)| bits | u32::from(!passed) << axis)
}

impl Watch {
    /// What is wrong with this sample, if anything.
    fn doubt(&mut self, tick: &Tick, raw: &RawSample) -> Option<Doubt> {
        // An edge that came too late for its tick is an edge.
        self.without_edge = if tick.edge.is_some() || tick.edges.is_some_and(|edges| edges > 0) {
            0
        } else {
            self.without_edge.saturating_add(1)
        };
        let saturated = raw.is_saturated();
        self.saturated_ticks = if raw.is_fresh() && saturated {
            self.saturated_ticks.saturating_add(1)
        } else {
            0
        };
        // At the end of the range repeats are no sign of anything.
        if !saturated {
            self.frozen.update(raw);
        }
        if tick.edge.is_none() {
            Some(Doubt::Edge)
        } else if !raw.is_fresh() {
            Some(Doubt::Stale)
        } else if self.frozen.repeats() >= DOUBTFUL_REPEATS || self.frozen.frozen() != 0 {
            Some(Doubt::Repeat)
        } else if tick.missed == 0 && tick.edges.is_some_and(|edges| !EDGES.contains(&edges)) {
            Some(Doubt::Rate)
        } else {
            None
        }
    }

    /// Bit *i*: axis *i* repeats, in the order ax ay az wx wy wz.
    fn frozen_axes(&self) -> u32 {
        let axes = if self.frozen.repeats() >= FROZEN_REPEATS {
            FrozenDetector::EVERY_AXIS
        } else {
            self.frozen.frozen()
        };
        u32::from(axes)
    }

    /// Adds a tick to the count; gives the doubt back where it was one too many.
    fn judge(&mut self, doubt: Option<Doubt>, now: Timestamp) -> Option<Doubt> {
        let Some(doubt) = doubt else {
            self.badness = self.badness.saturating_sub(1);
            self.bad_ticks = 0;
            self.good_ticks = self.good_ticks.saturating_add(1);
            self.last_good = Some(now);
            return None;
        };
        self.bad_ticks = self.bad_ticks.saturating_add(1);
        match doubt {
            // Counted by the detector itself.
            Doubt::Repeat => return (self.frozen_axes() != 0).then_some(doubt),
            Doubt::Unproven => return None,
            _ => {}
        }
        self.badness = self.badness.saturating_add(BAD_TICK);
        (self.badness >= TOO_BAD).then_some(doubt)
    }
}

/// Runs the sensor for ever: starts it, with its self-test where `self_test` says so, reads it
/// each tick, and starts it again when it has failed, after waits that double from 10 ms to 1 s.
/// `each` gets every tick with what it gave.
pub async fn run<SPI: SpiDevice + SetSpiClock>(
    mut sensor: Sensor<SPI>,
    mut delay: impl DelayNs,
    mut ticks: impl Ticks,
    mut self_test: bool,
    mut each: impl FnMut(&Tick, &Measurement),
) -> ! {
    let mut failures = 0_u32;
    let mut misread = 0_u32;
    loop {
        let (activity, restarts) = (sensor.activity, sensor.restarts);
        let mut started = alongside(sensor.start(&mut delay), &mut ticks, |tick| {
            each(tick, &Sensor::<SPI>::absent(tick, activity, restarts));
        })
        .await;
        if self_test && started.is_ok() {
            started = alongside(sensor.self_test(&mut delay), &mut ticks, |tick| {
                let absent = Sensor::<SPI>::absent(tick, Activity::SelfTest, restarts);
                each(tick, &absent);
            })
            .await;
            self_test = started.is_err();
        }
        let mut reason = None;
        let mut news = match started {
            Ok(trouble) => {
                sensor.activity = Activity::Measuring;
                trouble
            }
            Err(trouble) => {
                reason = Some(trouble.fault);
                Some(trouble)
            }
        };
        while sensor.activity == Activity::Measuring {
            let tick = ticks.next().await;
            let mut measurement = sensor.measure(&tick).await;
            if let Some(trouble) = measurement.trouble {
                sensor.activity = Activity::Recovering;
                reason = Some(trouble.fault);
            }
            measurement.trouble = measurement.trouble.or_else(|| news.take());
            if sensor.watch.good_ticks >= SETTLED_TICKS {
                failures = 0;
                misread = 0;
            }
            each(&tick, &measurement);
        }
        // A first failure is followed by another attempt at once.
        let (first, longest) = BACK_OFF_TICKS;
        misread = match reason {
            Some(Fault::SensorWrongId | Fault::SensorConfigMismatch) => misread.saturating_add(1),
            _ => 0,
        };
        if misread == SLOW_AFTER {
            sensor.driver.bus().set_spi_clock(SpiClock::Half);
        }
        let wait = match failures {
            0 if news.is_none() => 0,
            failures => (first << failures.min(10)).min(longest),
        };
        failures = failures.saturating_add(1);
        sensor.activity = Activity::Recovering;
        for _ in 0..wait {
            let tick = ticks.next().await;
            let mut absent = Sensor::<SPI>::absent(&tick, Activity::Recovering, sensor.restarts);
            absent.trouble = news.take();
            each(&tick, &absent);
        }
        sensor.restarts = sensor.restarts.wrapping_add(1);
    }
}

/// Serves ticks until `work` is done, and to the end of the tick on which it is.
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
