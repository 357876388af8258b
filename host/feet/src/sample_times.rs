//! Times of the samples of a stream while it runs: gaps are kept, and stamps that jitter are smoothed.
//!
//! A driver on a computer stamps a sample when it reads it, so its stamps scatter about even times, or several samples get
//! the same stamp. Smoothed times follow such stamps with a time constant of 200 samples, in even steps. Stamps of a
//! sensor with a clock of its own are kept as they are, bit for bit.

/// Steps from one sample to the next, as multiples of the period, that are judged together.
const LEAST_JUDGED: u32 = 50;

/// Shortest time that is judged together, µs.
const JUDGED_US: f64 = 1.0e6;

/// Deviation of a step from a multiple of the period from which it is uneven, as a fraction of the period.
const UNEVEN: f64 = 0.1;

/// Share of uneven steps from which stamps jitter.
const JITTERS: f64 = 0.2;

/// Deviation of the measured rate from the estimator's rate beyond which the rate has changed, as a fraction.
const RATE_CHANGES: f64 = 0.1;

/// Step ahead of smoothed times that is a gap, µs, if it is also longer than [`GAP_PERIODS`].
const GAP_US: f64 = 100_000.0;

/// Step ahead of smoothed times that is a gap, periods.
const GAP_PERIODS: f64 = 5.0;

/// Longest step whose missing samples are counted, µs; a longer one is a pause of the publisher.
const COUNTED_US: f64 = 1.0e6;

/// Step back from which the clock of the stamps was set back, µs.
const SET_BACK_US: i64 = 1_000_000;

/// Shares of the deviation by which time and period are corrected with each sample: critically damped, with a time constant
/// of 200 samples.
const OF_TIME: f64 = 0.01;
const OF_PERIOD: f64 = 2.5e-5;

/// Times of the samples of a stream.
#[derive(Clone, Debug)]
pub(crate) struct SampleTimes {
    /// Period of the estimator, µs.
    nominal_us: f64,
    /// Period by the stamps so far, µs.
    period_us: f64,
    /// Whether stamps jitter.
    is_smoothed: bool,
    /// Newest stamp, µs.
    stamp_us: i64,
    /// Time of the newest sample after the newest kept stamp `origin_us`, µs.
    since_us: f64,
    origin_us: i64,
    judged: Judged,
    /// Rate of the stamps in the last steps that were judged, Hz, if it differs from the estimator's rate.
    other_rate: Option<f64>,
}

/// Steps that are judged together.
#[derive(Clone, Copy, Debug, Default)]
struct Judged {
    steps: u32,
    uneven: u32,
    sum_us: f64,
}

/// Place of a sample in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Placed {
    /// Time of the sample, µs, and the number of samples that are missing before it.
    At { time_us: i64, missing: u32 },
    /// The sample is not newer than the one before it, and is left out.
    OutOfOrder,
    /// The clock of the stamps was set back.
    SetBack,
}

/// Property of the stamps that was found while they came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FoundTiming {
    /// The stamps jitter, and are smoothed from now on.
    Jitter,
    /// The samples come at another rate, Hz.
    Rate(f64),
}

impl SampleTimes {
    /// Begins with the stamp of the first sample, µs, at the rate of the estimator, Hz.
    pub(crate) fn new(rate_hz: f64, first_us: i64) -> Self {
        let period_us = 1.0e6 / rate_hz;
        Self {
            nominal_us: period_us,
            period_us,
            is_smoothed: false,
            stamp_us: first_us,
            since_us: 0.0,
            origin_us: first_us,
            judged: Judged::default(),
            other_rate: None,
        }
    }

    /// Smooths the stamps from now on.
    pub(crate) const fn smooth(&mut self) {
        self.is_smoothed = true;
    }

    /// Places the next sample by its stamp, µs.
    pub(crate) fn place(&mut self, stamp_us: i64) -> Placed {
        let step_us = stamp_us - self.stamp_us;
        if step_us < -SET_BACK_US {
            return Placed::SetBack;
        }
        self.judge(step_us as f64);
        if self.is_smoothed {
            self.stamp_us = stamp_us;
            return self.smoothed(stamp_us);
        }
        if step_us <= 0 {
            return Placed::OutOfOrder;
        }
        (self.stamp_us, self.origin_us, self.since_us) = (stamp_us, stamp_us, 0.0);
        let periods = (step_us as f64 / self.nominal_us).round();
        let is_pause = step_us as f64 > COUNTED_US;
        let missing = if is_pause { 0 } else { (periods as u32).saturating_sub(1) };
        Placed::At { time_us: stamp_us, missing }
    }

