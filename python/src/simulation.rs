//! A simulated foot: its recording and the truth about it.

use std::ops::RangeInclusive;

use gait::{Activity, Ground, Plan, Rests, RobotParams, SensorParams, Simulation, Temperature};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recordings::input::{About, Format};
use recordings::samples::RecordedSample;

use crate::arrays::table;
use crate::parameters::value_error;
use crate::reading::RecordingColumns;

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
            step_length: within("step_length", self.step_length, 0.1..=3.0)?,
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
    let (recording, (touch_downs, slips)) = py.detach(|| {
        let simulation = gait::simulate(&plan, &sensor, walk.seed);
        let truth = truth(&simulation);
        (simulation.recording, truth)
    });
    let mut columns = RecordingColumns::with_capacity(recording.samples.len());
    for sample in &recording.samples {
        columns.push(sample, 0);
    }
    let about = About::new(recording.name, recording.sample_rate, recording.gravity);
    let dict = columns.into_dict(py, about, Format::Csv)?;
    dict.set_item("touch_downs", touch_downs.into_pyarray(py))?;
    dict.set_item("slips", table::<f64>(slips, 2).into_pyarray(py))?;
    Ok(dict)
}

/// Returns the times of the touch-downs of a simulated walk, and the starts and ends of its slips, s.
fn truth(simulation: &Simulation) -> (Vec<f64>, Vec<f64>) {
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
