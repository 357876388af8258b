//! Decision from the probability, and the phase of the gait if the load is known.
//!
//! The decision is debounced: the probability must exceed the threshold for an on-delay, and stay at or below it for an
//! off-delay. With the load, from a Schmitt trigger, the decision gives the paper's four cases:
//!
//! | | stable | not stable |
//! |---|---|---|
//! | loaded | stance | slip |
//! | not loaded | quiet swing | swing |

use crate::flags::{Flag, Flags};
use crate::sample::Timestamp;

/// The vertical load on the foot: N, or any unit in which the [`LoadParams`] thresholds are given.
///
/// A force or pressure sensor, or a gait plan (1 where the leg is planned to stand).
///
/// [`LoadParams`]: crate::params::LoadParams
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Load(pub f32);

/// Debounced decision whether the robot may lean on this foot. It may not lean on a foot that
/// rolls: one that turns about a point on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Decision {
    /// No, or not known.
    #[default]
    NotStable,
    /// The probability has been above the threshold for the on-delay, and nothing is in doubt.
    Stable,
}

/// Phase of the gait: the paper's four cases (section IV-B), or unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// There is no load signal, or doubt leaves open whether the foot moves.
    #[default]
    Unknown,
    /// Loaded and at rest: stable contact.
    Stance,
    /// Loaded and moving: unstable contact.
    Slip,
    /// Not loaded and moving.
    Swing,
    /// Not loaded and at rest, as at the top of a slow swing.
    QuietSwing,
}

impl Phase {
    /// All phases, [`Phase::Unknown`] first.
    pub const ALL: [Self; 5] =
        [Self::Unknown, Self::Stance, Self::Slip, Self::Swing, Self::QuietSwing];

    /// The phase's name as written in files: `stance`, `quiet_swing` and so on.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Stance => "stance",
            Self::Slip => "slip",
            Self::Swing => "swing",
            Self::QuietSwing => "quiet_swing",
        }
    }
}

/// State of the Schmitt trigger on the load signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Loading {
    #[default]
    Unloaded,
    Loaded,
}

/// Thresholds and delays in the form used by the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PhaseCoefficients {
    pub(crate) threshold: f32,
    pub(crate) on_delay_us: u64,
    pub(crate) off_delay_us: u64,
    pub(crate) load_on: f32,
    pub(crate) load_off: f32,
}

/// Debounces the decision and tracks the phase.
#[derive(Clone, Debug)]
pub(crate) struct PhaseTracker {
    coefficients: PhaseCoefficients,
    decision: Decision,
    /// Time of the first sample whose probability contradicts the decision; `None` while they agree.
    contradicted_since: Option<Timestamp>,
    loading: Loading,
    deliberation: Deliberation,
}

/// Flags that leave open whether the foot moves. A saturated sample shows that it does.
const MOTION_UNKNOWN: [Flag; 5] = [
    Flag::WindowNotFull,
    Flag::AttitudeNotInitialised,
    Flag::Stale,
    Flag::InvalidSample,
    Flag::Unproven,
];

/// Whether the decision is meaningful yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Deliberation {
    /// The on-delay since the motion became known is still running. Until it has passed the decision is "not stable",
    /// but a standing foot must not be reported as slipping.
    #[default]
    Undecided,
    Decided,
}

impl PhaseTracker {
    pub(crate) const fn new(coefficients: PhaseCoefficients) -> Self {
        Self {
            coefficients,
            decision: Decision::NotStable,
            contradicted_since: None,
            loading: Loading::Unloaded,
            deliberation: Deliberation::Undecided,
        }
    }

    /// The probability above which the foot may be stable.
    pub(crate) const fn threshold(&self) -> f32 {
        self.coefficients.threshold
    }

    /// Processes the probability at `now`, its flags, and the load if there is one.
    pub(crate) fn update(
        &mut self,
        now: Timestamp,
        stable_probability: f32,
        flags: Flags,
        load: Option<Load>,
    ) -> (Decision, Phase) {
        self.decide(now, stable_probability, flags);
        (self.decision, self.phase(load))
    }

    fn decide(&mut self, now: Timestamp, stable_probability: f32, flags: Flags) {
        if flags.are_doubt() {
            // Doubt ends a stable decision at once, and restarts the on-delay.
            self.decision = Decision::NotStable;
            self.contradicted_since = None;
            if MOTION_UNKNOWN.into_iter().any(|flag| flags.contains(flag)) {
                self.deliberation = Deliberation::Undecided;
            }
            return;
        }
        let above = stable_probability > self.coefficients.threshold;
        let (opposite, delay) = match (self.decision, above) {
            (Decision::NotStable, true) => (Decision::Stable, self.coefficients.on_delay_us),
            (Decision::Stable, false) => (Decision::NotStable, self.coefficients.off_delay_us),
            _ => {
                self.deliberation = Deliberation::Decided;
                self.contradicted_since = None;
                return;
            }
        };
        let since = *self.contradicted_since.get_or_insert(now);
        if now.micros_since(since).unwrap_or(0) >= delay {
            self.deliberation = Deliberation::Decided;
            self.decision = opposite;
            self.contradicted_since = None;
        }
    }

