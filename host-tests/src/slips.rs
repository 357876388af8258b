//! Score of an estimator on the slips and good stances of a simulated foot, on the grid of [`gait::slips`]. The
//! truth is the foot's own motion.
//!
//! A slip counts from the moment at which the foot's own speed exceeds [`SPEED_LIMIT`], and is found with the
//! first sample of P < 0.5. The slip distance at detection is the distance slid until then. A good stance is a
//! stance without a slip. If a "stable" decision ends in it before the foot peels off, it has one false slip,
//! however often that happens.

use estimator_core::any::AnyParams;
use estimator_core::{ContactEstimate, Decision};
use gait::label::SPEED_LIMIT;
pub use gait::slips::profiles;
use gait::{Activity, FootState, Simulation};
use samples::Label;
use samples::estimate::estimates_of;
use samples::space::Vector;

/// Minimum duration of a rest under load that is to be found, s. A foot in stick-slip motion has shorter rests
/// repeatedly.
const SHORTEST_REST: f64 = 0.1;

/// A slip in a stance that the decision had called stable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipFound {
    /// Time from the foot's own speed exceeding [`SPEED_LIMIT`] to P < 0.5, s; negative if its chatter is detected
    /// before. Infinite if the slip was not found.
    pub latency: f64,
    /// Slip distance at detection, m; the total distance if the slip was not found.
    pub distance: f64,
}

/// Score of an estimator on one or more walks.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Slips after a stable decision.
    pub slips: Vec<SlipFound>,
    /// Number of slips in stances that had not been called stable yet.
    pub not_ready: usize,
    /// Number of stances without a slip that were called stable.
    pub good_stances: usize,
    /// Number of these in which the decision did not stay stable.
    pub false_slips: usize,
    /// Times from rest under load to P > 0.5, s; infinite if it never occurred. For rests of at least 0.1 s.
    pub onsets: Vec<f64>,
}

impl Score {
    /// Runs an estimator over a walk and adds the results.
    ///
    /// # Panics
    /// If the parameters are invalid.
    pub fn add(&mut self, simulation: &Simulation, params: &AnyParams) {
        let estimates = estimates_of(&simulation.recording, params).expect("valid parameters");
        let stances = simulation
            .truth
            .chunk_by(|a, b| is_stance(a) == is_stance(b))
            .scan(0, |start, stance| {
                let from = *start;
                *start += stance.len();
                Some((from, stance))
            })
            .filter(|(_, stance)| is_stance(&stance[0]));
        for (start, stance) in stances {
            let ends_with_the_recording = start + stance.len() == estimates.len();
            // The initial standing is not a step either.
            if start > 0 && !ends_with_the_recording {
                self.add_stance(stance, &estimates[start..start + stance.len()]);
            }
        }
        self.add_onsets(simulation, &estimates);
    }

    /// Adds the results of further walks.
    pub fn append(&mut self, further: Self) {
        let Self { slips, not_ready, good_stances, false_slips, onsets } = further;
        self.slips.extend(slips);
        self.not_ready += not_ready;
        self.good_stances += good_stances;
        self.false_slips += false_slips;
        self.onsets.extend(onsets);
    }

    fn add_stance(&mut self, truth: &[FootState], estimates: &[ContactEstimate]) {
        let sliding = |state: &FootState| state.activity == Activity::Slipping;
        let Some(onset) = truth.iter().position(sliding) else {
            let stable = |e: &ContactEstimate| e.decision == Decision::Stable;
            if let Some(first) = estimates.iter().position(stable) {
                self.good_stances += 1;
                self.false_slips += usize::from(!estimates[first..].iter().all(stable));
            }
            return;
        };
        if estimates[onset].decision != Decision::Stable {
            self.not_ready += 1;
            return;
        }
        let end = onset + truth[onset..].iter().take_while(|s| sliding(s)).count();
        let ground_speed = |v: Vector| libm::hypot(v.to_array()[0], v.to_array()[1]);
        let moving = (onset..end).find(|k| ground_speed(truth[*k].velocity) > SPEED_LIMIT);
        let found = (onset..end).find(|k| estimates[*k].probabilities.stable < 0.5);
        let time = |k: usize| estimates[k].timestamp.as_micros() as f64 * 1e-6;
        if let Some(moving) = moving {
            let last = found.unwrap_or(end - 1);
            self.slips.push(SlipFound {
                latency: found.map_or(f64::INFINITY, |found| time(found) - time(moving)),
                distance: truth[last].slip - truth[onset].slip,
            });
        }
    }

    fn add_onsets(&mut self, simulation: &Simulation, estimates: &[ContactEstimate]) {
        let samples = &simulation.recording.samples;
        let rate = f64::from(simulation.recording.sample_rate);
        for (k, pair) in samples.windows(2).enumerate() {
            if (pair[0].label, pair[1].label) != (Some(Label::NotStable), Some(Label::Stable)) {
                continue;
            }
            let begin = k + 1;
            let rest = samples[begin..].iter();
            let rest = rest.take_while(|sample| sample.label == Some(Label::Stable));
            let rest = rest.count();
            if begin + rest == samples.len() || (rest as f64) < SHORTEST_REST * rate {
                continue;
            }
            let stable = |e: &ContactEstimate| e.probabilities.stable > 0.5;
            let first = estimates[begin..begin + rest].iter().find(|e| stable(e));
            let since = |e: &ContactEstimate| {
                let from = estimates[begin].timestamp.as_micros();
                (e.timestamp.as_micros() - from) as f64 * 1e-6
            };
            self.onsets.push(first.map_or(f64::INFINITY, since));
        }
    }

    /// Latency below which a share of the slips was found, s.
    #[must_use]
    pub fn latency(&self, share: f64) -> f64 {
        quantile(self.slips.iter().map(|slip| slip.latency).collect(), share)
    }

    /// Time after which a share of the stances was found, s.
    #[must_use]
    pub fn onset(&self, share: f64) -> f64 {
        quantile(self.onsets.clone(), share)
    }

    /// Mean slip distance at detection, m.
    #[must_use]
    pub fn distance(&self) -> f64 {
        let sum: f64 = self.slips.iter().map(|slip| slip.distance).sum();
        sum / self.slips.len().max(1) as f64
    }

    /// Number of slips that were not found.
    #[must_use]
    pub fn missed(&self) -> usize {
        let missed = |slip: &&SlipFound| slip.latency.is_infinite();
        self.slips.iter().filter(missed).count()
    }

    /// False slips per thousand good stances.
    #[must_use]
    pub fn false_per_thousand(&self) -> f64 {
        1e3 * self.false_slips as f64 / self.good_stances.max(1) as f64
    }
}

/// Returns whether the foot is between the end of the landing and the beginning of the peel.
fn is_stance(state: &FootState) -> bool {
    matches!(state.activity, Activity::Standing | Activity::Slipping)
}

/// Smallest value that at least this share of all values does not exceed.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = libm::ceil(share * values.len() as f64) as usize;
    let value = values.get(rank.saturating_sub(1));
    value.copied().unwrap_or(f64::NAN)
}
