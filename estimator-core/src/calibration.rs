//! Half-widths from a few steps on good ground.
//!
//! A half-width δ says how far the motion of a foot in stable contact may be from zero. It belongs
//! to a robot and its controller, so it is measured: a foot walks on ground on which it does not
//! slip, and per axis
//!
//! δ = k · hypot(σ, h)
//!
//! with the robust spread σ of mid-stance, the bandwidth h and k = [`SPREAD_FACTOR`]. In a stance
//! of that spread the kernels' mass within ±δ is erf(k/√2), 0.99994 per axis. A gyroscope without
//! noise has σ near 0, and k·σ alone would collapse below the kernel's own width; k·h never does.
//! Neither is a foot that stands like a rock held to less than [`LEAST`].
//! With k = 4 this gives, on the authors' recordings of ATLAS on good ground, 0.3 to 2.0 times
//! their half-widths for it; and on those of a GO1, 0.7 to 2.2 times (`host-tests/tests/calibrate.rs`).
//!
//! What mid-stance is has to be found without half-widths: a stretch of [`QUIET`] motion after a
//! swing, without its first and its last 30 ms. Where the load is known, a foot without it swings,
//! however quietly, and one with it may turn faster ([`QUIET_UNDER_LOAD`]). σ is 1.4826 times the
//! median of |m|, as the standard deviation of a Gaussian about zero is: half of the samples may be
//! anything.
//!
//! Memory is O(1): a histogram per axis, and the 30 ms in which the foot may yet lift off.

use crate::axis::PerAxis;
use crate::contact::ContactEstimate;
use crate::params::Params;
use crate::phase::Phase;

/// k: half-width in standard deviations of mid-stance, kernel included.
pub const SPREAD_FACTOR: f32 = 4.0;

/// No half-width is proposed below these, m/s² and rad/s: motion that no one who takes the foot for
/// fixed would notice. Over the window of 50 ms, 0.1 m/s² adds up to 5 mm/s; at a lever of 125 mm,
/// from an ankle's axis to the edge of a sole, 0.04 rad/s are 5 mm/s too.
pub const LEAST: (f32, f32) = (0.1, 0.04);

/// Usable steps from which on there is a proposal.
pub const STEPS: u16 = 6;

/// Motion that may be a stance: acceleration in m/s² and angular rate in rad/s, each as a length.
pub const QUIET: (f32, f32) = (3.0, 0.6);

/// The same where the load says that the foot stands: a ball foot fixed to the shank rolls over in
/// its stance, on a GO1 at some 1 rad/s. Acceleration is no freer, so that slips stay out.
pub const QUIET_UNDER_LOAD: (f32, f32) = (QUIET.0, 2.0);

/// Motion that no stance has; it, or a foot without load, must come before each stance that counts.
pub const SWING: (f32, f32) = (5.0, 2.0);

/// What is left out at either end of a stretch of quiet, s.
pub const MARGIN: f32 = 0.03;

/// Room for the margin's samples.
const MARGIN_CAPACITY: usize = 32;

/// Least mid-stance of a step that counts, s.
pub const SHORTEST: f32 = 0.05;

/// What one step contributes at most, s: standing about does not outweigh the steps.
const LONGEST: f32 = 0.5;

/// From the median of |m| to a Gaussian's standard deviation.
const MEDIAN_TO_SIGMA: f32 = 1.4826;

/// There were too few usable steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooFewSteps {
    /// Usable steps found.
    pub found: u16,
}

impl core::fmt::Display for TooFewSteps {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} usable steps, {STEPS} are needed", self.found)
    }
}

impl core::error::Error for TooFewSteps {}

/// Collects mid-stances and proposes half-widths.
#[derive(Clone, Debug)]
pub struct Calibrator {
    bandwidth: PerAxis<f32>,
    /// [`MARGIN`], [`SHORTEST`] and [`LONGEST`] in samples.
    margin: usize,
    shortest: u32,
    longest: u32,
    spread: PerAxis<Spread>,
    /// The last samples of quiet, in which the foot may yet lift off.
    pending: [PerAxis<f32>; MARGIN_CAPACITY],
    /// Samples of quiet so far.
    quiet: u32,
    /// Samples of this stance that were taken in.
    taken: u32,
    swung: bool,
    steps: u16,
}

