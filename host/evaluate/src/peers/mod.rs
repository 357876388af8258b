//! Published detectors: a binary answer from a threshold on a statistic.
//!
//! | detector | module | input |
//! |---|---|---|
//! | SHOE, the generalised likelihood-ratio test | [`shoe`] | acceleration and angular rate |
//! | ARED, angular-rate energy | [`ared`] | angular rate |
//! | AMVD, moving variance of acceleration | [`amvd`] | acceleration |
//! | MBGTD, memory-based graph-theoretic detector | [`mbgtd`] | acceleration |
//! | threshold and Schmitt trigger on the ground reaction force | [`grf`] | vertical force |
//!
//! The statistics are small if the foot rests. They are computed over trailing windows, on the
//! recording's own acceleration, which may contain gravity; AMVD and MBGTD do not distinguish the two
//! cases. [`published`] has SHOE and ARED with the constants of their authors. A [`Detector`] uses the
//! paper's window instead, and [`threshold`] chooses its threshold on recordings other than the scored one.

pub mod amvd;
pub mod ared;
pub mod grf;
pub mod mbgtd;
pub mod published;
pub mod shoe;

use estimator_core::Params;
use samples::recording::Label;
use serde::Serialize;

use crate::labelled::Labelled;
use crate::window::PAPER_WINDOW;
use scoring::scored::Scored;
use shoe::Noise;

samples::named! {
    /// A detector whose threshold is tuned on labels.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Detector {
        /// See [`shoe`].
        Shoe = "SHOE / GLRT",
        /// See [`ared`].
        Ared = "ARED",
        /// See [`amvd`].
        Amvd = "AMVD",
        /// See [`mbgtd`].
        Mbgtd = "MBGTD",
        /// A threshold on the vertical force.
        Force = "force threshold",
    }
}

impl Detector {
    /// Score at each sample for the threshold, larger if the foot is more likely at rest; `None` if the recording
    /// lacks the signal.
    #[must_use]
    pub fn scores(self, file: &Labelled) -> Option<Vec<f64>> {
        let readings = &file.readings;
        let window = file.samples_in(f64::from(PAPER_WINDOW));
        match self {
            Self::Shoe => {
                let noise = Noise {
                    acceleration: f64::from(Params::PAPER.bandwidth.ax),
                    rate: f64::from(Params::PAPER.bandwidth.wx),
                };
                let gravity = file.recording.gravity;
                Some(negated(shoe::statistic(readings, window, noise, gravity)))
            }
            Self::Ared => Some(negated(ared::statistic(readings, window))),
            Self::Amvd => Some(negated(amvd::statistic(readings, window))),
            Self::Mbgtd => Some(negated(mbgtd::statistic(readings, window))),
            Self::Force => file.ground_reaction.as_ref().map(grf::load_shares),
        }
    }
}

fn negated(statistic: Vec<f64>) -> Vec<f64> {
    statistic.into_iter().map(|value| -value).collect()
}

/// Total weight of a group, large enough to divide it among samples as integers, and small enough for sums.
const GROUP_WEIGHT: i64 = 1 << 48;

/// Chooses the threshold above which the answer is "stable", for the fewest wrong answers, with equal weight
/// for each group; among equally good values, the highest. It lies halfway between two values that occur.
/// For a binary detector, the share of wrong answers is the square of the RMSE.
#[must_use]
pub fn threshold(groups: &[Vec<Scored>]) -> f64 {
    let weighted = groups.iter().flat_map(|group| {
        let weight = GROUP_WEIGHT / group.len().max(1) as i64;
        group.iter().map(move |sample| (sample, weight))
    });
    let mut ranked: Vec<(&Scored, i64)> = weighted.collect();
    ranked.sort_by(|(a, _), (b, _)| b.probability.total_cmp(&a.probability));
    // Right answers gained over "never stable" if all samples from here up are called stable.
    let (mut gained, mut most) = (0_i64, 0_i64);
    let mut best = ranked
        .first()
        .map_or(0.0, |(highest, _)| highest.probability);
    let ties: Vec<_> = ranked
        .chunk_by(|(a, _), (b, _)| a.probability == b.probability)
        .collect();
    for (tied, below) in ties.iter().zip(ties.iter().skip(1).map(Some).chain([None])) {
        for (sample, weight) in *tied {
            gained += match sample.label {
                Label::Stable => *weight,
                Label::NotStable => -*weight,
            };
        }
        if gained > most {
            let value = tied[0].0.probability;
            most = gained;
            best = below.map_or(value - value.abs().max(1.0), |below| {
                0.5 * (value + below[0].0.probability)
            });
        }
    }
    best
}

/// Binary answers as probabilities of 1 or 0.
#[must_use]
pub fn answers(scores: &[f64], threshold: f64) -> Vec<f64> {
    let answer = |score: &f64| if *score > threshold { 1.0 } else { 0.0 };
    scores.iter().map(answer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    fn scored(pairs: &[(f64, Label)]) -> Vec<Scored> {
        let sample = |(probability, label): &(f64, Label)| Scored {
            time: Timestamp::from_micros(0),
            probability: *probability,
            label: *label,
        };
        pairs.iter().map(sample).collect()
    }

    #[test]
    fn threshold_minimises_wrong_answers() {
        use Label::{NotStable, Stable};
        // Above 4: one miss. Above 2: one false alarm and nothing missed, no better; above 6: two.
        let samples = scored(&[
            (-9.0, NotStable),
            (1.0, NotStable),
            (3.0, Stable),
            (4.0, NotStable),
            (5.0, Stable),
            (7.0, Stable),
        ]);
        let threshold = threshold(std::slice::from_ref(&samples));
        assert_eq!(threshold, 4.5);
        let scores: Vec<f64> = samples.iter().map(|s| s.probability).collect();
        assert_eq!(answers(&scores, threshold), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn groups_have_equal_weight_in_the_threshold() {
        use Label::{NotStable, Stable};
        // Alone, the long group has its threshold at 2, the short one at 5.
        let long = scored(&[[(1.0, NotStable), (3.0, Stable)]; 50].concat());
        let short = scored(&[(3.0, NotStable), (4.0, NotStable), (6.0, Stable)]);
        assert_eq!(threshold(&[long.clone(), short.clone()]), 5.0);
        // As one group, the samples of the long group dominate.
        assert_eq!(threshold(&[[long, short].concat()]), 2.0);
    }

    #[test]
    fn threshold_of_a_single_label_gives_that_answer() {
        let always = scored(&[(-3.0, Label::Stable), (2.0, Label::Stable)]);
        assert!(threshold(std::slice::from_ref(&always)) < -3.0);
        let never = scored(&[(-3.0, Label::NotStable), (2.0, Label::NotStable)]);
        assert_eq!(
            answers(&[-3.0, 2.0], threshold(std::slice::from_ref(&never))),
            [0.0, 0.0]
        );
    }
}
