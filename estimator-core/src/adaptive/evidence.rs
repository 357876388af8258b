//! Evidence that a foot stands: it has rested, or it has landed.
//!
//! Learnt limits leave room for stances that shake. A foot that hangs, is carried or shaken moves within that
//! room, for minutes. It lacks the evidence of each stride of a walk, the fall of the acceleration from that of a swing to
//! that of a stance; and that of a standing foot, rest. A swing ends with the speed that it began with, none: what a foot
//! gains in a swing it loses before it lands, while one that is shaken is fastest where its acceleration falls.
//! Without either for [`Constants::evidence`] the foot is not stable, however little it moves, and nothing is learnt.
//! Before the first evidence the probability is at most one half.

use super::constants::Constants;
use crate::logarithm::{exp, ln};
use crate::order::Order;
use crate::units::STANDARD_GRAVITY;
use crate::vector::Vec3;

/// Limit of counted rest, as a multiple of the required rest, so that a disturbance does not end it at once.
const MOST_REST: f32 = 1.3;

/// Mean mass below which the foot is in motion without doubt.
const MOVES: f32 = 0.2;

/// Largest acceleration, m/s², and rate, rad/s, that count in the short means: an impact decays soon.
const LARGEST: f32 = 2.0;

/// Logarithm of a swing weaker than any.
const WEAKEST: f32 = -3.0;

/// Factor of the probability before the first evidence.
const UNPROVEN: f32 = 0.5;

/// State of the evidence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// Time between samples, s.
    period: f32,
    /// Shares of the newest sample in the short means and the factor, and in the mean of a swing.
    share: f32,
    swing_share: f32,
    /// Short means of acceleration, m/s², angular rate, rad/s, frame of the foot, and the logarithm of the acceleration.
    /// The hum of a motor has no mean.
    acceleration: Vec3,
    rate: Vec3,
    calm: f32,
    /// Mean logarithm of the acceleration over a swing, its recent maximum, which falls by a unit in the time of evidence,
    /// and the acceleration of that, m/s².
    swing: f32,
    strongest: f32,
    strongest_acceleration: f32,
    falls_by: f32,
    shrinks_to: f32,
    /// Logarithm of the noise.
    noise: f32,
    /// Acceleration that corrections of up have removed since that maximum, m/s²: where a pendulum turns, its force points
    /// along the rod, and what looked like a swing was a false idea of up.
    corrected: f32,
    /// Sum of the accelerations since the last fall, and of their magnitudes: by as much the speed has changed, and by as
    /// much at most it could have.
    gained: Vec3,
    gained_at_most: f32,
    /// Rest, less the time without it, s.
    rested: f32,
    /// Times since the foot moved, since it landed, since the acceleration fell as in a landing, and since the last
    /// evidence, s.
    since_motion: f32,
    since_landing: f32,
    since_fall: f32,
    since: f32,
    seen: bool,
    landed: bool,
    /// Whether the acceleration is far below that of the swing before, and whether it has just fallen so far from a swing
    /// that counts as motion. A fall is that of a landing if the swing has lost what it gained.
    calms: bool,
    lands: bool,
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
}

impl Evidence {
    /// A foot of which nothing is known.
    pub fn new(constants: &Constants, period: f32, share: f32) -> Self {
        Self {
            period,
            share,
            swing_share: 1.0 - exp(-period / constants.stance),
            acceleration: Vec3::ZERO,
            rate: Vec3::ZERO,
            calm: 0.0,
            swing: WEAKEST,
            strongest: WEAKEST,
            strongest_acceleration: exp(WEAKEST),
            falls_by: period / constants.evidence,
            shrinks_to: exp(-period / constants.evidence),
            noise: ln(constants.noise),
            corrected: 0.0,
            gained: Vec3::ZERO,
            gained_at_most: 0.0,
            rested: 0.0,
            since_motion: f32::INFINITY,
            since_landing: f32::INFINITY,
            since_fall: f32::INFINITY,
            since: f32::INFINITY,
            seen: false,
            landed: false,
            calms: false,
            lands: false,
            evident: false,
            factor: UNPROVEN,
        }
    }

