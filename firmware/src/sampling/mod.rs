//! The sampling loop: each tick the following data-ready edge, one burst, and a check of the
//! sensor's health.
//!
//! | step | file |
//! |---|---|
//! | start, ticks, restart after a fault | this one |
//! | the measurement of a tick | `sensor` |
//! | is the sample believed? | `watch` |
//! | which fault is it? | `diagnosis`, `fault` |
//!
//! [`run`] never misses a tick because of the sensor. While the sensor is being initialised, which
//! takes 100 ms of waiting, both run concurrently: every tick is served with "no sample", and the
//! initialisation continues between them. Ticks and initialisation never use the bus at the same time,
//! because without a running sensor a tick has nothing to read.
//!
//! | what is wrong | how it is noticed | after at most |
//! |---|---|---|
//! | no edge, nothing new, a status that no part sends, a transfer that fails | three bad ticks in five | 3 ticks |
//! | all outputs repeat, and say they are new | [`FROZEN_REPEATS`] repeats | 4 ticks |
//! | the outputs of one sensor, or of one axis, repeat | [`FrozenDetector`](lsm6dsox::FrozenDetector) | 20 to 90 ticks |
//! | another identity, data rates gone, as after a reset | read back each second tick, after the estimate | 3 ticks |
//! | any other register of the configuration | as above, [`READ_BACK_TICKS`] for all of them | 45 ticks |
//! | edges too many or too few, where they are counted | three bad ticks in five | 3 ticks |
//! | at the end of the range for long | [`SATURATED_TICKS`] in a row; until then each sample is flagged | 50 ticks |
//!
//! After three errors of the bus, each within a second of the one before, its clock is halved, down to 1.25 MHz: long
//! wires or a level shifter may leave no time to read the data line. Errors are a start that fails to read identity or
//! registers correctly, a register that is read right at the second attempt, and a status that no part sends.
//!
//! Where edges are missing and samples are new, the fault is in the line of the edges: the samples are read at the end
//! of the wait for an edge, which is reported, until edges have come for a second again. With single edges missing that
//! begins after the third, each within 50 ticks of the one before; with none, after a restart of the sensor; with many, after two. Meanwhile a rate of edges that
//! stays wrong is a fault of the sensor again.
//!
//! From the first bad tick on its sample is flagged, so that the estimate is "not stable" before
//! the fault is identified. After each start samples stay flagged until each axis has changed, for some
//! ten ticks: an axis that is stuck is never trusted.

mod diagnosis;
mod fault;
mod sensor;
mod watch;

use core::future::poll_fn;
use core::pin::pin;
use core::task::Poll;

use embedded_hal_async::delay::DelayNs;
use estimator_core::Timestamp;
use lsm6dsox::{AsyncBus, SetSpiClock};
use wire::Fault;

pub use diagnosis::READ_BACK_TICKS;
pub use fault::SensorFault;
pub use sensor::{Activity, Measurement, Sensor};
pub use watch::{FROZEN_REPEATS, ReadAt, SATURATED_TICKS};

/// Maximum time from a tick to its data-ready edge, µs. Edges are 150 µs apart; a sensor whose
/// clock is a third too slow still keeps within it.
pub const EDGE_LIMIT_US: u64 = 200;

/// Mean age of the newest sample at the end of the wait for an edge, µs: half the period of the edges.
const MEAN_AGE_US: u64 = 75;

/// Good ticks after which a restart counts as successful, so that the next one need not wait.
const SETTLED_TICKS: u32 = 1000;

/// First and longest wait between two attempts to start the sensor, ticks.
const BACK_OFF_TICKS: (u32, u32) = (10, 1000);

/// Errors of the bus after which it is slowed down: the sensor's data line may be too slow for the clock.
const SLOW_AFTER: u32 = 3;

/// Tick of the timer that drives the sampling, as observed by the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tick {
    /// Time of the tick.
    pub time: Timestamp,
    /// First data-ready edge after it, captured by hardware; `None` if none came within
    /// [`EDGE_LIMIT_US`].
    pub edge: Option<Timestamp>,
    /// Edges since the previous tick, if the hardware counts them.
    pub edges: Option<u16>,
    /// Ticks missed since the previous one, because its work took too long.
    pub missed: u32,
}

impl Tick {
    /// Time of the newest sample: of the edge, or as expected at the end of the wait for one.
    #[must_use]
    pub fn sampled(&self) -> Timestamp {
        let expected = self.time.as_micros() + EDGE_LIMIT_US - MEAN_AGE_US;
        self.edge.unwrap_or(Timestamp::from_micros(expected))
    }
}

/// Timer and captured edges of a board.
pub trait Ticks {
    /// Waits for the next tick, and then for its data-ready edge, at most [`EDGE_LIMIT_US`].
    fn next(&mut self) -> impl Future<Output = Tick>;
}

/// Runs the sensor forever: starts it, with its self-test if `self_test` is set, reads it each
/// tick, and starts it again after a fault, after waits that double from 10 ms to 1 s. `each` is
/// called with every tick and its measurement.
pub async fn run<BUS: AsyncBus + SetSpiClock>(
    mut sensor: Sensor<BUS>,
    mut delay: impl DelayNs,
    mut ticks: impl Ticks,
    mut self_test: bool,
    mut each: impl FnMut(&Tick, &Measurement),
) -> ! {
    let mut failures = 0_u32;
    loop {
        let (activity, counts) = (sensor.activity, sensor.counts());
        let mut started = alongside(sensor.start(&mut delay), &mut ticks, |tick| {
            each(tick, &Sensor::<BUS>::absent(tick, activity, counts));
        })
        .await;
        if self_test && started.is_ok() {
            started = alongside(sensor.self_test(&mut delay), &mut ticks, |tick| {
                let absent = Sensor::<BUS>::absent(tick, Activity::SelfTest, counts);
                each(tick, &absent);
            })
            .await;
            self_test = started.is_err();
        }
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
            if sensor.activity == Activity::Measuring {
                sensor.check(&tick).await;
            }
        }
        // The first failure is followed by another attempt at once.
        let (first, longest) = BACK_OFF_TICKS;
        if let Some(Fault::SensorWrongId | Fault::SensorConfigMismatch) = reason {
            sensor.count_bus_error();
        }
        let wait = match failures {
            0 if unreported.is_none() => 0,
            failures => (first << failures.min(10)).min(longest),
        };
        failures = failures.saturating_add(1);
        sensor.activity = Activity::Recovering;
        for _ in 0..wait {
            let tick = ticks.next().await;
            let mut absent = Sensor::<BUS>::absent(&tick, Activity::Recovering, sensor.counts());
            absent.fault = unreported.take();
            each(&tick, &absent);
        }
        sensor.restarts = sensor.restarts.wrapping_add(1);
    }
}

/// Serves ticks until `work` is done, to the end of the tick on which it completes.
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
