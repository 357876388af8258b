//! Evidence that a foot stands: it has rested, or it has landed.
//!
//! Learnt limits leave room for stances that shake. A foot that hangs, is carried or lies on a
//! mattress moves within that room, for minutes. It lacks the evidence of each stride of a walk: a
//! swing as strong as usual, and stillness within a stride of it; and that of a standing foot: rest.
//! Without either for [`EvidenceParams::lasts`] the foot is not called stable, however little it moves,
//! and nothing is learnt.

use super::params::EvidenceParams;
use crate::logarithm::exp;
use crate::order::Order;

/// Evidence in the newest sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum Shown {
    /// A swing as strong as the foot's own.
    Swing,
    /// As still as in the middle of a stance, in each quantity.
    Rest,
    /// Neither.
    Nothing,
}

/// Largest time that is counted, s.
pub(super) const LONGEST: f32 = 200.0;

/// Limit of counted rest, as a multiple of the required rest, so that a disturbance does not end it at once.
const MOST_REST: f32 = 1.3;

/// State of the evidence.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Evidence {
    params: EvidenceParams,
    /// Sample period, s.
    period: f32,
    /// Share of the remaining way that the factor moves in a sample.
    share: f32,
    /// Rest, less the time without it, s.
    rested: f32,
    /// Time since the last evidence, s.
    since: f32,
    /// Time since the foot has rested for long enough, s.
    since_rest: f32,
    /// Factor of the probability.
    factor: f32,
}

impl Evidence {
    /// A foot that is trusted until its first chance to show evidence has passed. `sample_rate` in Hz.
    pub fn new(params: EvidenceParams, sample_rate: f32) -> Self {
        Self {
            params,
            period: 1.0 / sample_rate,
            share: 1.0 - exp(-1.0 / (sample_rate * params.fading)),
            rested: 0.0,
            since: 0.0,
            since_rest: LONGEST,
            factor: 1.0,
        }
    }

    /// Time since the foot has rested for long enough, s.
    pub const fn since_rest(&self) -> f32 {
        self.since_rest
    }

    /// Factor of the probability, 0 to 1.
    pub const fn factor(&self) -> f32 {
        self.factor
    }

    /// Processes a sample.
    pub fn push(&mut self, shown: Shown) {
        let EvidenceParams { rest, lasts, .. } = self.params;
        self.rested = match shown {
            Shown::Rest => (self.rested + self.period).lesser(MOST_REST * rest),
            Shown::Swing | Shown::Nothing => (self.rested - self.period).greater(0.0),
        };
        self.since_rest = match self.rested > rest {
            true => 0.0,
            false => (self.since_rest + self.period).lesser(LONGEST),
        };
        self.since = match shown == Shown::Swing || self.rested > rest {
            true => 0.0,
            false => (self.since + self.period).lesser(LONGEST),
        };
        let target = if self.since < lasts { 1.0 } else { 0.0 };
        self.factor += (target - self.factor) * self.share;
    }
}

#[cfg(test)]
mod tests {
    use super::super::params::StillnessParams;
    use super::*;

    const PARAMS: EvidenceParams = StillnessParams::DEFAULT.evidence;

    fn feed(evidence: &mut Evidence, shown: Shown, seconds: f32) -> f32 {
        (0..(seconds * 1000.0) as u32).for_each(|_| evidence.push(shown));
        evidence.factor()
    }

    #[test]
    fn motion_without_evidence_is_soon_distrusted() {
        let mut evidence = Evidence::new(PARAMS, 1000.0);
        feed(&mut evidence, Shown::Swing, 0.3);
        assert!(feed(&mut evidence, Shown::Nothing, 0.9 * PARAMS.lasts) > 0.99);
        assert!(feed(&mut evidence, Shown::Nothing, 0.5) < 0.1);
        assert!(feed(&mut evidence, Shown::Nothing, 600.0) < 1.0e-6);
    }

    #[test]
    fn swing_and_enough_rest_restore_trust() {
        for (shown, seconds) in [(Shown::Swing, 0.3), (Shown::Rest, 1.5 * PARAMS.rest + 0.3)] {
            let mut evidence = Evidence::new(PARAMS, 1000.0);
            feed(&mut evidence, Shown::Nothing, 10.0);
            assert!(feed(&mut evidence, shown, seconds) > 0.9, "{shown:?}");
        }
    }

    #[test]
    fn moments_of_rest_do_not_count_as_rest() {
        let mut evidence = Evidence::new(PARAMS, 1000.0);
        for _ in 0..100 {
            feed(&mut evidence, Shown::Rest, 0.8 * PARAMS.rest);
            feed(&mut evidence, Shown::Nothing, 0.8 * PARAMS.rest);
        }
        assert!(evidence.factor < 0.01, "{evidence:?}");
    }
}