    /// Factor of the probability: 1 while there is evidence, 0 without, one half before the first.
    pub const fn factor(&self) -> f32 {
        self.factor
    }

    /// Returns whether the foot has rested or landed since the start.
    pub const fn seen(&self) -> bool {
        self.seen
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

    /// Returns whether the foot is learnt from: it walks, or has yet to show that it does.
    pub fn walks(&self, constants: &Constants) -> bool {
        !self.landed || self.since_landing < constants.evidence
    }

    /// Lets a time in s pass without a reliable sample.
    pub fn pass(&mut self, seconds: f32) {
        self.since_motion += seconds;
        self.since_landing += seconds;
        self.since_fall += seconds;
        self.since += seconds;
        self.rested = (self.rested - seconds).greater(0.0);
    }

    /// Processes a sample.
    pub fn push(&mut self, constants: &Constants, reading: &Reading) {
        let period = self.period;

        self.acceleration +=
            (reading.acceleration.clipped(LARGEST) - self.acceleration) * self.share;
        self.rate += (reading.rate.clipped(LARGEST) - self.rate) * self.share;
        let is_below = |mean: Vec3, limit: f32| mean.dot(mean) < limit * limit;
        let rests = is_below(self.acceleration, constants.rest_acceleration)
            && is_below(self.rate, constants.rest_rate);
        self.rested = match rests {
            true => (self.rested + period).lesser(MOST_REST * constants.stance),
            false => (self.rested - period).greater(0.0),
        };

        self.calm += (reading.logarithm - self.calm) * self.share;
        self.swing += (reading.logarithm - self.swing) * self.swing_share;
        self.corrected += STANDARD_GRAVITY * reading.correction;
        self.strongest -= self.falls_by;
        let swing = match self.swing > self.strongest {
            true => {
                self.strongest = self.swing;
                self.strongest_acceleration = exp(self.swing);
                self.corrected = 0.0;
                self.swing
            }
            false => {
                self.strongest_acceleration *= self.shrinks_to;
                ln((self.strongest_acceleration - self.corrected).greater(f32::MIN_POSITIVE))
            }
        };
        self.since_motion = match reading.still < MOVES {
            true => 0.0,
            false => self.since_motion + period,
        };
        let calms = self.calm < swing.greater(self.noise) - constants.landing;
        let moved = self.since_motion < constants.evidence;
        let falls = calms && !self.calms;
        self.gained += reading.acceleration;
        self.gained_at_most += magnitudes(reading.acceleration);
        let ends = magnitudes(self.gained) < constants.leftover * self.gained_at_most;
        let has_rested = self.rested > constants.stance;
        if falls || has_rested {
            self.gained = Vec3::ZERO;
            self.gained_at_most = 0.0;
        }
        self.lands = calms && (self.lands || falls && ends);
        self.evident = falls && moved;
        let unseen = falls && self.lands && !moved;
        self.since_fall = match falls {
            true => 0.0,
            false => self.since_fall + period,
        };
        self.calms = calms;
        let lands = self.lands && moved;
        self.landed |= lands;
        // A foot that lands unseen walks, and is to be learnt from.
        self.since_landing = match lands || unseen {
            true => 0.0,
            false => self.since_landing + period,
        };

        let has_evidence = lands || has_rested;
        self.seen |= has_evidence;
        self.since = match has_evidence {
            true => 0.0,
            false => self.since + period,
        };
        let target = match (self.since < constants.evidence, self.seen) {
            (true, _) => 1.0,
            (false, true) => 0.0,
            (false, false) => UNPROVEN,
        };
        self.factor += (target - self.factor) * self.share;
    }
}

/// Sum of the magnitudes of a vector's components: a length of which a sum is never longer than the sum of the lengths.
const fn magnitudes(vector: Vec3) -> f32 {
    vector.x.abs() + vector.y.abs() + vector.z.abs()
}
