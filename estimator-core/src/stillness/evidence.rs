//! Evidence that a foot stands: it has rested, or it has landed.
//!
//! What a foot has learnt leaves room for stances that shake. A foot that hangs, is carried or lies on a
//! mattress moves within that room, for minutes. It does not show what each stride of a walk does: a
//! swing as strong as usual, and stillness within a stride of it; nor what a foot that stands shows: rest.
//! Without either for [`EvidenceParams::lasts`] the foot is not called stable, however little it moves,
//! and nothing is learnt.

use super::params::EvidenceParams;
use crate::logarithm::exp;
use crate::order::Order;

/// The newest sample, as evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// A swing as strong as the foot's own.
    Swing,
    /// As still as in the middle of a stance, in each quantity.
    Rest,
    /// Neither.
    Nothing,
}

/// Times are not counted beyond this, s.
pub(super) const LONGEST: f32 = 200.0;

/// Rest is counted up to so many times what is enough, so that a disturbance does not end it at once.
const MOST_REST: f32 = 1.3;

/// How the foot was seen last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    params: EvidenceParams,
    /// s.
    period: f32,
    /// Share of the way that the factor goes in a sample.
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
    /// A foot that is believed until its first chance to show itself has passed. `sample_rate` in Hz.
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

    /// Takes in a sample.
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
    fn motion_without_evidence_is_not_believed_for_long() {
        let mut evidence = Evidence::new(PARAMS, 1000.0);
        feed(&mut evidence, Shown::Swing, 0.3);
        assert!(feed(&mut evidence, Shown::Nothing, 0.9 * PARAMS.lasts) > 0.99);
        assert!(feed(&mut evidence, Shown::Nothing, 0.5) < 0.1);
        assert!(feed(&mut evidence, Shown::Nothing, 600.0) < 1.0e-6);
    }

    #[test]
    fn a_swing_and_enough_rest_are_believed_again() {
        for (shown, seconds) in [(Shown::Swing, 0.3), (Shown::Rest, 1.5 * PARAMS.rest + 0.3)] {
            let mut evidence = Evidence::new(PARAMS, 1000.0);
            feed(&mut evidence, Shown::Nothing, 10.0);
            assert!(feed(&mut evidence, shown, seconds) > 0.9, "{shown:?}");
        }
    }

    #[test]
    fn moments_of_rest_are_no_rest() {
        let mut evidence = Evidence::new(PARAMS, 1000.0);
        for _ in 0..100 {
            feed(&mut evidence, Shown::Rest, 0.8 * PARAMS.rest);
            feed(&mut evidence, Shown::Nothing, 0.8 * PARAMS.rest);
        }
        assert!(evidence.factor < 0.01, "{evidence:?}");
    }
}
