//! The parts of a motion, each judged by the classes alone.
//!
//! A part's amplitude is at most that of the whole motion, so it is at least as still. On a foot that
//! samples fast, parts take turns: with each sample one of the two directions or one axis is judged,
//! and its means then move by as much as they would have in between. So the parts cost little compared
//! to the whole, which is judged with every sample. The values of the parts are those of the previous
//! sample or older.

use super::quantity::{Edge, PerQuantity, QuantityCoefficients};
use super::{heard, mass_of};
use crate::axis::PerAxis;
use crate::logarithm::exp;
use crate::order::Order;
use crate::vector::Vec3;

/// Sample rate from which parts take turns, Hz.
const TURNS_FROM: f32 = 500.0;

/// Samples between two turns of a direction.
const DIRECTION_TURN: u32 = 3;

/// Samples between two turns of an axis.
const AXIS_TURN: u32 = 18;

/// A motion and the squares of its total amplitudes.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Motion {
    pub acceleration: Vec3,
    pub rate: Vec3,
    pub velocity: Vec3,
    /// Unit vector that points up, sensor frame.
    pub up: Vec3,
    pub squares: PerQuantity<f32>,
}

/// A part of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Part {
    /// Along the ground, and turning about up.
    Tangential,
    /// Along up, and tilting.
    Vertical,
    /// Along an axis of the sensor: 0 for x to 2 for z.
    Along(usize),
    /// About an axis of the sensor.
    About(usize),
}

impl Part {
    const ALL: [Self; 8] = [
        Self::Tangential,
        Self::Vertical,
        Self::Along(0),
        Self::Along(1),
        Self::Along(2),
        Self::About(0),
        Self::About(1),
        Self::About(2),
    ];

    /// Returns the squares of the part's share of each quantity; `None` if the part has no share.
    fn squares(self, motion: &Motion) -> PerQuantity<Option<f32>> {
        let &Motion {
            acceleration,
            rate,
            velocity,
            up,
            squares,
        } = motion;
        let upright = |vector: Vec3| {
            let along = vector.dot(up);
            along * along
        };
        let component = |vector: Vec3, axis: usize| {
            let value = match axis {
                0 => vector.x,
                1 => vector.y,
                _ => vector.z,
            };
            Some(value * value)
        };
        // Rounding may leave a slightly negative value, which the floors of the logarithms cover.
        match self {
            Self::Tangential => PerQuantity {
                acceleration: Some(squares.acceleration - upright(acceleration)),
                rate: Some(upright(rate)),
                velocity: Some(squares.velocity - upright(velocity)),
            },
            Self::Vertical => PerQuantity {
                acceleration: Some(upright(acceleration)),
                rate: Some(squares.rate - upright(rate)),
                velocity: Some(upright(velocity)),
            },
            Self::Along(axis) => PerQuantity {
                acceleration: component(acceleration, axis),
                rate: None,
                velocity: component(velocity, axis),
            },
            Self::About(axis) => PerQuantity {
                acceleration: None,
                rate: component(rate, axis),
                velocity: None,
            },
        }
    }
}

/// State of one part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct State {
    /// Mean masses.
    acceleration: f32,
    rate: f32,
    probability: f32,
}

/// State of all parts.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Parts {
    states: [State; Part::ALL.len()],
    /// Shares of the newest mass in the means of directions and of axes.
    direction: f32,
    axis: f32,
    schedule: Schedule,
}

/// Least time constant of a mean, samples: with less than one, as at 100 Hz, the mean is the newest sample.
pub(super) const LEAST_WINDOW: f32 = 2.0;

/// Schedule of the parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Schedule {
    /// All with each sample.
    All,
    /// By turns; samples since the first turn.
    Turns(u32),
}

impl Parts {
    /// Means over the time constant `window`, s, at a sample rate in Hz.
    pub fn new(window: f32, sample_rate: f32) -> Self {
        let share = |samples: u32| {
            let window = (window * sample_rate).greater(LEAST_WINDOW);
            1.0 - exp(-(samples as f32) / window)
        };
        let by_turns = sample_rate >= TURNS_FROM;
        let (direction, axis) = match by_turns {
            true => (DIRECTION_TURN, AXIS_TURN),
            false => (1, 1),
        };
        Self {
            states: [State::default(); Part::ALL.len()],
            direction: share(direction),
            axis: share(axis),
            schedule: match by_turns {
                true => Schedule::Turns(0),
                false => Schedule::All,
            },
        }
    }