impl Calibrator {
    /// A calibrator that has seen nothing yet; of `params` it needs bandwidths and sample rate.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        let mut calibrator = Self {
            bandwidth: params.bandwidth,
            margin: 1,
            shortest: 1,
            longest: 1,
            spread: PerAxis::splat(Spread::EMPTY),
            pending: [PerAxis::splat(0.0); MARGIN_CAPACITY],
            quiet: 0,
            taken: 0,
            swung: false,
            steps: 0,
        };
        calibrator.continue_at(params.sample_rate);
        calibrator
    }

    /// Goes on with another recording, whose estimates come at `sample_rate` in Hz. The steps so
    /// far are kept.
    pub fn continue_at(&mut self, sample_rate: f32) {
        let samples = |seconds: f32| libm::roundf(seconds * sample_rate) as u32;
        self.margin = (samples(MARGIN) as usize).clamp(1, MARGIN_CAPACITY);
        self.shortest = samples(SHORTEST).max(1);
        self.longest = samples(LONGEST).max(1);
        self.quiet = 0;
        self.taken = 0;
        self.swung = false;
    }

    /// Takes in the next estimate, of which it looks at the motion, the doubts and whether the
    /// foot is loaded. Returns the sample of mid-stance that was added for it, if any: one that is
    /// [`MARGIN`] old.
    pub fn update(&mut self, estimate: &ContactEstimate) -> Option<PerAxis<f32>> {
        let (a, w) = (estimate.linear_acceleration.0, estimate.angular_rate.0);
        let within =
            |(acceleration, rate): (f32, f32)| a.length() <= acceleration && w.length() <= rate;
        if estimate.flags.are_doubt() && !estimate.flags.contains(crate::Flag::WindowNotFull) {
            // An impact saturates, and a foot that saturates is in motion.
            self.end_stance(estimate.flags.contains(crate::Flag::Saturated));
            None
        } else if matches!(estimate.phase, Phase::Swing | Phase::QuietSwing) {
            self.end_stance(true);
            None
        } else if within(match estimate.phase {
            Phase::Stance | Phase::Slip => QUIET_UNDER_LOAD,
            _ => QUIET,
        }) {
            self.take_quiet(PerAxis::from_array([a.x, a.y, a.z, w.x, w.y, w.z]))
        } else {
            self.end_stance(!within(SWING));
            None
        }
    }

    fn end_stance(&mut self, in_swing: bool) {
        // A stance is paid for with a swing.
        self.swung = (self.swung && self.taken < self.shortest) || in_swing;
        self.quiet = 0;
        self.taken = 0;
    }

    fn take_quiet(&mut self, motion: PerAxis<f32>) -> Option<PerAxis<f32>> {
        let place = self.quiet as usize % self.margin;
        let place = self.pending.get_mut(place)?;
        let oldest = core::mem::replace(place, motion);
        self.quiet = self.quiet.saturating_add(1);
        // `oldest` is a margin old by now; it must not be of the first margin itself.
        let inside = self.quiet as usize > 2 * self.margin;
        if !inside || !self.swung || self.taken >= self.longest {
            return None;
        }
        self.taken += 1;
        for (spread, m) in self.spread.iter_mut().zip(oldest.to_array()) {
            spread.add(m);
        }
        if self.taken == self.shortest {
            self.steps = self.steps.saturating_add(1);
        }
        Some(oldest)
    }

    /// Usable steps so far.
    #[must_use]
    pub const fn steps(&self) -> u16 {
        self.steps
    }

    /// The robust spread σ of mid-stance per axis so far, m/s² and rad/s; 0 before the first step.
    #[must_use]
    pub fn spread(&self) -> PerAxis<f32> {
        PerAxis::from_array(self.spread.each_sigma())
    }

    /// The half-widths that follow from the steps so far.
    ///
    /// # Errors
    /// There are fewer than [`STEPS`].
    pub fn propose(&self) -> Result<PerAxis<f32>, TooFewSteps> {
        if self.steps < STEPS {
            return Err(TooFewSteps { found: self.steps });
        }
        let measured = self.spread().zip_with(self.bandwidth, |sigma, h| {
            SPREAD_FACTOR * libm::sqrtf(sigma * sigma + h * h)
        });
        let least = PerAxis::by_sensor(LEAST.0, LEAST.1);
        Ok(measured.zip_with(
            least,
            |measured, least| {
                if measured > least { measured } else { least }
            },
        ))
    }
}

