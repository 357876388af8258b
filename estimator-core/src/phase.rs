//! Decision from the probability, and the phase of the gait if the load is known.
//!
//! The decision is debounced: the probability must exceed the threshold for an on-delay, and stay at or below it for an
//! off-delay. With the load, from a Schmitt trigger, the decision gives the paper's four cases:
//!
//! | | stable | not stable |
//! |---|---|---|
//! | loaded | stance | slip |
//! | not loaded | quiet swing | swing |
//!
//! A foot that has just touched down moves until its landing has rung out, and does not slip. From its touch-down until
//! it is stable, but for [`LONGEST_LANDING_US`] at most, it lands.

use crate::flags::{Flag, Flags};
use crate::sample::Timestamp;

/// The vertical load on the foot: N, or any unit in which the [`LoadParams`] thresholds are given.
///
/// It comes from a force or pressure sensor, or from a gait plan (1 where the leg is planned to stand).
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

/// Phase of the gait: the paper's four cases (section IV-B), a landing, or unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Phase {
    /// There is no load signal, or the flags leave open whether the foot moves.
    #[default]
    Unknown,
    /// Loaded and at rest: stable contact.
    Stance,
    /// Loaded and moving, after it was stable or later than a landing lasts: unstable contact.
    Slip,
    /// Not loaded and moving.
    Swing,
    /// Not loaded and at rest, as at the top of a slow swing.
    QuietSwing,
    /// Loaded and moving, since its touch-down: not yet at rest.
    Landing,
}

impl Phase {
    /// All phases, [`Phase::Unknown`] first.
    pub const ALL: [Self; 6] =
        [Self::Unknown, Self::Stance, Self::Slip, Self::Swing, Self::QuietSwing, Self::Landing];

    /// The phase's name as written in files: `stance`, `quiet_swing` and so on.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Stance => "stance",
            Self::Slip => "slip",
            Self::Swing => "swing",
            Self::QuietSwing => "quiet_swing",
            Self::Landing => "landing",
        }
    }
}

/// Longest landing, µs: time from touch-down for which a foot that moves is landing and not slipping.
///
/// Measured once: nine of ten landings of robots on firm ground end within 60 ms, and all landings of a NAO within
/// 120 ms. A GO1 that slides from its touch-down on grease does so for 190 to 440 ms.
const LONGEST_LANDING_US: u64 = 150_000;

/// State of the Schmitt trigger on the load signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Loading {
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
    /// Whether the foot is loaded; `None` before the first load.
    loading: Option<Loading>,
    /// Time of the touch-down, until the foot is stable or lifted.
    touch_down: Option<Timestamp>,
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
            loading: None,
            touch_down: None,
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
        (self.decision, self.phase(now, load))
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

    fn phase(&mut self, now: Timestamp, load: Option<Load>) -> Phase {
        let Some(Load(load)) = load.filter(|load| load.0.is_finite()) else {
            return Phase::Unknown;
        };
        let before = self.loading;
        let is_loaded = match before {
            Some(Loading::Loaded) => load >= self.coefficients.load_off,
            Some(Loading::Unloaded) | None => load >= self.coefficients.load_on,
        };
        let loading = if is_loaded { Loading::Loaded } else { Loading::Unloaded };
        self.loading = Some(loading);
        self.touch_down = match (before, loading, self.decision) {
            (Some(Loading::Unloaded), Loading::Loaded, _) => Some(now),
            (_, Loading::Loaded, Decision::NotStable) => self.touch_down,
            (_, Loading::Loaded, Decision::Stable) | (_, Loading::Unloaded, _) => None,
        };
        if self.deliberation == Deliberation::Undecided {
            return Phase::Unknown;
        }
        let since_touch_down = self.touch_down.and_then(|touch_down| now.micros_since(touch_down));
        let lands = since_touch_down.is_some_and(|elapsed| elapsed < LONGEST_LANDING_US);
        match (loading, self.decision) {
            (Loading::Loaded, Decision::Stable) => Phase::Stance,
            (Loading::Loaded, Decision::NotStable) if lands => Phase::Landing,
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
        use Phase::{Landing, Swing};
        assert_eq!(phases, [Swing, Landing, Landing, Landing, Swing, Swing]);
    }

    /// Phases of a foot with this probability and this load at each millisecond.
    fn phases(of: impl Fn(u64) -> (f32, f32)) -> Vec<Phase> {
        let mut tracker = tracker();
        let phase = |ms| {
            let (p, load) = of(ms);
            let now = Timestamp::from_micros(ms * 1000);
            tracker.update(now, p, Flags::NONE, Some(Load(load))).1
        };
        (0..600).map(phase).collect()
    }

    #[test]
    fn foot_lands_from_touch_down_until_it_is_stable() {
        let phases =
            phases(|ms| (if ms < 140 { 0.1 } else { 0.9 }, if ms < 100 { 0.0 } else { 50.0 }));
        assert!(phases[1..100].iter().all(|phase| *phase == Phase::Swing));
        assert!(phases[100..160].iter().all(|phase| *phase == Phase::Landing));
        assert!(phases[160..].iter().all(|phase| *phase == Phase::Stance));
    }

    #[test]
    fn foot_that_slides_from_its_touch_down_lands_and_then_slips() {
        let phases = phases(|ms| (0.1, if ms < 100 { 0.0 } else { 50.0 }));
        assert!(phases[100..250].iter().all(|phase| *phase == Phase::Landing));
        assert!(phases[250..].iter().all(|phase| *phase == Phase::Slip));
    }

    #[test]
    fn foot_that_moves_after_it_was_stable_slips_at_once() {
        let phases = phases(|ms| {
            let rests = (100..140).contains(&ms);
            (if rests { 0.9 } else { 0.1 }, if ms < 100 { 0.0 } else { 50.0 })
        });
        assert_eq!(phases[139], Phase::Stance);
        // Behind the off-delay.
        assert!(phases[143..].iter().all(|phase| *phase == Phase::Slip));
    }

    #[test]
    fn foot_without_a_seen_touch_down_does_not_land() {
        let phases = phases(|_| (0.1, 50.0));
        assert!(phases.iter().all(|phase| *phase != Phase::Landing));
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