    /// Judges the parts that are due. Up to [`AXIS_TURN`] samples in `filled`, the newest mass is the mean.
    pub fn push(
        &mut self,
        motion: &Motion,
        edges: &PerQuantity<Edge>,
        quantities: &PerQuantity<QuantityCoefficients>,
        filled: u32,
    ) {
        match &mut self.schedule {
            Schedule::All => {
                for index in 0..Part::ALL.len() {
                    self.judge(index, motion, edges, quantities, filled);
                }
            }
            Schedule::Turns(turn) => {
                let (slot, round) = (*turn % DIRECTION_TURN, *turn / DIRECTION_TURN);
                *turn = (*turn + 1) % AXIS_TURN;
                // Tangential, vertical, and one of the six axes.
                let index = if slot < 2 { slot } else { 2 + round };
                self.judge(index as usize, motion, edges, quantities, filled);
            }
        }
    }

    #[inline(never)]
    fn judge(
        &mut self,
        index: usize,
        motion: &Motion,
        edges: &PerQuantity<Edge>,
        quantities: &PerQuantity<QuantityCoefficients>,
        filled: u32,
    ) {
        let (Some(part), Some(state)) = (Part::ALL.get(index), self.states.get_mut(index)) else {
            return;
        };
        let share = match (part, filled) {
            // The first value of a mean has no predecessor.
            (_, ..=AXIS_TURN) => 1.0,
            (Part::Tangential | Part::Vertical, _) => self.direction,
            (Part::Along(_) | Part::About(_), _) => self.axis,
        };
        let squares = part.squares(motion);
        let mut probability = 1.0;
        if let Some(square) = squares.acceleration {
            let edge = &edges.acceleration;
            let newest = mass_of(square, edge, &quantities.acceleration);
            state.acceleration += (newest - state.acceleration) * share;
            probability *= heard(state.acceleration, edge);
        }
        if let Some(square) = squares.rate {
            let newest = mass_of(square, &edges.rate, &quantities.rate);
            state.rate += (newest - state.rate) * share;
            probability *= heard(state.rate, &edges.rate);
        }
        if let Some(square) = squares.velocity {
            let newest = mass_of(square, &edges.velocity, &quantities.velocity);
            probability *= heard(newest, &edges.velocity);
        }
        state.probability = probability;
    }

    /// Multiplies all means by `share`.
    pub fn scale(&mut self, share: f32) {
        for state in &mut self.states {
            state.acceleration *= share;
            state.rate *= share;
            state.probability *= share;
        }
    }

    /// Returns the tangential and vertical probabilities and those per axis.
    pub fn probabilities(&self) -> (f32, f32, PerAxis<f32>) {
        let [tangential, vertical, ax, ay, az, wx, wy, wz] =
            self.states.map(|state| state.probability);
        (
            tangential,
            vertical,
            PerAxis::from_array([ax, ay, az, wx, wy, wz]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion with the squares of its total, on a foot whose up is z.
    fn motion(acceleration: Vec3, rate: Vec3, velocity: Vec3) -> Motion {
        Motion {
            acceleration,
            rate,
            velocity,
            up: Vec3::new(0.0, 0.0, 1.0),
            squares: PerQuantity {
                acceleration: acceleration.dot(acceleration),
                rate: rate.dot(rate),
                velocity: velocity.dot(velocity),
            },
        }
    }

    #[test]
    fn each_part_sees_its_own_share_of_the_motion_and_nothing_else() {
        let motion = motion(
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(4.0, 5.0, 6.0),
            Vec3::new(7.0, 8.0, 9.0),
        );
        let squares = Part::ALL.map(|part| {
            let of = part.squares(&motion);
            [of.acceleration, of.rate, of.velocity]
        });
        assert_eq!(squares[0], [Some(5.0), Some(36.0), Some(113.0)]);
        assert_eq!(squares[1], [Some(9.0), Some(41.0), Some(81.0)]);
        for (axis, [a, w, v]) in [[1.0, 16.0, 49.0], [4.0, 25.0, 64.0], [9.0, 36.0, 81.0]]
            .into_iter()
            .enumerate()
        {
            assert_eq!(squares[2 + axis], [Some(a), None, Some(v)]);
            assert_eq!(squares[5 + axis], [None, Some(w), None]);
        }
    }
}
