//! A stretch in which the decision is not "stable", and its verdict.

use estimator_core::{ContactEstimate, Flag, Phase, Timestamp};

use super::reckoning::Reckoning;

/// Shortest swing, µs: the swing of a run takes 260 ms. A foot that only peels off the ground slides for less.
pub const SHORTEST_SWING_US: u64 = 100_000;

/// A foot of unknown load has left the ground if [`vertical`](estimator_core::Probabilities::vertical) is below
/// this.
pub const LIFTED_BELOW: f32 = 0.1;

/// A foot on the ground slides if [`tangential`](estimator_core::Probabilities::tangential) is below this.
pub const SLIDES_BELOW: f32 = 0.5;

/// Inclination against its stance above which a foot rolls, rad (1°). Simulated slides tilt by up to 0.3° until
/// the foot peels off; roll-offs of a shoe tilt by 1° within 50 ms.
pub const ROLLS_ABOVE: f64 = 0.0175;

/// Flags of samples in which the motion of the foot is unknown.
const MOTION_UNKNOWN: [Flag; 5] = [
    Flag::WindowNotFull,
    Flag::AttitudeNotInitialised,
    Flag::Stale,
    Flag::InvalidSample,
    Flag::TimeGap,
];

/// Time for which such a sample lowers the probabilities, µs: the longest window of a preset.
const RECOVERY_US: u64 = 50_000;

/// Returns whether the motion of the foot in a sample is unknown.
pub(super) fn is_motion_unknown(estimate: &ContactEstimate) -> bool {
    let mut flags = MOTION_UNKNOWN.into_iter();
    flags.any(|flag| estimate.flags.contains(flag))
}

/// State of the stretch up to its newest sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unstable {
    /// Time of its first sample.
    pub(super) start: Timestamp,
    /// Greatest probability of stable contact.
    pub(super) peak: f32,
    /// Distance along the ground at lift-off, m.
    pub(super) distance_to_lift: Option<f64>,
    newest: Timestamp,
    has_load: bool,
    /// Start of the time without load, and of lifting or tilting.
    unloaded: Option<Timestamp>,
    lifted: Option<Timestamp>,
    /// Start of rolling about the toe or heel.
    rolled: Option<Timestamp>,
    /// Whether it slid before it rolled.
    slid: bool,
    unknown_us: u64,
    last_unknown: Option<Timestamp>,
    /// Motion since the last stable sample; `None` if there was none.
    reckoning: Option<Reckoning>,
}

/// Verdict on a stretch.
pub(super) enum Verdict {
    /// The foot left the ground at `lift_off`; with `slip`, it slid from the start until then.
    Swing {
        /// Time of the lift-off.
        lift_off: Timestamp,
        /// Whether the foot slid before.
        slip: bool,
    },
    /// The motion of the foot is unknown.
    Unknown,
    /// The foot slid.
    Slip,
    /// The foot stayed in place.
    Neither,
}

impl Unstable {
    /// Starts a stretch with this estimate; `stood` is the motion since the last stable one.
    pub(super) fn new(stood: Option<Reckoning>, estimate: &ContactEstimate) -> Self {
        let mut unstable = Self {
            start: estimate.timestamp,
            newest: stood.map_or(estimate.timestamp, |reckoning| reckoning.now),
            reckoning: stood,
            ..Self::default()
        };
        unstable.add(estimate);
        unstable
    }

    /// Processes the next estimate.
    pub(super) fn add(&mut self, estimate: &ContactEstimate) {
        let now = estimate.timestamp;
        self.reckon(estimate);
        self.peak = self.peak.max(estimate.probabilities.stable);
        if is_motion_unknown(estimate) {
            self.unknown_us += now.micros_since(self.newest).unwrap_or(0);
            self.last_unknown = Some(now);
        }
        self.newest = now;
        let was_on_ground = self.left_ground().is_none();
        match estimate.phase {
            Phase::Unknown => {}
            Phase::Stance | Phase::Slip => self.has_load = true,
            Phase::Swing | Phase::QuietSwing => {
                self.has_load = true;
                self.unloaded.get_or_insert(now);
            }
        }
        let has_recovered = |unknown| now.micros_since(unknown).is_some_and(|us| us > RECOVERY_US);
        if self.last_unknown.is_none_or(has_recovered) {
            if estimate.probabilities.vertical < LIFTED_BELOW {
                self.lifted.get_or_insert(now);
            }
            if (self.reckoning).is_some_and(|reckoning| reckoning.tilt(estimate) > ROLLS_ABOVE) {
                self.rolled.get_or_insert(now);
            }
            self.slid |=
                self.left_ground().is_none() && estimate.probabilities.tangential < SLIDES_BELOW;
        }
        if was_on_ground && self.left_ground().is_some() {
            self.distance_to_lift = self.reckoning.and_then(|reckoning| reckoning.distance());
        }
    }

    /// Integrates the motion up to this estimate, which may be the first after the stretch.
    pub(super) fn reckon(&mut self, estimate: &ContactEstimate) {
        if let Some(reckoning) = &mut self.reckoning {
            reckoning.add(estimate);
        }
    }

    /// Returns whether the foot stood before.
    pub(super) const fn stood(&self) -> bool {
        self.reckoning.is_some()
    }

    /// Distance along the ground, m, of a foot that now stands again.
    pub(super) fn distance_to_rest(&self) -> Option<f64> {
        self.reckoning?.distance_to_rest()
    }

    /// Time at which it lost its load, lifted or began to roll, whichever was first.
    fn left_ground(&self) -> Option<Timestamp> {
        let times = [self.unloaded, self.lifted, self.rolled].into_iter();
        times.flatten().min_by_key(|time| time.as_micros())
    }

    /// Verdict on the stretch if it ends here.
    pub(super) fn verdict(&self) -> Verdict {
        let lasted = |from: Timestamp, to: Timestamp| {
            to.micros_since(from).is_some_and(|us| us >= SHORTEST_SWING_US)
        };
        let has_swung = if self.has_load { self.unloaded.is_some() } else { self.lifted.is_some() };
        let slid_until = |end: Timestamp| self.slid && lasted(self.start, end);
        match self.left_ground().filter(|_| has_swung) {
            Some(left) if lasted(self.start, self.newest) => {
                let slip = slid_until(left);
                Verdict::Swing { lift_off: if slip { left } else { self.start }, slip }
            }
            _ if self.unknown_us >= SHORTEST_SWING_US => Verdict::Unknown,
            _ if self.rolled.map_or(self.slid, slid_until) => Verdict::Slip,
            _ => Verdict::Neither,
        }
    }
}