    fn phase(&mut self, load: Option<Load>) -> Phase {
        let Some(Load(load)) = load.filter(|load| load.0.is_finite()) else {
            return Phase::Unknown;
        };
        self.loading = match self.loading {
            Loading::Unloaded if load >= self.coefficients.load_on => Loading::Loaded,
            Loading::Loaded if load < self.coefficients.load_off => Loading::Unloaded,
            unchanged => unchanged,
        };
        if self.deliberation == Deliberation::Undecided {
            return Phase::Unknown;
        }
        match (self.loading, self.decision) {
            (Loading::Loaded, Decision::Stable) => Phase::Stance,
            (Loading::Loaded, Decision::NotStable) => Phase::Slip,
            (Loading::Unloaded, Decision::NotStable) => Phase::Swing,
            (Loading::Unloaded, Decision::Stable) => Phase::QuietSwing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn tracker() -> PhaseTracker {
        PhaseTracker::new(PhaseCoefficients {
            threshold: 0.5,
            on_delay_us: 20_000,
            off_delay_us: 3_000,
            load_on: 12.0,
            load_off: 6.0,
        })
    }

    /// Feeds one probability per millisecond and returns the decisions.
    fn decisions(probabilities: impl IntoIterator<Item = f32>) -> Vec<Decision> {
        let mut tracker = tracker();
        (0..)
            .zip(probabilities)
            .map(|(ms, p)| {
                let now = Timestamp::from_micros(ms * 1000);
                tracker.update(now, p, Flags::NONE, None).0
            })
            .collect()
    }

    #[test]
    fn decision_turns_stable_exactly_after_the_on_delay() {
        let decisions = decisions([0.9; 40]);
        let first = decisions.iter().position(|d| *d == Decision::Stable);
        assert_eq!(first, Some(20));
    }

    #[test]
    fn dip_below_the_threshold_restarts_the_on_delay() {
        let mut probabilities = [0.9; 60];
        probabilities[15] = 0.4;
        let first = decisions(probabilities).iter().position(|d| *d == Decision::Stable);
        assert_eq!(first, Some(36));
    }

    #[test]
    fn decision_falls_after_the_off_delay() {
        let probabilities = [0.9; 30].into_iter().chain([0.1; 10]);
        let decisions = decisions(probabilities);
        assert_eq!(decisions[32], Decision::Stable);
        assert_eq!(decisions[33], Decision::NotStable);
    }

    #[test]
    fn doubt_ends_a_stable_decision_at_once() {
        let doubts = |flag: &Flag| Flags::NONE.with(*flag).are_doubt();
        for flag in Flag::ALL.into_iter().filter(doubts) {
            let mut tracker = tracker();
            let before = (0..30).map(|ms| {
                tracker.update(Timestamp::from_micros(ms * 1000), 0.9, Flags::NONE, None).0
            });
            assert_eq!(before.last(), Some(Decision::Stable));
            let now = Timestamp::from_micros(30_000);
            let (decision, _) = tracker.update(now, 0.9, Flags::NONE.with(flag), None);
            assert_eq!(decision, Decision::NotStable, "{flag:?}");
        }
    }

    #[test]
    fn phase_is_unknown_without_a_load_signal() {
        let mut tracker = tracker();
        for load in [None, Some(Load(f32::NAN))] {
            let (_, phase) = tracker.update(Timestamp::default(), 0.9, Flags::NONE, load);
            assert_eq!(phase, Phase::Unknown);
        }
    }

    #[test]
    fn load_and_decision_make_the_four_cases() {
        let cases = [
            (0.9, 100.0, Phase::Stance),
            (0.1, 100.0, Phase::Slip),
            (0.1, 0.0, Phase::Swing),
            (0.9, 0.0, Phase::QuietSwing),
        ];
        for (p, load, expected) in cases {
            let mut tracker = tracker();
            let phase = (0..40)
                .map(|ms| {
                    let now = Timestamp::from_micros(ms * 1000);
                    tracker.update(now, p, Flags::NONE, Some(Load(load))).1
                })
                .last();
            assert_eq!(phase, Some(expected));
        }
    }

    #[test]
    fn loading_is_kept_between_the_load_thresholds() {
        let mut tracker = tracker();
        let phases = [8.0, 12.0, 8.0, 6.0, 5.9, 8.0].map(|load| {
            let (_, phase) =
                tracker.update(Timestamp::default(), 0.1, Flags::NONE, Some(Load(load)));
            phase
        });
        use Phase::{Slip, Swing};
        assert_eq!(phases, [Swing, Slip, Slip, Slip, Swing, Swing]);
    }

    #[test]
    fn standing_foot_is_not_reported_as_slip_during_the_on_delay() {
        let mut tracker = tracker();
        let phases: Vec<_> = (0..40)
            .map(|ms| {
                let now = Timestamp::from_micros(ms * 1000);
                let load = Some(Load(100.0));
                tracker.update(now, 0.9, Flags::NONE, load).1
            })
            .collect();
        assert!(phases[..20].iter().all(|phase| *phase == Phase::Unknown));
        assert!(phases[20..].iter().all(|phase| *phase == Phase::Stance));
    }

    #[test]
    fn doubt_about_the_motion_makes_the_phase_unknown() {
        for flag in Flag::ALL {
            let mut tracker = tracker();
            let load = Some(Load(100.0));
            tracker.update(Timestamp::default(), 0.0, Flags::NONE, load);
            let flags = Flags::NONE.with(flag);
            let (_, phase) = tracker.update(Timestamp::from_micros(1_000), 0.0, flags, load);
            let expected = match flag {
                Flag::Saturated | Flag::TimeGap | Flag::Settling => Phase::Slip,
                _ => Phase::Unknown,
            };
            assert_eq!(phase, expected, "{flag:?}");
        }
    }
}
