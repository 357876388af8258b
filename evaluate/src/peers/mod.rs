//! Detectors that others published: yes or no from a threshold on a statistic.
//!
//! | detector | module | what it looks at |
//! |---|---|---|
//! | SHOE, the generalised likelihood-ratio test | [`shoe`] | acceleration and angular rate |
//! | ARED, angular-rate energy | [`ared`] | angular rate |
//! | AMVD, moving variance of acceleration | [`amvd`] | acceleration |
//! | MBGTD, memory-based graph-theoretic detector | [`mbgtd`] | acceleration |
//! | threshold and Schmitt trigger on the ground reaction force | [`grf`] | vertical force |
//!
//! The statistics here are small where the foot rests. They are computed over trailing windows, on
//! the recording's own acceleration: it contains gravity where the accelerometer's does, and AMVD and
//! MBGTD make no difference of that. [`published`] has SHOE and ARED with the constants of their
//! authors. A [`Detector`] takes the paper's window instead, and [`threshold`] chooses where yes
//! begins, on recordings that are not the one scored.

pub mod amvd;
pub mod ared;
pub mod grf;
pub mod mbgtd;
pub mod published;
pub mod shoe;

use estimator_core::Params;
use recordings::recording::Label;
use serde::Serialize;

use crate::labelled::Labelled;
use crate::window::PAPER_WINDOW;
use scoring::scored::Scored;
use shoe::Noise;

/// A detector whose threshold is tuned on labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Detector {
    /// See [`shoe`].
    Shoe,
    /// See [`ared`].
    Ared,
    /// See [`amvd`].
    Amvd,
    /// See [`mbgtd`].
    Mbgtd,
    /// A threshold on the vertical force.
    Force,
}

impl Detector {
    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shoe => "SHOE / GLRT",
            Self::Ared => "ARED",
            Self::Amvd => "AMVD",
            Self::Mbgtd => "MBGTD",
            Self::Force => "force threshold",
        }
    }

    /// The score at each sample on which there is a threshold, larger where the foot rather rests;
    /// `None` where the recording lacks the signal.
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

/// The weight of all samples of a group: large, so that the weight of one is exact enough as a whole
/// number, and small enough for sums.
const GROUP_WEIGHT: i64 = 1 << 48;

/// The threshold above which "stable" is answered, for the fewest wrong answers, in which each group
/// counts alike, however many samples it has: of values that answer equally well, the highest. It
/// lies halfway between two values that occur. For a yes-or-no detector the share of wrong answers is
/// the square of the RMSE.
#[must_use]
pub fn threshold(groups: &[Vec<Scored>]) -> f64 {
    let weighted = groups.iter().flat_map(|group| {
        let weight = GROUP_WEIGHT / group.len().max(1) as i64;
        group.iter().map(move |sample| (sample, weight))
    });
    let mut ranked: Vec<(&Scored, i64)> = weighted.collect();
    ranked.sort_by(|(a, _), (b, _)| b.probability.total_cmp(&a.probability));
    // Right answers gained, over "never stable", by calling everything from here up stable.
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

/// Yes or no, as a probability of 1 or 0.
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
    fn the_threshold_gives_the_fewest_wrong_answers() {
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
    fn a_long_group_counts_no_more_than_a_short_one() {
        use Label::{NotStable, Stable};
        // Alone, each would put the threshold elsewhere: the long one at 2, the short one at 5.
        let long = scored(&[[(1.0, NotStable), (3.0, Stable)]; 50].concat());
        let short = scored(&[(3.0, NotStable), (4.0, NotStable), (6.0, Stable)]);
        assert_eq!(threshold(&[long.clone(), short.clone()]), 5.0);
        // As one group, the many samples win.
        assert_eq!(threshold(&[[long, short].concat()]), 2.0);
    }

    #[test]
    fn where_all_is_stable_all_is_answered_so_and_where_nothing_is_nothing() {
        let always = scored(&[(-3.0, Label::Stable), (2.0, Label::Stable)]);
        assert!(threshold(std::slice::from_ref(&always)) < -3.0);
        let never = scored(&[(-3.0, Label::NotStable), (2.0, Label::NotStable)]);
        assert_eq!(
            answers(&[-3.0, 2.0], threshold(std::slice::from_ref(&never))),
            [0.0, 0.0]
        );
    }
}