impl PerAxis<Spread> {
    fn iter_mut(&mut self) -> impl Iterator<Item = &mut Spread> {
        let Self {
            ax,
            ay,
            az,
            wx,
            wy,
            wz,
        } = self;
        [ax, ay, az, wx, wy, wz].into_iter()
    }

    fn each_sigma(&self) -> [f32; 6] {
        let Self {
            ax,
            ay,
            az,
            wx,
            wy,
            wz,
        } = self;
        [ax, ay, az, wx, wy, wz].map(|spread| MEDIAN_TO_SIGMA * spread.median())
    }
}

/// Bins to an octave, as a power of two: the leading bits of a float's fraction.
const FRACTION_BITS: u32 = 2;

/// The lowest bin ends here, 2⁻¹⁴: far below any bandwidth.
const LOWEST_EXPONENT: u32 = 127 - 14;

/// Octaves from there on: to 2⁶, beyond [`QUIET`].
const OCTAVES: usize = 20;

const BINS: usize = OCTAVES << FRACTION_BITS;

/// The distribution of a magnitude, to a quarter of an octave and linear in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Spread {
    below: u32,
    bins: [u16; BINS],
}

impl Spread {
    const EMPTY: Self = Self {
        below: 0,
        bins: [0; BINS],
    };

    /// The leading bits of a float's pattern count quarters of octaves.
    const SHIFT: u32 = 23 - FRACTION_BITS;

    const FIRST: u32 = LOWEST_EXPONENT << FRACTION_BITS;

    fn add(&mut self, value: f32) {
        let position = value.abs().to_bits() >> Self::SHIFT;
        match position.checked_sub(Self::FIRST) {
            None => self.below = self.below.saturating_add(1),
            Some(bin) => {
                let last = BINS - 1;
                let bin = (bin as usize).min(last);
                if self.bins.get(bin) == Some(&u16::MAX) {
                    // Of hours of walking the shares are kept.
                    self.below /= 2;
                    self.bins.iter_mut().for_each(|bin| *bin /= 2);
                }
                if let Some(bin) = self.bins.get_mut(bin) {
                    *bin = bin.saturating_add(1);
                }
            }
        }
    }

