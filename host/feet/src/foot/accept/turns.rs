//! Six sides, and the turns between them: gravity on each side, and the gyroscope against gravity in each turn.

use std::time::Duration;

use samples::space::{Rotation, Vector};

use super::figure::{self, Figure};
use super::motion::{FootMotion, Moment, watch};
use super::motion::{RestDetector, Statistics};
use super::{AcceptStep, Person, StepFigures};
use crate::foot::Client;

/// Largest angle between an axis and the vertical on a side, rad: 20°.
const SIDE: f64 = 0.35;

/// Least angle by which gravity moves in a turn, rad: 45°.
const TURN: f64 = 0.785;

/// Longest turn, s. It is limited, because errors of the rate add up.
const LONGEST_TURN_S: f64 = 20.0;

/// Longest time between two motions of one turn, s.
const GAP_S: f64 = 0.1;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Progress over sides and turns.
#[derive(Default)]
struct SidesProgress {
    stillness: RestDetector,
    /// Force on each side, m/s²: x up, x down, y up, …
    sides: [Option<f64>; 6],
    /// Largest error of a turn about each axis, °.
    turns: [Option<f64>; 3],
    turning: Option<Turning>,
}

/// A turn since the last rest.
struct Turning {
    /// Direction of up at rest, and integrated from there.
    from: Vector,
    up: Vector,
    bias: Vector,
    /// Integral of the rate, rad.
    angle: Vector,
    last_s: f64,
    seconds: f64,
}

impl Turning {
    fn from_rest(rest: &Statistics, at_s: f64) -> Self {
        Self {
            from: unit(rest.force),
            up: unit(rest.force),
            bias: rest.rate,
            angle: Vector::default(),
            last_s: at_s,
            seconds: 0.0,
        }
    }

    /// Returns the axis of the turn and its error, °, if gravity has moved enough to `up`. A turn about the vertical does
    /// not move gravity.
    fn error(&self, up: Vector) -> Option<(usize, f64)> {
        let moved = self.from.angle_to(up).max(self.from.angle_to(self.up));
        let across = self.angle + self.from * -self.angle.dot(self.from);
        let error = self.up.angle_to(up).to_degrees();
        (moved >= TURN).then_some((largest(across), error))
    }

    /// Adds a motion; returns whether the turn can still be used.
    fn take(&mut self, motion: &FootMotion) -> bool {
        let at_s = seconds(motion);
        let step_s = at_s - self.last_s;
        self.last_s = at_s;
        self.seconds += step_s;
        let turned = (motion.rate + self.bias * -1.0) * step_s;
        self.angle = self.angle + turned;
        self.up = turn(turned).to_sensor(self.up);
        (0.0..GAP_S).contains(&step_s) && self.seconds < LONGEST_TURN_S
    }
}

/// Rotation by a vector of small length, rad.
fn turn(by: Vector) -> Rotation {
    let half = by.length() / 2.0;
    let scale = if half > 0.0 { half.sin() / (2.0 * half) } else { 0.5 };
    let (w, v) = (half.cos(), by * scale);
    Rotation { w, v }
}

fn seconds(motion: &FootMotion) -> f64 {
    motion.at.as_micros() as f64 * 1e-6
}

fn unit(vector: Vector) -> Vector {
    vector * (1.0 / vector.length())
}

/// Index of the component of largest magnitude.
fn largest(vector: Vector) -> usize {
    let magnitudes = vector.to_array().map(f64::abs);
    (0..3).fold(
        0,
        |largest, axis| {
            if magnitudes[axis] > magnitudes[largest] { axis } else { largest }
        },
    )
}

impl SidesProgress {
    /// Processes a motion; returns a text for the person about a new side or turn.
    fn take(&mut self, motion: FootMotion) -> Option<String> {
        if let Some(turning) = &mut self.turning
            && !turning.take(&motion)
        {
            self.turning = None;
        }
        let rest = self.stillness.take(motion)?;
        let up = unit(rest.force);
        let mut news = None;
        if let Some((axis, error)) = self.turning.as_ref().and_then(|turn| turn.error(up)) {
            let worst = self.turns[axis].unwrap_or(0.0);
            self.turns[axis] = Some(worst.max(error));
            news = Some(format!("turned about {}: {error:.1}° off", AXES[axis]));
        }
        self.turning = Some(Turning::from_rest(&rest, seconds(&motion)));
        let axis = largest(up);
        let component = up.to_array()[axis];
        let side = 2 * axis + usize::from(component < 0.0);
        if component.abs() >= SIDE.cos() && self.sides[side].is_none() {
            self.sides[side] = Some(rest.force.length());
            let (name, way) = (AXES[axis], if component < 0.0 { "down" } else { "up" });
            let (count, force) = (self.sides.iter().flatten().count(), rest.force.length());
            let taken = format!("{name} {way}: {force:.2} m/s², {count} of 6");
            news = Some(news.map_or(taken.clone(), |turned| format!("{turned}; {taken}")));
        }
        news
    }

