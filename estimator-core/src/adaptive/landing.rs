//! Landings: the acceleration falls from that of a swing to that of a stance, and the swing has lost the speed that it
//! gained. A foot that is shaken is fastest where its acceleration falls.

use super::constants::Constants;
use super::evidence::Reading;
use crate::logarithm::{exp, ln};
use crate::order::Order;
use crate::units::STANDARD_GRAVITY;
use crate::vector::Vec3;

/// Logarithm of a swing weaker than any.
const WEAKEST: f32 = -3.0;

/// The swing that a landing follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landing {
    /// Share of the newest sample in the mean over a stance.
    stance_share: f32,
    /// Means of the logarithm of the acceleration over a window and over a stance.
    newest: f32,
    swing: f32,
    /// Recent maximum of the mean over a stance, which falls by a unit in the time of evidence, and its acceleration,
    /// m/s².
    strongest: f32,
    strongest_acceleration: f32,
    /// Logarithm of the noise.
    noise: f32,
    /// Acceleration that corrections of up have removed since that maximum, m/s²: where a pendulum turns, its force points
    /// along the rod, and what looked like a swing was a false idea of up.
    corrected: f32,
    /// Sum of the accelerations since the last fall, and of their magnitudes: by as much the speed has changed, and by as
    /// much at most it could have.
    gained: Vec3,
    gained_at_most: f32,
    /// Whether the acceleration is far below that of the swing, and whether that one has lost what it gained.
    is_below: bool,
    has_landed: bool,
}

/// The acceleration beside that of the swing before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fall {
    /// It has just fallen far below.
    pub begins: bool,
    /// It is far below, and the swing has lost what it gained.
    pub lands: bool,
}

impl Landing {
    /// No swing so far, with samples each `period` seconds.
    pub fn new(constants: &Constants, period: f32) -> Self {
        Self {
            stance_share: 1.0 - exp(-period / constants.stance),
            newest: 0.0,
            swing: WEAKEST,
            strongest: WEAKEST,
            strongest_acceleration: exp(WEAKEST),
            noise: ln(constants.noise),
            corrected: 0.0,
            gained: Vec3::ZERO,
            gained_at_most: 0.0,
            is_below: false,
            has_landed: false,
        }
    }

    /// Processes a sample. A foot that `has_rested` has no speed.
    pub fn push(&mut self, constants: &Constants, reading: &Reading, has_rested: bool) -> Fall {
        self.newest += (reading.logarithm - self.newest) * reading.share;
        let share = (self.stance_share * reading.samples).lesser(1.0);
        self.swing += (reading.logarithm - self.swing) * share;
        self.corrected += STANDARD_GRAVITY * reading.correction;
        let falls_by = reading.seconds / constants.evidence;
        self.strongest -= falls_by;
        let swing = match self.swing > self.strongest {
            true => {
                self.strongest = self.swing;
                self.strongest_acceleration = exp(self.swing);
                self.corrected = 0.0;
                self.swing
            }
            false => {
                self.strongest_acceleration *= 1.0 - falls_by;
                ln((self.strongest_acceleration - self.corrected).greater(f32::MIN_POSITIVE))
            }
        };
        let gained = reading.acceleration * reading.samples;
        self.gained += gained;
        self.gained_at_most += magnitudes(gained);
        let has_ended = magnitudes(self.gained) < constants.leftover * self.gained_at_most;

        let is_below = self.newest < swing.greater(self.noise) - constants.landing;
        let begins = is_below && !self.is_below;
        self.is_below = is_below;
        self.has_landed = is_below && (self.has_landed || begins && has_ended);
        if begins || has_rested {
            self.gained = Vec3::ZERO;
            self.gained_at_most = 0.0;
        }
        Fall { begins, lands: self.has_landed }
    }
}

/// Sum of the magnitudes of a vector's components: a length of which a sum is never longer than the sum of the lengths.
const fn magnitudes(vector: Vec3) -> f32 {
    vector.x.abs() + vector.y.abs() + vector.z.abs()
}