    fn smoothed(&mut self, stamp_us: i64) -> Placed {
        let stamp_since_us = (stamp_us - self.origin_us) as f64;
        let even_us = self.since_us + self.period_us;
        let ahead_us = stamp_since_us - even_us;
        if ahead_us > GAP_US.max(GAP_PERIODS * self.period_us) {
            (self.origin_us, self.since_us) = (stamp_us, 0.0);
            return Placed::At { time_us: stamp_us, missing: 0 };
        }
        self.period_us += OF_PERIOD * ahead_us;
        // Even if a stamp is far behind, the time must advance.
        let step_us = self.period_us + OF_TIME * ahead_us;
        self.since_us += step_us.clamp(0.5 * self.period_us, 1.5 * self.period_us);
        Placed::At { time_us: self.origin_us + self.since_us.round() as i64, missing: 0 }
    }

    fn judge(&mut self, step_us: f64) {
        let periods = (step_us / self.nominal_us).round().max(1.0);
        if step_us > COUNTED_US {
            return;
        }
        self.judged.steps += 1;
        self.judged.sum_us += step_us;
        let deviation_us = (step_us - periods * self.nominal_us).abs();
        self.judged.uneven += u32::from(deviation_us > UNEVEN * self.nominal_us);
    }

    /// Judges the steps since the last judgement, about once a second, and returns the result.
    pub(crate) fn found(&mut self) -> Option<FoundTiming> {
        let Judged { steps, uneven, sum_us } = self.judged;
        if steps < LEAST_JUDGED || sum_us < JUDGED_US {
            return None;
        }
        self.judged = Judged::default();
        let rate = f64::from(steps) * 1.0e6 / sum_us;
        let is_other = (rate * self.nominal_us / 1.0e6 - 1.0).abs() > RATE_CHANGES;
        let before = self.other_rate.take();
        if is_other {
            self.other_rate = Some(rate);
            // The rate must be found twice, because a loss of samples may look like another rate for a while.
            let is_steady = before.is_some_and(|before| (before / rate - 1.0).abs() < RATE_CHANGES);
            return is_steady.then_some(FoundTiming::Rate(rate));
        }
        let jitters = f64::from(uneven) > JITTERS * f64::from(steps);
        if jitters && !self.is_smoothed {
            self.is_smoothed = true;
            return Some(FoundTiming::Jitter);
        }
        None
    }
}

/// Shortest time in which the rate of a stream is found, µs. The first applies if the stamps are even, the second if they
/// jitter.
const FOUND_US: i64 = 500_000;
const FOUND_UNEVEN_US: i64 = 1_000_000;

/// Smallest number of samples in which the rate is found.
const LEAST_SAMPLES: usize = 10;

/// Finds the rate of a stream, Hz, from its first stamps, µs. Returns the rate, and whether the stamps jitter; `None` if
/// there are too few stamps.
pub(crate) fn first_rate(stamps_us: &[i64]) -> Option<(f64, bool)> {
    let (first, last) = (stamps_us.first()?, stamps_us.last()?);
    let span_us = last - first;
    if stamps_us.len() < LEAST_SAMPLES || span_us < FOUND_US {
        return None;
    }
    let steps = || stamps_us.windows(2).map(|pair| pair[1] - pair[0]);
    let mut sorted: Vec<i64> = steps().collect();
    sorted.sort_unstable();
    let median_us = sorted[sorted.len() / 2] as f64;
    let is_even = |step: &i64| {
        let periods = (*step as f64 / median_us).round().max(1.0);
        (*step as f64 - periods * median_us).abs() <= UNEVEN * median_us
    };
    let uneven = sorted.iter().filter(|step| !is_even(step)).count() as f64;
    if median_us > 0.0 && uneven <= JITTERS * sorted.len() as f64 {
        // Average only steps of one period, because longer steps are gaps.
        let single = || sorted.iter().filter(|step| (**step as f64) < 1.5 * median_us);
        let mean_us = single().sum::<i64>() as f64 / single().count() as f64;
        return Some((roundest(1.0e6 / mean_us), false));
    }
    if span_us < FOUND_UNEVEN_US {
        return None;
    }
    // The samples come in batches, or the times are times of arrival. Each step is then a period, except gaps.
    let kept = || sorted.iter().filter(|step| (**step as f64) < GAP_US);
    let (sum_us, count) = (kept().sum::<i64>() as f64, kept().count() as f64);
    (sum_us > 0.0).then(|| (roundest(1.0e6 * count / sum_us), true))
}

