//! A simulated foot, or a robot of four: recordings and the truth about them.

use std::ops::RangeInclusive;

use estimator_core::ImuSample;
use gait::quadruped::{FEET, LONGEST_STEP, Leg, ShortBout};
use gait::{
    Activity, FootState, Ground, Plan, Quadruped, Rests, RobotParams, SensorParams, Simulation,
    Temperature,
};
use numpy::IntoPyArray;
use options::Format;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use samples::RecordedSample;
use samples::space::components;
use stored::About;

use crate::arrays::table;
use crate::reading::RecordingColumns;
use crate::words::value_error;

/// The longest walk, s.
const LONGEST_S: f64 = 86_400.0;

/// Time constant of the warming of a sensor, s.
const WARMING_S: f64 = 180.0;

/// Name of the walk of `footfall demo`, which has its own duration and ground.
const DEMO: &str = "demo";

/// Arguments of `footfall.simulate`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Walk {
    gait: String,
    seconds: f64,
    seed: u64,
    ground: String,
    greased: f64,
    step_length: f64,
    shaking: f64,
    /// Durations of walking and of standing, by turns, s.
    rests: Option<(f64, f64)>,
    /// °C.
    warming: f64,
    /// rad/s².
    gyro_drift: [f64; 3],
}

/// Checks that the value of an argument is in its range.
fn within(name: &str, value: f64, range: RangeInclusive<f64>) -> PyResult<f64> {
    if range.contains(&value) {
        return Ok(value);
    }
    let (least, greatest) = range.into_inner();
    Err(value_error(format!("{name} is {value}, but {least} to {greatest} is expected")))
}

fn rests((every, lasting): (f64, f64)) -> PyResult<Rests> {
    Ok(Rests {
        every: within("rests[0]", every, 0.1..=LONGEST_S)?,
        lasting: within("rests[1]", lasting, 0.0..=LONGEST_S)?,
    })
}

impl Walk {
    fn plan(&self) -> PyResult<Plan> {
        let seconds = within("seconds", self.seconds, 0.001..=LONGEST_S)?;
        match self.gait.as_str() {
            DEMO => Ok(Plan::demo(self.seed)),
            _ => Ok(self.robot()?.plan(seconds, self.seed)),
        }
    }

    fn robot(&self) -> PyResult<RobotParams> {
        let mut grounds = Ground::ALL.into_iter();
        let ground = grounds.find(|known| known.name() == self.ground);
        Ok(RobotParams {
            gait: self.gait.parse().map_err(value_error)?,
            ground: ground.ok_or_else(|| {
                let known = Ground::ALL.map(Ground::name).join(", ");
                let ground = &self.ground;
                value_error(format!("ground is {ground:?}, but one of {known} is expected"))
            })?,
            greased: within("greased", self.greased, 0.0..=1.0)?,
            step_length: within("step_length", self.step_length, 0.1..=LONGEST_STEP)?,
            shaking: within("shaking", self.shaking, 0.0..=10.0)?,
            rests: self.rests.map(rests).transpose()?,
        })
    }

    fn sensor(&self) -> PyResult<SensorParams> {
        let [x, y, z] = self.gyro_drift;
        for drift in [x, y, z] {
            within("gyro_drift", drift, -1.0..=1.0)?;
        }
        let cold = 25.0;
        Ok(SensorParams {
            temperature: match within("warming", self.warming, 0.0..=60.0)? {
                0.0 => Temperature::Constant(cold),
                warming => Temperature::Warming {
                    from: cold,
                    to: cold + warming,
                    time_constant: WARMING_S,
                },
            },
            gyroscope_drift: [x, y, z],
            ..SensorParams::LSM6DSOX
        })
    }
}

/// Simulates a foot with a sensor of its own; see `footfall.simulate`.
#[pyfunction]
pub(crate) fn simulate<'py>(py: Python<'py>, walk: Walk) -> PyResult<Bound<'py, PyDict>> {
    let plan = walk.plan()?;
    let sensor = walk.sensor()?;
    let simulation = py.detach(|| gait::simulate(&plan, &sensor, walk.seed));
    foot_dict(py, simulation)
}

