//! Clock of the part: ticks of 6667 Hz with an error and jitter.

use super::random::hash;

/// Nominal time between ticks, ps.
const PERIOD_PS: f64 = 150.0e6;

/// Conversion between ticks and time.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    origin_ps: u64,
    origin_tick: u64,
    period_ps: u64,
    jitter_ps: u64,
    seed: u64,
}

impl Clock {
    /// Nominal ticks per second.
    pub(super) const RATE: f64 = 1.0e12 / PERIOD_PS;

    /// Starts tick 0 at time 0. `ratio` is this clock's rate over the nominal one.
    pub(super) fn new(ratio: f64, jitter_ns: u32, seed: u64) -> Self {
        let period_ps = period(ratio);
        Self {
            origin_ps: 0,
            origin_tick: 0,
            period_ps,
            jitter_ps: (u64::from(jitter_ns) * 1000).min(period_ps / 4),
            seed,
        }
    }

    /// Changes the rate from the last tick before `now_ps` on.
    pub(super) fn set_ratio(&mut self, ratio: f64, now_ps: u64) {
        let ticks = now_ps.saturating_sub(self.origin_ps) / self.period_ps;
        self.origin_ps += ticks * self.period_ps;
        self.origin_tick += ticks;
        self.period_ps = period(ratio);
    }

    /// Time of a tick, ps. Each tick is late by up to the jitter, independently.
    pub(super) fn tick_ps(&self, tick: u64) -> u64 {
        let jitter = if self.jitter_ps == 0 { 0 } else { hash(self.seed ^ tick) % self.jitter_ps };
        self.origin_ps + tick.saturating_sub(self.origin_tick) * self.period_ps + jitter
    }

    /// The first tick after `now_ps`.
    pub(super) fn next_tick(&self, now_ps: u64) -> u64 {
        let elapsed = now_ps.saturating_sub(self.origin_ps);
        let tick = self.origin_tick + elapsed / self.period_ps;
        if self.tick_ps(tick) > now_ps { tick } else { tick + 1 }
    }
}

fn period(ratio: f64) -> u64 {
    (PERIOD_PS / ratio.clamp(0.01, 100.0) + 0.5) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_come_at_6667_hz() {
        let clock = Clock::new(1.0, 0, 1);
        assert_eq!(clock.tick_ps(6667), 6667 * 150_000_000);
    }

    #[test]
    fn a_clock_three_per_cent_fast_ticks_three_per_cent_more() {
        let clock = Clock::new(1.03, 0, 1);
        assert_eq!(clock.next_tick(100_000_000_000_000), 686_667);
    }

    #[test]
    fn jitter_moves_each_tick_and_never_adds_up() {
        let (clock, ideal) = (Clock::new(1.0, 2_000, 3), Clock::new(1.0, 0, 3));
        for tick in 0..10_000 {
            let late = clock.tick_ps(tick) - ideal.tick_ps(tick);
            assert!(late < 2_000_000);
            assert_eq!(clock.next_tick(clock.tick_ps(tick)), tick + 1);
            assert_eq!(
                clock.next_tick(clock.tick_ps(tick) - u64::from(tick > 0)),
                tick + u64::from(tick == 0)
            );
        }
    }

    #[test]
    fn jitter_scatters_over_its_range_whatever_the_seed() {
        for seed in [0, 1, 3, u64::MAX] {
            let (clock, ideal) = (Clock::new(1.0, 2_000, seed), Clock::new(1.0, 0, seed));
            let late = |tick| clock.tick_ps(tick) - ideal.tick_ps(tick);
            let mean = (0..10_000).map(late).sum::<u64>() / 10_000;
            assert!(mean.abs_diff(1_000_000) < 30_000, "{seed}: {mean} ps");
            let repeats = (0..10_000).filter(|tick| late(*tick) == late(tick + 1));
            assert!(repeats.count() < 3, "{seed}");
        }
    }

    #[test]
    fn a_change_of_rate_loses_no_tick() {
        let mut clock = Clock::new(1.0, 0, 1);
        let now = 10 * 150_000_000 + 70_000_000;
        assert_eq!(clock.next_tick(now), 11);
        clock.set_ratio(0.5, now);
        assert_eq!(clock.next_tick(now), 11);
        assert_eq!(clock.tick_ps(11), 10 * 150_000_000 + 300_000_000);
    }
}
