//! Ticks, and the data-ready edge after each where the board has a line for it.

use embassy_rp::gpio::Input;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_hal_async::delay::DelayNs;
use estimator_core::Timestamp;
use firmware::sampling::{EDGE_LIMIT_US, Tick, Ticks};

use crate::board::TICK_US;

const TICK: Duration = Duration::from_micros(TICK_US as u64);
const EDGE_LIMIT: Duration = Duration::from_micros(EDGE_LIMIT_US);

/// Latest service of a tick, so that a sample, its estimate and its frames still end before the next tick.
const LATEST: Duration = Duration::from_micros(TICK_US as u64 / 3);

/// The ticks.
pub struct Timebase {
    /// Line for data-ready edges, if the board has one.
    data_ready: Option<Input<'static>>,
    next: Instant,
}

impl Timebase {
    pub fn new(data_ready: Option<Input<'static>>) -> Self {
        let next = Instant::now() + TICK;
        Self { data_ready, next }
    }
}

impl Ticks for Timebase {
    async fn next(&mut self) -> Tick {
        let now = Instant::now();
        let mut missed = 0;
        while now > self.next + LATEST {
            self.next += TICK;
            missed += 1;
        }
        Timer::at(self.next).await;
        let time = timestamp(self.next);
        self.next += TICK;
        let Some(line) = &mut self.data_ready else {
            return Tick { time, missed, is_without_line: true, ..Tick::default() };
        };
        let edge = with_timeout(EDGE_LIMIT, line.wait_for_rising_edge()).await;
        let edge = edge.ok().map(|()| timestamp(Instant::now()));
        Tick { time, edge, missed, ..Tick::default() }
    }
}

const fn timestamp(instant: Instant) -> Timestamp {
    Timestamp::from_micros(instant.as_micros())
}

/// Delay by the timer, at least as long as requested.
pub struct Delay;

impl DelayNs for Delay {
    async fn delay_ns(&mut self, ns: u32) {
        Timer::after_micros(u64::from(ns.div_ceil(1_000)) + 1).await;
    }
}
