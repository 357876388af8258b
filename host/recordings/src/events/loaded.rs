//! Time for which a loaded foot is never stable.

use estimator_core::{ContactEstimate, Phase, Timestamp};

use super::unstable::{SHORTEST_SWING_US, is_motion_unknown};
use super::{ContactEvent, EventKind};

/// Stance of a foot with a load, as long as it has not been stable.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Loaded {
    /// The foot is stable or its load is unknown.
    #[default]
    Otherwise,
    /// The foot is not loaded.
    Unloaded,
    /// The foot has been loaded since then, with this greatest probability.
    Since(Timestamp, f32),
}

impl Loaded {
    /// Processes the next estimate; returns start and end of a stance that ends here and was never stable.
    pub(super) fn add(&mut self, estimate: &ContactEstimate) -> Option<[ContactEvent; 2]> {
        let now = estimate.timestamp;
        let before = *self;
        *self = match (estimate.phase, before) {
            (Phase::Swing, _) => Self::Unloaded,
            // The decision is "stable" in a quiet swing.
            (Phase::Stance | Phase::QuietSwing | Phase::Unknown, _) => Self::Otherwise,
            // Without data the foot may have been stable.
            (Phase::Slip, _) if is_motion_unknown(estimate) => Self::Otherwise,
            (Phase::Slip, Self::Unloaded) => Self::Since(now, estimate.probabilities.stable),
            (Phase::Slip, Self::Since(start, peak)) => {
                Self::Since(start, peak.max(estimate.probabilities.stable))
            }
            (Phase::Slip, Self::Otherwise) => Self::Otherwise,
        };
        let (Self::Unloaded, Self::Since(start, peak)) = (*self, before) else {
            return None;
        };
        let duration_us = now.micros_since(start).filter(|us| *us >= SHORTEST_SWING_US)?;
        let of = |kind, time| ContactEvent {
            duration_us: Some(duration_us),
            peak,
            ..ContactEvent::new(kind, time)
        };
        Some([of(EventKind::UnstableStart, start), of(EventKind::UnstableEnd, now)])
    }
}
