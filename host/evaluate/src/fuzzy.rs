//! Fuzzy c-means over force, torque and IMU.
//!
//! Source: N. Rotella, S. Schaal, L. Righetti, *Unsupervised Contact Learning for Humanoid
//! Estimation and Control*, ICRA 2018 (arXiv:1709.07472): wrench and IMU data are clustered without
//! labels, and the membership in the cluster of contact is the probability of contact. The
//! clustering is that of J. C. Bezdek, *Pattern Recognition with Fuzzy Objective Function
//! Algorithms*, 1981, with two clusters and fuzzifier 2:
//!
//! ```text
//! u_ik = 1 / Σ_j (‖x_k − v_i‖ / ‖x_k − v_j‖)²,  v_i = Σ_k u_ik² x_k / Σ_k u_ik²
//! ```
//!
//! The original gives one probability per degree of freedom, but the comparison here needs a single one, that
//! of stable contact. Therefore one clustering uses all sensors, each by the length of its vector: force,
//! torque, acceleration, angular rate, in units of their standard deviation. Among the tested features
//! (twelve components, their magnitudes, pairs and triples of forces and motion per degree of freedom with
//! the product or the mean of the six), this choice performs best over all recordings.

use crate::labelled::{GroundReaction, Labelled};
use crate::window::Reading;

/// Lengths of force, torque, acceleration and angular rate.
type Features = [f64; 4];

/// Share of the robot's weight above which a sample initially belongs to the cluster of contact.
const FIRST_GUESS: f64 = 0.3;

/// Number of iterations; the centres converge within fifty on all recordings.
const ITERATIONS: usize = 100;

/// Probability of contact at each sample of `scored`, from clusters found in `learnt_on`; `None` if either
/// has no force. Labels are not used.
#[must_use]
pub fn probabilities(learnt_on: &Labelled, scored: &Labelled) -> Option<Vec<f64>> {
    let ground_reaction = learnt_on.ground_reaction.as_ref()?;
    let features = features(ground_reaction, &learnt_on.readings);
    let scale = Scale::of(&features);
    let points: Vec<_> = features.iter().map(|x| scale.apply(x)).collect();
    let loaded = ground_reaction
        .wrenches
        .iter()
        .map(|[_, _, fz, ..]| f64::from(u8::from(*fz > FIRST_GUESS * ground_reaction.weight)));
    let clusters = Clusters::find(&points, loaded.collect());
    let membership = |x: &Features| clusters.membership(&scale.apply(x));
    let features = self::features(scored.ground_reaction.as_ref()?, &scored.readings);
    Some(features.iter().map(membership).collect())
}

fn features(ground_reaction: &GroundReaction, readings: &[Reading]) -> Vec<Features> {
    let length = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
    let samples = ground_reaction.wrenches.iter().zip(readings);
    samples
        .map(|([fx, fy, fz, tx, ty, tz], [ax, ay, az, wx, wy, wz])| {
            let vectors = [
                [*fx, *fy, *fz],
                [*tx, *ty, *tz],
                [*ax, *ay, *az],
                [*wx, *wy, *wz],
            ];
            vectors.map(length)
        })
        .collect()
}

/// Mean and standard deviation of each feature.
struct Scale {
    mean: Features,
    deviation: Features,
}

impl Scale {
    fn of(features: &[Features]) -> Self {
        let samples = features.len() as f64;
        let mean = std::array::from_fn(|i| features.iter().map(|x| x[i]).sum::<f64>() / samples);
        let deviation = std::array::from_fn(|i| {
            let squares = features.iter().map(|x| (x[i] - mean[i]).powi(2));
            // A constant feature carries no information.
            (squares.sum::<f64>() / samples)
                .sqrt()
                .max(f64::MIN_POSITIVE)
        });
        Self { mean, deviation }
    }

    fn apply(&self, x: &Features) -> Features {
        std::array::from_fn(|i| (x[i] - self.mean[i]) / self.deviation[i])
    }
}

/// Centres of the two clusters.
struct Clusters {
    contact: Features,
    other: Features,
}

impl Clusters {
    /// Finds the centres from an initial membership of each point in the cluster of contact.
    fn find(points: &[Features], mut memberships: Vec<f64>) -> Self {
        let mut clusters = Self::centres(points, &memberships);
        for _ in 0..ITERATIONS {
            for (membership, point) in memberships.iter_mut().zip(points) {
                *membership = clusters.membership(point);
            }
            clusters = Self::centres(points, &memberships);
        }
        clusters
    }

    fn centres(points: &[Features], memberships: &[f64]) -> Self {
        let centre = |weight: fn(f64) -> f64| -> Features {
            let weights = || memberships.iter().map(|u| weight(*u));
            let total = weights().sum::<f64>().max(f64::MIN_POSITIVE);
            std::array::from_fn(|i| {
                let weighted = points.iter().zip(weights()).map(|(x, w)| x[i] * w);
                weighted.sum::<f64>() / total
            })
        };
        Self {
            contact: centre(|u| u * u),
            other: centre(|u| (1.0 - u) * (1.0 - u)),
        }
    }

    /// Membership of a point in the cluster of contact, in [0, 1].
    fn membership(&self, point: &Features) -> f64 {
        let distance = |centre: &Features| -> f64 {
            let squares = point.iter().zip(centre).map(|(x, v)| (x - v).powi(2));
            squares.sum()
        };
        let (contact, other) = (distance(&self.contact), distance(&self.other));
        if contact + other > 0.0 {
            other / (contact + other)
        } else {
            0.5
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets::Set;
    use crate::testing::labelled;
    use samples::recording::Label;

    /// Alternating stance and swing, with loads and readings that vary by `scatter`.
    fn walk(scatter: f64) -> Labelled {
        let rows = (0..2000_u32).map(|k| {
            let noise = scatter * (f64::from(k * 7919 % 1000) / 1000.0 - 0.5);
            if k / 100 % 2 == 0 {
                let wrench = [10.0, 5.0, 800.0 + 100.0 * noise, 20.0, 5.0, 1.0];
                (wrench, [0.1 * noise; 6], Label::Stable)
            } else {
                ([noise; 6], [8.0 + noise; 6], Label::NotStable)
            }
        });
        labelled(Set::Ground, rows)
    }

    #[test]
    fn stance_and_swing_form_separate_clusters() {
        let walk = walk(1.0);
        let memberships = probabilities(&walk, &walk).expect("a force");
        for (membership, label) in memberships.iter().zip(walk.labels()) {
            match label {
                Label::Stable => assert!(*membership > 0.95, "{membership}"),
                Label::NotStable => assert!(*membership < 0.05, "{membership}"),
            }
        }
    }

    #[test]
    fn clusters_apply_to_another_recording() {
        let memberships = probabilities(&walk(1.0), &walk(0.5)).expect("a force");
        assert!(memberships[50] > 0.95 && memberships[150] < 0.05);
    }

    #[test]
    fn point_between_the_centres_has_equal_memberships() {
        let clusters = Clusters {
            contact: [1.0; 4],
            other: [-1.0; 4],
        };
        assert_eq!(clusters.membership(&[0.0; 4]), 0.5);
        assert_eq!(clusters.membership(&[1.0; 4]), 1.0);
        // Twice as far from one centre as from the other: the squares have a ratio of 4 to 1.
        assert!((clusters.membership(&[1.0 / 3.0; 4]) - 0.8).abs() < 1e-12);
    }
}
