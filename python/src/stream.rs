//! Estimate sample by sample, for streams.

use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Phase, Quaternion, Timestamp, Vec3,
};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use replay::events::{ContactEvent, Events};
use samples::estimate;
use samples::space::components;
use samples::{RecordedSample, finite_load, imu_sample, steady_time};

use crate::estimate::{micros, readings, validity_at};
use crate::parameters::{Settings, SettingsArguments};
use crate::result::{EventRow, event_row};
use crate::words::value_error;

/// The estimator of one foot; see `footfall.Estimator`.
#[derive(Clone)]
#[pyclass(module = "footfall._footfall")]
pub(crate) struct Estimator {
    settings: Settings,
    state: State,
}

/// State that changes with each sample.
#[derive(Clone)]
struct State {
    estimator: estimate::Estimator,
    events: Events,
    /// Time of the first sample on the caller's clock, µs.
    start_us: Option<i64>,
    /// Time of the newest sample on the caller's clock, µs; `None` before the first.
    newest_us: Option<i64>,
    /// Newest time that was passed, µs; 0 before the first.
    passed_us: i64,
    /// Number of samples since that time, including its own.
    since_passed: usize,
    rate: f32,
}

/// One estimate. In Python it is a tuple of these fields, in the order of `footfall.Estimate`.
struct EstimateRow {
    /// Time on the caller's clock, s.
    t: f64,
    /// Probability of stable contact, of no motion along the ground, and of no lifting.
    probabilities: (f32, f32, f32),
    axes: [f32; 6],
    /// Quaternion w, x, y, z.
    orientation: [f32; 4],
    linear_acceleration: [f32; 3],
    velocity_sigma: f32,
    state: (&'static str, bool, Vec<&'static str>),
}

impl<'py> IntoPyObject<'py> for EstimateRow {
    type Target = PyTuple;
    type Output = Bound<'py, PyTuple>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let Self {
            t,
            probabilities,
            axes,
            orientation,
            linear_acceleration,
            velocity_sigma,
            state,
        } = self;
        (t, probabilities, axes, orientation, linear_acceleration, velocity_sigma, state)
            .into_pyobject(py)
    }
}

#[pymethods]
impl Estimator {
    #[new]
    fn new(settings: SettingsArguments) -> PyResult<Self> {
        let settings = settings.read()?.of_unnamed_foot()?;
        let rate = settings.input_options.sample_rate;
        let rate = rate.ok_or_else(|| value_error("give the sample rate in Hz as rate"))?;
        let estimator = estimate::Estimator::new(rate, settings.gravity(), &settings.params());
        let estimator = estimator.map_err(|error| value_error(format!("parameter {error}")))?;
        let state = State {
            estimator,
            events: Events::default(),
            start_us: None,
            newest_us: None,
            passed_us: 0,
            since_passed: 0,
            rate,
        };
        Ok(Self { settings, state })
    }

    /// Returns the estimate of the next sample.
    #[pyo3(signature = (acc, gyr, t, load, validity))]
    fn update(
        &mut self,
        acc: [f64; 3],
        gyr: [f64; 3],
        t: Option<f64>,
        load: Option<f64>,
        validity: u8,
    ) -> PyResult<EstimateRow> {
        let validity = validity_at(validity)
            .ok_or_else(|| value_error(format!("validity {validity} is not known")))?;
        // Periods are counted from the newest passed time, because a sum of rounded periods drifts.
        let (passed_us, since_passed) = match t {
            Some(time) => (micros("t", time)?, 0),
            None => (self.state.passed_us, self.state.since_passed),
        };
        let steady = steady_time(since_passed, self.state.rate).as_micros();
        let now_us = passed_us.saturating_add_unsigned(steady);
        if let Some(newest_us) = self.state.newest_us
            && now_us <= newest_us
        {
            let [now_s, before_s] = [now_us, newest_us].map(|us| us as f64 / 1.0e6);
            return Err(value_error(format!(
                "t is {now_s} s, which does not come after {before_s} s, the time before"
            )));
        }
        let start_us = *self.state.start_us.get_or_insert(now_us);
        self.state.newest_us = Some(now_us);
        (self.state.passed_us, self.state.since_passed) = (passed_us, since_passed + 1);
        let timestamp = Timestamp::from_micros(now_us.abs_diff(start_us));
        let correction = &self.settings.input_options.correction;
        let readings = self.settings.input_options.table.to_si(readings(acc, gyr));
        let measured = imu_sample(timestamp, readings, validity);
        let sample = RecordedSample {
            imu: correction.corrected(measured),
            load: load.and_then(finite_load),
            label: None,
        };
        let estimate = self.state.estimator.update(&sample);
        self.state.events.add(&estimate);
        Ok(EstimateRow::of(&estimate, now_us))
    }

    /// Times of `count` samples that were read at once, oldest first, on the caller's clock; s.
    fn batch_times(&self, t: f64, count: usize) -> PyResult<Vec<f64>> {
        const FIRST: Timestamp = Timestamp::from_micros(1 << 62);
        let newest_us = micros("t", t)?;
        // Before the first sample, and if the clock was set back, any time gives the same steps.
        let since_start = self.state.start_us.and_then(|start_us| {
            Some(Timestamp::from_micros(u64::try_from(newest_us.checked_sub(start_us)?).ok()?))
        });
        let newest = since_start.unwrap_or(FIRST);
        let times = self.state.estimator.batch_timestamps(newest, count).map(|time| {
            let earlier_us = newest.micros_since(time).unwrap_or(0);
            newest_us.saturating_sub_unsigned(earlier_us) as f64 / 1.0e6
        });
        Ok(times.collect())
    }

    /// Mean size of the force in the last half second, m/s², if no foot can have it.
    fn implausible_force(&self) -> Option<f32> {
        self.state.estimator.implausible_force()
    }

    /// Returns events that were not returned before, touch-downs at once; all remaining ones if the stream has ended.
    fn events(&mut self, ended: bool) -> Vec<EventRow> {
        if !ended {
            self.state.events.release();
        }
        let start_us = self.state.start_us.unwrap_or(0);
        let mut found: Vec<ContactEvent> = std::iter::from_fn(|| self.state.events.pop()).collect();
        if ended {
            found.extend(std::mem::take(&mut self.state.events).finish());
        }
        let found = found.iter();
        found.map(|event| event_row(event, start_us)).collect()
    }

    /// Returns another estimator in the same state.
    fn copy(&self) -> Self {
        self.clone()
    }

    /// Bias of the gyroscope at the newest sample, rad/s.
    fn gyro_bias(&self) -> Option<(f32, f32, f32)> {
        let AngularRate(Vec3 { x, y, z }) = self.state.estimator.gyro_bias()?;
        Some((x, y, z))
    }

    /// State learnt from all samples.
    fn learnt(&self) -> Vec<f32> {
        self.state.estimator.learnt().to_array().to_vec()
    }
}

impl EstimateRow {
    fn of(estimate: &ContactEstimate, now_us: i64) -> Self {
        let p = estimate.probabilities;
        let Quaternion { w, x, y, z } = estimate.orientation;
        Self {
            t: now_us as f64 / 1.0e6,
            probabilities: (p.stable, p.tangential, p.vertical),
            axes: p.axes.to_array(),
            orientation: [w, x, y, z],
            linear_acceleration: components(estimate.linear_acceleration.0),
            velocity_sigma: estimate.velocity_sigma.0,
            state: (
                Phase::name(estimate.phase),
                estimate.decision == Decision::Stable,
                estimate.flags.iter().map(Flag::name).collect(),
            ),
        }
    }
}
