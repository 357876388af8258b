//! A person's hands, which turn a foot to one of its sides and tap its sole.

use lsm6dsox::sim::Stimulus;
use samples::space::{Rotation, Vector};

/// Hands around a foot. Without a command they leave it as it is.
#[derive(Clone, Debug)]
pub struct Hands {
    /// Orientation before the newest turn.
    before: Rotation,
    turn: Option<Turn>,
    tapped_s: Option<f64>,
}

impl Default for Hands {
    fn default() -> Self {
        let v = Vector::default();
        Self { before: Rotation { w: 1.0, v }, turn: None, tapped_s: None }
    }
}

/// Duration of a turn, s.
const TURN_S: f64 = 1.0;

/// Duration of a tap, s, and its greatest acceleration, m/s².
const TAP_S: f64 = 0.006;
const TAP: f64 = 60.0;

impl Hands {
    /// Begins to turn the foot to a side.
    pub fn turn_to(&mut self, side: Side, time_s: f64) {
        let now = self.orientation(time_s);
        let (from, to) = (now.to_sensor(Vector::new(0.0, 0.0, 1.0)), side.up());
        // The direction of up turns against the foot.
        let axis = to.cross(from);
        let axis = match axis.length() {
            // Half a turn about any axis across.
            near if near < 1e-6 && from.dot(to) < 0.0 => {
                let [x, y, z] = to.to_array();
                Vector::new(y, z, x)
            }
            near if near < 1e-6 => Vector::default(),
            length => axis * (1.0 / length),
        };
        self.before = now;
        self.turn = Some(Turn { axis, angle_rad: from.angle_to(to), began_s: time_s });
    }

    /// Taps the sole.
    pub fn tap(&mut self, time_s: f64) {
        self.tapped_s = Some(time_s);
    }

    fn orientation(&self, time_s: f64) -> Rotation {
        let Some(turn) = self.turn else {
            return self.before;
        };
        let half = turn.share(time_s).0 * turn.angle_rad / 2.0;
        self.before.after(Rotation { w: half.cos(), v: turn.axis * half.sin() })
    }

    /// Stimulus of the sensor in these hands, of a foot whose sensor has the stimulus `without` them.
    #[must_use]
    pub fn stimulus(&self, without: &Stimulus, time_s: f64) -> Stimulus {
        let orientation = self.orientation(time_s);
        let mut force = Vector::from_array(without.specific_force);
        if let Some(tapped_s) = self.tapped_s
            && (0.0..TAP_S).contains(&(time_s - tapped_s))
        {
            let phase = core::f64::consts::PI * (time_s - tapped_s) / TAP_S;
            force = force + Vector::new(0.0, 0.0, TAP * phase.sin());
        }
        let turning = self
            .turn
            .map_or(Vector::default(), |turn| turn.axis * (turn.angle_rad * turn.share(time_s).1));
        let rate = orientation.to_sensor(Vector::from_array(without.angular_rate)) + turning;
        Stimulus {
            specific_force: orientation.to_sensor(force).to_array(),
            angular_rate: rate.to_array(),
            temperature: without.temperature,
        }
    }
}

/// A rotation about a fixed axis of the foot.
#[derive(Clone, Copy, Debug)]
struct Turn {
    /// Axis of the foot.
    axis: Vector,
    angle_rad: f64,
    began_s: f64,
}

impl Turn {
    /// Share of the angle that is done at a time, and its derivative, 1/s: without jumps of rate or acceleration.
    fn share(&self, time_s: f64) -> (f64, f64) {
        let x = ((time_s - self.began_s) / TURN_S).clamp(0.0, 1.0);
        let share = x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
        let slope = 30.0 * x * x * (1.0 - x) * (1.0 - x) / TURN_S;
        (share, slope)
    }
}

/// A side of the foot, by its index in [`Side::NAMES`]: the direction that is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side(usize);

impl Side {
    /// Names of all sides, in the order x, y, z, each up and then down.
    pub const NAMES: [&'static str; 6] = ["x", "-x", "y", "-y", "z", "-z"];

    /// Parses a name.
    #[must_use]
    pub fn find(name: &str) -> Option<Self> {
        let mut names = Self::NAMES.iter();
        names.position(|known| *known == name).map(Self)
    }

    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self.0]
    }

    fn up(self) -> Vector {
        let mut axes = [0.0; 3];
        axes[self.0 / 2] = if self.0 % 2 == 1 { -1.0 } else { 1.0 };
        Vector::from_array(axes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait::sensor::GRAVITY;

    #[test]
    fn foot_is_turned_to_each_side_from_each_other() {
        for from in Side::NAMES {
            for to in Side::NAMES {
                let mut hands = Hands::default();
                for (name, time_s) in [(from, 0.0), (to, 2.0)] {
                    hands.turn_to(Side::find(name).expect("a side"), time_s);
                }
                let force = Vector::from_array(hands.stimulus(&Stimulus::REST, 4.0).specific_force);
                let up = Side::find(to).expect("a side").up();
                let error = (force + up * -GRAVITY).length();
                assert!(error < 1e-6, "{from} to {to}: {force:?}");
            }
        }
    }

    #[test]
    fn rate_of_a_turn_is_that_of_gravity_in_the_foot() {
        let mut hands = Hands::default();
        hands.turn_to(Side::find("x").expect("a side"), 0.0);
        for step in 1..999 {
            let time_s = f64::from(step) * 1e-3;
            let at = |time_s| hands.stimulus(&Stimulus::REST, time_s);
            let [before, after] =
                [-1e-5, 1e-5].map(|s| Vector::from_array(at(time_s + s).specific_force));
            let force = Vector::from_array(at(time_s).specific_force);
            let change = (after + before * -1.0) * (1.0 / 2e-5);
            let expected = force.cross(Vector::from_array(at(time_s).angular_rate));
            assert!((change + expected * -1.0).length() < 1e-3, "{time_s}");
        }
    }

    #[test]
    fn tap_lasts_six_milliseconds() {
        let mut hands = Hands::default();
        hands.tap(1.0);
        let up = |time_s| hands.stimulus(&Stimulus::REST, time_s).specific_force[2];
        assert!((up(1.003) - GRAVITY - TAP).abs() < 1e-6);
        assert_eq!((up(0.999), up(1.007)), (GRAVITY, GRAVITY));
    }
}
