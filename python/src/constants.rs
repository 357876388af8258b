//! Default method with other constants, for the research that selects them.

use estimator_core::params::Constants;
use estimator_core::{AngularRate, Gravity, ImuSample, Params, SpecificForce, Timestamp, Vec3};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use recordings::estimate::Estimator;
use recordings::samples::{RecordedSample, steady_time};

use crate::parameters::value_error;

/// Defines access to the constants by their names.
macro_rules! by_name {
    ($($name:ident)+) => {
        fn all(of: &Constants) -> Vec<(&'static str, f32)> {
            vec![$((stringify!($name), of.$name)),+]
        }

        fn set(of: &mut Constants, name: &str, value: f32) -> PyResult<()> {
            match name {
                $(stringify!($name) => of.$name = value,)+
                _ => return Err(value_error(format!("{name} is not a constant"))),
            }
            Ok(())
        }
    };
}

by_name! {
    noise still moving part_of_the_way bandwidth window prior memory stance lesson turn_noise
    turn_still turn_moving turn_part turn_weight turn_clip turn_settled
    slide_acceleration slide_speed slide_factor slide_lever rest_acceleration
    rest_acceleration_change rest_rate rest_rate_change landing leftover evidence
}

/// Returns the constants of the default method by their names.
#[pyfunction]
pub(crate) fn constants() -> Vec<(&'static str, f32)> {
    all(&Constants::DEFAULT)
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
        set(&mut constants, &name, value)?;
    }
    let params = Params { constants, ..Params::DEFAULT };
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
