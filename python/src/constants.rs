//! Default method with other constants, for the research that selects them.

use estimator_core::params::Constants;
use estimator_core::{
    AngularRate, Gravity, ImuSample, Params, ParamsError, SpecificForce, Timestamp, Vec3,
};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use samples::estimate::Estimator;
use samples::{RecordedSample, steady_time};

use crate::words::value_error;

/// Returns the constants of the default method by their names.
#[pyfunction]
pub(crate) fn constants() -> Vec<(&'static str, f32)> {
    Constants::DEFAULT.iter().collect()
}

/// Returns the probabilities of stable contact of a recording, with these constants in place of the default ones.
#[pyfunction]
pub(crate) fn p_stable<'py>(
    py: Python<'py>,
    acc: PyReadonlyArray2<'py, f32>,
    gyr: PyReadonlyArray2<'py, f32>,
    rate: f32,
    gravity_removed: bool,
    changed: Vec<(String, f32)>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let mut constants = Constants::DEFAULT;
    for (name, value) in changed {
        constants = constants.with(&name, value).map_err(|error| match error {
            ParamsError::UnknownConstant => value_error(format!("{name} is not a constant")),
            other => value_error(other),
        })?;
    }
    let params = Params { constants, ..Params::DEFAULT }.into();
    let gravity = if gravity_removed { Gravity::Removed } else { Gravity::Included };
    let mut estimator = Estimator::new(rate, gravity, &params).map_err(value_error)?;
    let (acc, gyr) = (acc.as_array(), gyr.as_array());
    let vector = |row: &[f32]| match *row {
        [x, y, z] => Ok(Vec3::new(x, y, z)),
        _ => Err(value_error("acc and gyr have three columns")),
    };
    let rows = acc.rows().into_iter().zip(gyr.rows());
    let p = rows.enumerate().map(|(k, (acc, gyr))| {
        let sample = RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(steady_time(k, rate).as_micros()),
                specific_force: SpecificForce(vector(&acc.to_vec())?),
                angular_rate: AngularRate(vector(&gyr.to_vec())?),
                ..ImuSample::default()
            },
            load: None,
            label: None,
        };
        Ok(estimator.update(&sample).probabilities.stable)
    });
    Ok(p.collect::<PyResult<Vec<f32>>>()?.into_pyarray(py))
}
