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
//! The statistics here are small where the foot rests. They are computed over trailing windows of
//! the same duration as the paper's, and on motion without gravity, as all recordings with labels
//! have it. [`threshold`] chooses where yes begins, on a file that is not the one scored.

pub mod amvd;
pub mod ared;
pub mod grf;
pub mod mbgtd;
pub mod shoe;

use crate::metrics::Scored;
use crate::recording::Label;

/// The threshold above which "stable" is answered, for the fewest wrong answers: of values that
/// answer equally well, the highest. It lies halfway between two values that occur. For a yes-or-no
/// detector the share of wrong answers is the square of the RMSE.
#[must_use]
pub fn threshold(scored: &[Scored]) -> f64 {
    let mut ranked: Vec<&Scored> = scored.iter().collect();
    ranked.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    // Right answers gained, over "never stable", by calling everything from here up stable.
    let (mut gained, mut most) = (0_i64, 0_i64);
    let mut best = ranked.first().map_or(0.0, |highest| highest.probability);
    let groups: Vec<_> = ranked
        .chunk_by(|a, b| a.probability == b.probability)
        .collect();
    for (group, below) in groups
        .iter()
        .zip(groups.iter().skip(1).map(Some).chain([None]))
    {
        for sample in *group {
            gained += match sample.label {
                Label::Stable => 1,
                Label::NotStable => -1,
            };
        }
        if gained > most {
            let value = group[0].probability;
            most = gained;
            best = below.map_or(value - value.abs().max(1.0), |below| {
                0.5 * (value + below[0].probability)
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
        let threshold = threshold(&samples);
        assert_eq!(threshold, 4.5);
        let scores: Vec<f64> = samples.iter().map(|s| s.probability).collect();
        assert_eq!(answers(&scores, threshold), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn where_all_is_stable_all_is_answered_so_and_where_nothing_is_nothing() {
        let always = scored(&[(-3.0, Label::Stable), (2.0, Label::Stable)]);
        assert!(threshold(&always) < -3.0);
        let never = scored(&[(-3.0, Label::NotStable), (2.0, Label::NotStable)]);
        assert_eq!(answers(&[-3.0, 2.0], threshold(&never)), [0.0, 0.0]);
    }
}