/// The roundest rate within 1.5 % of a measured one.
fn roundest(rate: f64) -> f64 {
    let units = [1000.0, 100.0, 50.0, 10.0, 5.0, 1.0];
    let mut rounded = units.into_iter().map(|unit: f64| (rate / unit).round() * unit);
    rounded.find(|round| *round > 0.0 && (round / rate - 1.0).abs() < 0.015).unwrap_or(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times and missing samples of these stamps, and the changes that were found.
    fn placed(rate_hz: f64, stamps_us: &[i64]) -> (Vec<Placed>, Vec<FoundTiming>) {
        let mut times = SampleTimes::new(rate_hz, stamps_us[0]);
        let mut found = Vec::new();
        let placed = stamps_us[1..].iter().map(|stamp_us| {
            let placed = times.place(*stamp_us);
            found.extend(times.found());
            placed
        });
        (placed.collect(), found)
    }

    fn times(placed: &[Placed]) -> Vec<i64> {
        let time = |placed: &Placed| match placed {
            Placed::At { time_us, .. } => *time_us,
            other => panic!("{other:?}"),
        };
        placed.iter().map(time).collect()
    }

    #[test]
    fn even_stamps_are_kept_with_their_gaps() {
        let stamps: Vec<i64> =
            (0..4000).filter(|k| !(1000..1003).contains(k)).map(|k| 7 + 2500 * k).collect();
        let (placed, found) = placed(400.0, &stamps);
        assert_eq!(times(&placed), stamps[1..]);
        assert_eq!(found, []);
        assert_eq!(placed[999], Placed::At { time_us: stamps[1000], missing: 3 });
    }

    #[test]
    fn jittering_stamps_are_smoothed_and_gaps_kept() {
        // A computer reads at 250 Hz, up to 3 ms late; a pause of 2 s.
        let stamps: Vec<i64> = (0..4000_i64)
            .map(|k| 4000 * k + (k * 7919 % 3000) + if k < 3000 { 0 } else { 2_000_000 })
            .collect();
        let (placed, found) = placed(250.0, &stamps);
        assert_eq!(found, [FoundTiming::Jitter]);
        let times = times(&placed);
        for (k, pair) in times.windows(2).enumerate().skip(600) {
            let step = pair[1] - pair[0];
            let is_gap = (2998..3001).contains(&k) && step > 1_900_000;
            assert!(is_gap || (3900..4100).contains(&step), "step {step} at {k}");
        }
        let last_error = times[3998] - 4000 * 3999 - 2_000_000;
        assert!((0..3000).contains(&last_error), "{last_error}");
    }

    #[test]
    fn batches_of_equal_stamps_are_spread() {
        let stamps: Vec<i64> = (0..3000_i64).map(|k| 20_000 * (k / 8)).collect();
        assert_eq!(first_rate(&stamps[..400]), None, "less than a second");
        assert_eq!(first_rate(&stamps[..800]), Some((400.0, true)));
        let mut times = SampleTimes::new(400.0, 0);
        times.smooth();
        let mut before = 0;
        for stamp in &stamps[1..] {
            let Placed::At { time_us, .. } = times.place(*stamp) else { panic!("{stamp}") };
            let step = time_us - before;
            assert!((1200..3800).contains(&step), "{step}");
            before = time_us;
        }
        assert!((before - 20_000 * 374).abs() < 20_000, "{before}");
    }

    #[test]
    fn another_rate_is_found_after_two_seconds() {
        let mut stamps: Vec<i64> = (0..800).map(|k| 2500 * k).collect();
        let end = stamps[799];
        stamps.extend((1..=600).map(|k| end + 5000 * k));
        let (_, found) = placed(400.0, &stamps);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(matches!(found[0], FoundTiming::Rate(rate) if (rate - 200.0).abs() < 2.0));
    }

    #[test]
    fn clock_that_is_set_back_is_told_from_late_samples() {
        let mut times = SampleTimes::new(400.0, 5_000_000);
        assert_eq!(times.place(4_990_000), Placed::OutOfOrder);
        assert_eq!(times.place(5_000_000), Placed::OutOfOrder);
        assert_eq!(times.place(1_000_000), Placed::SetBack);
        assert_eq!(times.place(5_002_500), Placed::At { time_us: 5_002_500, missing: 0 });
    }

    #[test]
    fn rate_is_found_by_the_first_half_second() {
        let even = |hz: i64| (0..hz).map(|k| 1_000_000 * k / hz).collect::<Vec<i64>>();
        for hz in [50, 111, 400, 1000, 1666] {
            let rate = first_rate(&even(hz)).expect("a rate").0;
            assert!((rate / hz as f64 - 1.0).abs() < 0.015, "{rate} of {hz}");
        }
        assert_eq!(first_rate(&even(400)[..150]), None);
        assert_eq!(first_rate(&[]), None);
    }
}