    /// The median of what was added; 0 where nothing was.
    fn median(&self) -> f32 {
        let bins = self.bins.iter().map(|count| u32::from(*count));
        let total = self.below + bins.clone().sum::<u32>();
        let middle = 0.5 * total as f32;
        let mut before = self.below as f32;
        if before >= middle {
            return 0.0;
        }
        for (bin, count) in (Self::FIRST..).zip(bins) {
            let count = count as f32;
            if before + count >= middle && count > 0.0 {
                let edge = |bin: u32| f32::from_bits(bin << Self::SHIFT);
                let (low, high) = (edge(bin), edge(bin + 1));
                return low + (high - low) * ((middle - before) / count);
            }
            before += count;
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flag::{Flag, Flags};
    use crate::sample::{AngularRate, LinearAcceleration};
    use crate::vector::Vec3;
    use std::vec::Vec;

    /// Numbers with a Gaussian's quantiles, in no order of size.
    struct Gaussian(u32);

    impl Gaussian {
        fn next(&mut self) -> f32 {
            // The sum of twelve evenly spread numbers.
            (0..12).fold(-6.0, |sum, _| {
                self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                sum + (self.0 >> 8) as f32 / (1 << 24) as f32
            })
        }
    }

    fn estimate(m: [f32; 6]) -> ContactEstimate {
        ContactEstimate {
            linear_acceleration: LinearAcceleration(Vec3::new(m[0], m[1], m[2])),
            angular_rate: AngularRate(Vec3::new(m[3], m[4], m[5])),
            ..ContactEstimate::default()
        }
    }

    const SPREADS: [f32; 6] = [0.1, 0.05, 0.2, 0.02, 0.04, 0.000_1];

    fn swing(calibrator: &mut Calibrator) {
        for _ in 0..200 {
            calibrator.update(&estimate([8.0, 0.0, 3.0, 0.0, 4.0, 0.0]));
        }
    }

    /// A stance of `ms`, with a landing and a lift-off of 25 ms within quiet's limits.
    fn stance(calibrator: &mut Calibrator, random: &mut Gaussian, ms: usize) {
        for i in 0..ms {
            let edge = if i < 25 || i >= ms - 25 { 3.0 } else { 1.0 };
            let motion = SPREADS.map(|sigma| sigma * edge * random.next());
            calibrator.update(&estimate(motion));
        }
    }

    fn walked(steps: usize) -> Calibrator {
        let mut calibrator = Calibrator::new(&Params::DEFAULT);
        let mut random = Gaussian(1);
        for _ in 0..steps {
            swing(&mut calibrator);
            stance(&mut calibrator, &mut random, 300);
        }
        calibrator
    }

    #[test]
    fn half_widths_are_four_times_the_spread_of_mid_stance_with_the_kernel() {
        let proposal = walked(8).propose().expect("enough steps").to_array();
        let bandwidth = Params::DEFAULT.bandwidth.to_array();
        for ((proposed, sigma), h) in proposal.into_iter().zip(SPREADS).zip(bandwidth) {
            let expected =
                (SPREAD_FACTOR * sigma.hypot(h)).max(if h < 0.01 { LEAST.1 } else { 0.0 });
            let error = proposed / expected - 1.0;
            assert!(error.abs() < 0.06, "{proposed} is not {expected}");
        }
    }

    #[test]
    fn no_half_width_is_below_the_multiple_of_its_bandwidth_nor_below_what_matters() {
        let noisy = Params {
            bandwidth: PerAxis::by_sensor(0.1, 0.001),
            ..Params::DEFAULT
        };
        let mut calibrator = Calibrator::new(&noisy);
        for _ in 0..8 {
            swing(&mut calibrator);
            for _ in 0..300 {
                calibrator.update(&estimate([0.0; 6]));
            }
        }
        let proposal = calibrator.propose().expect("enough steps");
        assert_eq!(proposal, PerAxis::by_sensor(SPREAD_FACTOR * 0.1, LEAST.1));
    }

    #[test]
    fn too_few_steps_are_said_to_be_so() {
        for steps in 0..STEPS {
            let result = walked(usize::from(steps)).propose();
            assert_eq!(result, Err(TooFewSteps { found: steps }));
        }
        assert!(walked(usize::from(STEPS)).propose().is_ok());
    }

    #[test]
    fn standing_still_without_a_swing_is_no_step_however_long() {
        let mut calibrator = Calibrator::new(&Params::DEFAULT);
        stance(&mut calibrator, &mut Gaussian(2), 60_000);
        assert_eq!(calibrator.steps(), 0);
        // And one long stand after a swing is one step, which gives no more than half a second.
        swing(&mut calibrator);
        stance(&mut calibrator, &mut Gaussian(2), 60_000);
        assert_eq!((calibrator.steps(), calibrator.taken), (1, 500));
    }

    #[test]
    fn a_third_of_the_samples_may_be_anything_within_the_limits() {
        let mut calibrator = Calibrator::new(&Params::DEFAULT);
        let mut random = Gaussian(3);
        for _ in 0..8 {
            swing(&mut calibrator);
            for i in 0..300 {
                let scale = if i % 3 == 0 { 20.0 } else { 1.0 };
                let motion = SPREADS.map(|sigma| (sigma * random.next() * scale).clamp(-0.3, 0.3));
                calibrator.update(&estimate(motion));
            }
        }
        let proposal = calibrator.propose().expect("enough steps");
        let clean = SPREAD_FACTOR * SPREADS[0].hypot(Params::DEFAULT.bandwidth.ax);
        assert!(
            proposal.ax > clean && proposal.ax < 2.0 * clean,
            "{proposal:?}"
        );
    }

    #[test]
    fn a_foot_without_load_swings_however_quietly() {
        let mut calibrator = Calibrator::new(&Params::DEFAULT);
        let mut random = Gaussian(6);
        for phase in [Phase::QuietSwing, Phase::Stance, Phase::Slip].repeat(8) {
            for _ in 0..300 {
                let motion = SPREADS.map(|sigma| sigma * random.next());
                let taken = calibrator.update(&ContactEstimate {
                    phase,
                    ..estimate(motion)
                });
                assert!(taken.is_none() || phase != Phase::QuietSwing);
            }
        }
        // A stance that begins with a slip is one stance; and no motion told them apart.
        assert_eq!(calibrator.steps(), 8);
    }

    #[test]
    fn another_recording_begins_with_no_swing_behind_it() {
        let mut calibrator = walked(8);
        let before = calibrator.spread();
        swing(&mut calibrator);
        calibrator.continue_at(100.0);
        stance(&mut calibrator, &mut Gaussian(7), 300);
        assert_eq!((calibrator.steps(), calibrator.spread()), (8, before));
        swing(&mut calibrator);
        // 60 ms of margins and 50 ms that count, at 100 Hz.
        stance(&mut calibrator, &mut Gaussian(7), 11);
        assert_eq!(calibrator.steps(), 9);
    }

    #[test]
    fn hours_of_walking_keep_the_median() {
        let mut random = Gaussian(8);
        let mut spread = Spread::EMPTY;
        (0..3_000_000).for_each(|_| spread.add(0.1 * random.next()));
        let sigma = MEDIAN_TO_SIGMA * spread.median();
        assert!((sigma - 0.1).abs() < 0.002, "{sigma}");
    }

    #[test]
    fn doubtful_samples_and_short_contacts_are_no_steps() {
        let mut calibrator = Calibrator::new(&Params::DEFAULT);
        let mut random = Gaussian(4);
        for _ in 0..20 {
            swing(&mut calibrator);
            stance(&mut calibrator, &mut random, 100);
            swing(&mut calibrator);
            for _ in 0..300 {
                calibrator.update(&ContactEstimate {
                    flags: Flags::NONE.with(Flag::Stale),
                    ..estimate([0.0; 6])
                });
            }
        }
        assert_eq!(calibrator.steps(), 0);
    }

    #[test]
    fn the_median_is_that_of_the_sorted_samples() {
        let mut random = Gaussian(5);
        for scale in [1.0e-3, 0.02, 0.5, 3.0] {
            let mut spread = Spread::EMPTY;
            let mut all: Vec<f32> = (0..2001).map(|_| (scale * random.next()).abs()).collect();
            all.iter().for_each(|value| spread.add(*value));
            all.sort_by(f32::total_cmp);
            let ratio = spread.median() / all[1000];
            assert!((0.97..1.03).contains(&ratio), "{ratio} at {scale}");
        }
    }

    #[test]
    fn no_bits_upset_it() {
        let mut calibrator = Calibrator::new(&Params::DEFAULT);
        for m in [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0] {
            for _ in 0..100 {
                calibrator.update(&estimate([m; 6]));
            }
        }
        let mut spread = Spread::EMPTY;
        for m in [f32::NAN, f32::INFINITY, f32::MAX, 0.0] {
            spread.add(m);
        }
        assert!(spread.median() >= 0.0);
    }
}
