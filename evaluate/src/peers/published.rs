//! SHOE and ARED with the constants that were published with them, and so without any tuning.
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
//! Here the window is a duration, and it trails. A slow recording gets at least the five samples.
//! `OpenShoe` itself has a window of 3 samples at 250 Hz, and calls every sample in a window at rest
//! where the window is.

use super::shoe::{self, Noise};
use super::{ared, negated};
use crate::labelled::Labelled;

/// `σ_a` and `σ_ω`.
pub const NOISE: Noise = Noise {
    acceleration: 0.01,
    rate: 0.1 * std::f64::consts::PI / 180.0,
};

/// γ: the foot rests where the statistic is below it.
pub const THRESHOLD: f64 = 0.3e5;

/// s.
pub const WINDOW: f64 = 0.025;

/// Fewest samples in a window.
pub const FEWEST_SAMPLES: usize = 5;

/// SHOE's score at each sample: "stable" above −[`THRESHOLD`].
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

/// ARED's score at each sample: "stable" above −[`THRESHOLD`].
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
    use recordings::recording::Label;

    /// A foot that turns at a steady rate, rad/s.
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
    fn a_slow_recording_has_at_least_five_samples_in_a_window() {
        let mut file = turning(1.0);
        assert_eq!(window(&file), 25);
        file.recording.sample_rate = 100.0;
        assert_eq!(window(&file), 5);
    }
}
