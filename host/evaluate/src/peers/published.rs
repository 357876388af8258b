//! SHOE and ARED with their published constants, without tuning.
//!
//! | constant | value | source |
//! |---|---|---|
//! | `σ_a` | 0.01 m/s² | `OpenShoe`, `settings.m`; `INS.py` at github.com/utiasSTARS/pyshoe |
//! | `σ_ω` | 0.1 °/s | the same |
//! | γ | 0.3 · 10⁵ | `OpenShoe`, `settings.m` |
//! | window | 5 samples at 200 Hz, 25 ms | `INS.py`; the rate is that of its shoe recordings |
//!
//! `OpenShoe` is the program of J.-O. Nilsson, I. Skog, P. Händel, K. V. S. Hari, *Foot-mounted INS
//! for Everybody — An Open-source Embedded Implementation*, IEEE/ION PLANS 2012. It divides each
//! detector's statistic by the noise, as Skog et al. 2010 do, and has one γ for all of them: for
//! ARED that is an angular rate of 17 °/s, root mean square over the window.
//!
//! Here the window is a duration, and it trails. It has at least five samples in slow recordings.
//! `OpenShoe` itself has a window of 3 samples at 250 Hz, and classifies every sample of a window at rest
//! as at rest.

use super::shoe::{self, Noise};
use super::{ared, negated};
use crate::labelled::Labelled;

/// `σ_a` and `σ_ω`.
pub const NOISE: Noise = Noise {
    acceleration: 0.01,
    rate: 0.1 * std::f64::consts::PI / 180.0,
};

/// γ: the foot is at rest if the statistic is below it.
pub const THRESHOLD: f64 = 0.3e5;

/// Duration of the window, s.
pub const WINDOW: f64 = 0.025;

/// Minimum number of samples in a window.
pub const FEWEST_SAMPLES: usize = 5;

/// Score of SHOE at each sample: "stable" above −[`THRESHOLD`].
#[must_use]
pub fn shoe(file: &Labelled) -> Vec<f64> {
    let gravity = file.recording.gravity;
    negated(shoe::statistic(
        &file.readings,
        window(file),
        NOISE,
        gravity,
    ))
}

/// Score of ARED at each sample: "stable" above −[`THRESHOLD`].
#[must_use]
pub fn ared(file: &Labelled) -> Vec<f64> {
    let energy = ared::statistic(&file.readings, window(file));
    let score = |energy: &f64| -energy / NOISE.rate.powi(2);
    energy.iter().map(score).collect()
}

fn window(file: &Labelled) -> usize {
    file.samples_in(WINDOW).max(FEWEST_SAMPLES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sets::Set;
    use crate::testing::labelled;
    use samples::recording::Label;

    /// Recording of a foot that turns at a constant rate, rad/s.
    fn turning(rate: f64) -> Labelled {
        let row = ([0.0; 6], [0.0, 0.0, 0.0, rate, 0.0, 0.0], Label::Stable);
        labelled(Set::Shoe, std::iter::repeat_n(row, 50))
    }

    #[test]
    fn ared_rests_below_17_degrees_per_second() {
        let score = |degrees: f64| ared(&turning(degrees.to_radians()))[49];
        assert!(score(17.0) > -THRESHOLD);
        assert!(score(18.0) < -THRESHOLD);
    }

    #[test]
    fn window_has_at_least_five_samples() {
        let mut file = turning(1.0);
        assert_eq!(window(&file), 25);
        file.recording.sample_rate = 100.0;
        assert_eq!(window(&file), 5);
    }
}