/// Simulates a robot of four feet; see `footfall.simulate_robot`.
#[pyfunction]
pub(crate) fn simulate_robot<'py>(py: Python<'py>, walk: Walk) -> PyResult<Bound<'py, PyDict>> {
    let params = walk.robot()?;
    let seconds = within("seconds", walk.seconds, 0.001..=LONGEST_S)?;
    let sensor = walk.sensor()?;
    let robot = py.detach(|| Quadruped::new(&params, seconds, walk.seed));
    let robot = robot.map_err(|ShortBout { every, shortest }| {
        let gait = params.gait;
        value_error(format!(
            "rests[0] is {every}, but at least {shortest} is expected of a robot in the gait {gait}"
        ))
    })?;
    let (feet, base) = py.detach(|| {
        let feet: Vec<Simulation> =
            (0..FEET.len()).map(|leg| robot.record_foot(leg, &sensor)).collect();
        (feet, robot.record_base(&sensor))
    });
    let times_s: Vec<f64> = base.iter().map(time_s).collect();
    let dict = PyDict::new(py);
    let legs = PyDict::new(py);
    for ((leg, foot), simulation) in FEET.into_iter().enumerate().zip(feet) {
        let joints = times_s.iter().map(|t| robot.joints_at(leg, *t));
        let (angles, rates): (Vec<_>, Vec<_>) = joints.map(|j| (j.angles, j.rates)).unzip();
        let Leg { hip, offset, thigh, shank } = Leg::GO1[leg];
        let parts = PyDict::new(py);
        parts.set_item("foot", foot_dict(py, simulation)?)?;
        parts.set_item("geometry", (hip.to_array(), offset, thigh, shank))?;
        parts.set_item(
            "angles",
            table(angles.into_iter().flatten().collect(), 3).into_pyarray(py),
        )?;
        parts
            .set_item("rates", table(rates.into_iter().flatten().collect(), 3).into_pyarray(py))?;
        legs.set_item(foot.name(), parts)?;
    }
    dict.set_item("legs", legs)?;
    dict.set_item("base", base_dict(py, &robot, &base, times_s)?)?;
    Ok(dict)
}

/// Returns the arrays of the base by the names of `footfall.Base`.
fn base_dict<'py>(
    py: Python<'py>,
    robot: &Quadruped,
    samples: &[ImuSample],
    times_s: Vec<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let states: Vec<_> = times_s.iter().map(|t| robot.base_at(*t)).collect();
    let force = samples.iter().flat_map(|sample| components(sample.specific_force.0));
    let rate = samples.iter().flat_map(|sample| components(sample.angular_rate.0));
    let position = states.iter().flat_map(|state| state.position.to_array());
    let velocity = states.iter().flat_map(|state| state.velocity.to_array());
    let quaternion = states.iter().flat_map(|state| {
        let [x, y, z] = state.orientation.v.to_array();
        [state.orientation.w, x, y, z]
    });
    let dict = PyDict::new(py);
    dict.set_item("t", times_s.into_pyarray(py))?;
    dict.set_item("acc", table(force.collect(), 3).into_pyarray(py))?;
    dict.set_item("gyr", table(rate.collect(), 3).into_pyarray(py))?;
    dict.set_item("position", table(position.collect(), 3).into_pyarray(py))?;
    dict.set_item("velocity", table(velocity.collect(), 3).into_pyarray(py))?;
    dict.set_item("quaternion", table(quaternion.collect(), 4).into_pyarray(py))?;
    Ok(dict)
}

/// Returns the arrays of a simulated foot by the names of `footfall.Simulation`.
fn foot_dict(py: Python<'_>, simulation: Simulation) -> PyResult<Bound<'_, PyDict>> {
    let (touch_downs, slips) = changes(&simulation);
    let Simulation { recording, truth, .. } = simulation;
    let mut columns = RecordingColumns::with_capacity(recording.samples.len());
    for sample in &recording.samples {
        columns.push(sample, 0);
    }
    let about = About::new(recording.name, recording.sample_rate, recording.gravity);
    let dict = columns.into_dict(py, about, Format::Csv)?;
    dict.set_item("touch_downs", touch_downs.into_pyarray(py))?;
    dict.set_item("slips", table::<f64>(slips, 2).into_pyarray(py))?;
    let set = |name: &str, of: fn(&FootState) -> [f64; 3]| {
        dict.set_item(name, table(truth.iter().flat_map(of).collect(), 3).into_pyarray(py))
    };
    set("position", |state| state.position.to_array())?;
    set("velocity", |state| state.velocity.to_array())?;
    Ok(dict)
}

/// Returns the time of a sample, s.
fn time_s(sample: &ImuSample) -> f64 {
    sample.timestamp.as_micros() as f64 * 1e-6
}

/// Returns the times of the touch-downs of a simulated walk, and the starts and ends of its slips, s.
fn changes(simulation: &Simulation) -> (Vec<f64>, Vec<f64>) {
    let times_s = simulation.recording.samples.iter().map(RecordedSample::time_s);
    let activities = simulation.truth.iter().map(|state| state.activity);
    let states: Vec<(f64, Activity)> = times_s.zip(activities).collect();
    let turns = || states.windows(2).map(|pair| (pair[0], pair[1]));
    let touch_downs = turns().filter(|((_, before), (_, after))| {
        *before == Activity::Swinging && *after != Activity::Swinging
    });
    let slips =
        states.chunk_by(|(_, one), (_, other)| one == other).filter_map(|stretch| match stretch {
            [(first, Activity::Slipping), .., (last, _)] => Some([*first, *last]),
            _ => None,
        });
    (touch_downs.map(|(_, (time, _))| time).collect(), slips.flatten().collect())
}