    fn is_complete(&self) -> bool {
        self.sides.iter().all(Option::is_some) && self.turns.iter().all(Option::is_some)
    }

    /// Returns the axes about which there was no turn.
    fn missing_turns(&self) -> String {
        let missing = AXES.into_iter().zip(self.turns);
        let missing = missing.filter(|(_, turn)| turn.is_none());
        let missing: Vec<_> = missing.map(|(axis, _)| axis).collect();
        missing.join(" and ")
    }
}

/// Measures the six sides of a foot, and a turn about each of its axes.
pub(super) fn measure(client: &mut Client, person: &mut Person) -> StepFigures {
    let (patience, tell, has_left) = person.parts();
    tell("put the foot on each of its six sides, and let go of it for a second on each");
    let mut progress = SidesProgress::default();
    let mut has_asked = false;
    watch(client, has_left, patience, |moment| {
        let Moment::Motion(motion) = moment else {
            return None;
        };
        if let Some(news) = progress.take(motion) {
            tell(&news);
        }
        let has_all_sides = progress.sides.iter().all(Option::is_some);
        if has_all_sides && !progress.is_complete() && !has_asked {
            has_asked = true;
            let axes = progress.missing_turns();
            tell(&format!("turn the foot by a quarter about {axes}, and put it down"));
        }
        progress.is_complete().then_some(())
    })?;
    Ok(figures(&progress, patience))
}

fn figures(progress: &SidesProgress, patience: Duration) -> Vec<Figure> {
    let forces = || progress.sides.iter().flatten().copied();
    let mut figures = vec![figure::SIDES.counted(forces().count())];
    if forces().count() == 0 {
        let reason = format!("the foot was on no side within {} s", patience.as_secs());
        return AcceptStep::Sides.failed(&reason);
    }
    figures.extend([
        figure::SIDE_LEAST.measured(forces().fold(f64::INFINITY, f64::min)),
        figure::SIDE_MOST.measured(forces().fold(0.0, f64::max)),
    ]);
    let limits = [&figure::TURN_X, &figure::TURN_Y, &figure::TURN_Z];
    for (limit, turn) in limits.into_iter().zip(progress.turns) {
        figures.push(match turn {
            Some(error) => limit.measured(error),
            None => limit.failed("no turn of more than 45°"),
        });
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    /// Motions of a foot at rest for 1 s, turned by 90° about an axis in 1 s, and at rest again.
    fn quarter_about(
        axis: usize,
        gain: f64,
        from_ms: u64,
        begin: Rotation,
    ) -> (Vec<FootMotion>, Rotation) {
        let angle = core::f64::consts::FRAC_PI_2;
        let mut about = [0.0; 3];
        about[axis] = 1.0;
        let about = Vector::from_array(about);
        let mut orientation = begin;
        let motions = (0..3000).step_by(10).map(|ms| {
            let rate = if (1000..2000).contains(&ms) { angle } else { 0.0 };
            orientation = orientation.after(turn(about * (rate * 0.01)));
            FootMotion {
                at: Timestamp::from_micros(1000 * (from_ms + ms)),
                force: orientation.to_sensor(Vector::new(0.0, 0.0, 9.81)),
                rate: about * (rate * gain),
                ..FootMotion::default()
            }
        });
        (motions.collect(), orientation)
    }

    fn turned(gains: [f64; 3]) -> SidesProgress {
        let mut progress = SidesProgress::default();
        let mut orientation = Rotation { w: 1.0, v: Vector::default() };
        let mut at_ms = 0;
        for axis in [0, 2, 1, 1, 1, 2, 0] {
            let motions;
            (motions, orientation) = quarter_about(axis, gains[axis], at_ms, orientation);
            at_ms += 3000;
            for motion in motions {
                progress.take(motion);
            }
        }
        progress
    }

    #[test]
    fn six_sides_and_three_turns_complete_the_step() {
        let progress = turned([1.0; 3]);
        assert!(progress.is_complete(), "{:?}", progress.sides);
        for figure in figures(&progress, Duration::ZERO) {
            assert_eq!(figure.verdict(), figure::Verdict::Pass, "{figure:?}");
        }
    }

    #[test]
    fn axis_with_a_wrong_sign_or_scale_is_named() {
        for (axis, gain) in [(0, -1.0), (1, 1.3), (2, 0.5)] {
            let mut gains = [1.0; 3];
            gains[axis] = gain;
            let progress = turned(gains);
            for (other, turn) in progress.turns.iter().enumerate() {
                let is_out = turn.is_some_and(|error| error > figure::TURN_X.highest);
                assert_eq!(is_out, other == axis, "{axis} {gain} {:?}", progress.turns);
            }
        }
    }
}
