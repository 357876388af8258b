//! Evidence that a foot stands: it has rested, or it has landed.
//!
//! Learnt limits leave room for stances that shake. A foot that hangs, is carried or shaken moves within that
//! room, for minutes. It lacks the evidence of each stride of a walk, a landing, and that of a standing foot, rest.
//! Without either for [`Constants::evidence`] the probability is at most one half, however little the foot moves, and
//! nothing is learnt.

use super::STILL;
use super::constants::Constants;
use super::landing::Landing;
use super::rest::Rest;
use crate::vector::Vec3;

/// Factor of the probability without evidence: the foot may stand or hang.
const UNPROVEN: f32 = 0.5;

/// State of the evidence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    rest: Rest,
    landing: Landing,
    /// Times since the foot moved, since it landed, since the acceleration fell as in a landing, and since the last
    /// evidence, s.
    since_motion: f32,
    since_landing: f32,
    since_fall: f32,
    since: f32,
    /// Whether there is evidence, as of the newest reliable sample.
    given: bool,
    landed: bool,
    /// Whether the acceleration has just fallen from a swing that counts as motion.
    evident: bool,
    /// Factor of the probability.
    factor: f32,
}

/// Readings of one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// Acceleration, m/s², and the logarithm that the classes judge.
    pub acceleration: Vec3,
    pub logarithm: f32,
    /// Angular rate, rad/s.
    pub rate: Vec3,
    /// Angle by which up was corrected, rad.
    pub correction: f32,
    /// Probability of stillness without evidence.
    pub still: f32,
    /// Samples since the one before, more than one where a gap is bridged; their time, s, and their share in a mean over a
    /// window.
    pub samples: f32,
    pub seconds: f32,
    pub share: f32,
}

impl Evidence {
    /// A foot of which nothing is known, with samples each `period` seconds.
    pub fn new(constants: &Constants, period: f32) -> Self {
        Self {
            rest: Rest::NONE,
            landing: Landing::new(constants, period),
            since_motion: f32::INFINITY,
            since_landing: f32::INFINITY,
            since_fall: f32::INFINITY,
            since: f32::INFINITY,
            given: false,
            landed: false,
            evident: false,
            factor: UNPROVEN,
        }
    }

    /// Factor of the probability: 1 while there is evidence, at most one half without.
    pub const fn factor(&self) -> f32 {
        self.factor
    }

    /// Returns whether the foot has rested or landed lately.
    pub const fn is_given(&self) -> bool {
        self.given
    }

    /// Returns whether the acceleration is too large for rest.
    pub fn is_accelerated(&self, constants: &Constants) -> bool {
        self.rest.is_accelerated(constants)
    }

    /// Returns whether the foot has just landed from a swing that counted as motion.
    pub const fn lands_evidently(&self) -> bool {
        self.evident
    }

    /// Returns whether the acceleration fell as in a landing, from a swing that counted as motion or not, within some
    /// seconds.
    pub fn fell_within(&self, seconds: f32) -> bool {
        self.since_fall < seconds
    }

    /// Returns whether the foot walks, or has yet to show that it does.
    pub fn walks(&self, constants: &Constants) -> bool {
        !self.landed || self.since_landing < constants.evidence
    }

    /// Lets a time in s pass without a reliable sample.
    pub fn pass(&mut self, seconds: f32) {
        self.rest.pass(seconds);
        self.since_motion += seconds;
        self.since_landing += seconds;
        self.since_fall += seconds;
        self.since += seconds;
    }

    /// Processes a sample.
    pub fn push(&mut self, constants: &Constants, reading: &Reading) {
        let since =
            |happens: bool, before: f32| if happens { 0.0 } else { before + reading.seconds };
        let has_rested = self.rest.push(constants, reading);
        let fall = self.landing.push(constants, reading, has_rested);
        self.since_motion = since(reading.still < STILL, self.since_motion);
        self.since_fall = since(fall.begins, self.since_fall);
        let moved = self.since_motion < constants.evidence;
        self.evident = fall.begins && moved;
        let lands = fall.lands && moved;
        self.landed |= lands;
        // A foot that lands unseen walks, and is to be learnt from.
        let lands_unseen = fall.lands && fall.begins && !moved;
        self.since_landing = since(lands || lands_unseen, self.since_landing);

        self.since = since(lands || has_rested, self.since);
        self.given = self.since < constants.evidence;
        self.factor = match self.given {
            true => self.factor + (1.0 - self.factor) * reading.share,
            false => UNPROVEN,
        };
    }
}
