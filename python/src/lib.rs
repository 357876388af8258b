//! Rust part of the Python package `footfall`: the program's libraries on numpy arrays. The Python part, `footfall/*.py`,
//! is the interface for users, with its documentation.
//!
//! | content | module |
//! |---|---|
//! | arrays as arguments, without a copy | [`arrays`] |
//! | parameters from preset, configuration and arguments | [`parameters`] |
//! | estimates of a foot, and their result as arrays | [`result`] |
//! | estimate and calibration of recordings in arrays | [`estimate`] |
//! | estimate sample by sample | [`stream`] |
//! | files as arrays or estimates | [`reading`] |
//! | decoded output of feet | [`decoding`] |
//! | simulated foot, and robot of four | [`simulation`] |
//! | default method with other constants, for research | [`constants`] |
//! | settings in errors, in words of Python | [`words`] |

// Arguments from Python are owned values even if a reference would do.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod constants;
mod decoding;
mod estimate;
mod parameters;
mod reading;
mod result;
mod simulation;
mod stream;
mod words;

use pyo3::prelude::*;

/// The module `footfall._footfall`.
#[pymodule]
mod _footfall {
    #[pymodule_export]
    use super::constants::{constants, p_stable};
    #[pymodule_export]
    use super::decoding::decode_file;
    #[pymodule_export]
    use super::estimate::{calibrate, estimate};
    #[pymodule_export]
    use super::parameters::toml_of;
    #[pymodule_export]
    use super::reading::{estimate_file, read};
    #[pymodule_export]
    use super::simulation::{simulate, simulate_robot};
    #[pymodule_export]
    use super::stream::Estimator;

    use estimator_core::{Axis, Flag, Phase};
    use pyo3::prelude::*;
    use samples::VALIDITIES;

    /// Adds the names that Python code needs, in the order of their codes.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        let features = [("bags", cfg!(feature = "bags")), ("parquet", cfg!(feature = "parquet"))];
        let built = features.into_iter().filter(|(_, is_built)| *is_built);
        module.add("FEATURES", built.map(|(name, _)| name).collect::<Vec<_>>())?;
        module.add("STATES", Phase::ALL.map(Phase::name).to_vec())?;
        module.add("FLAGS", Flag::ALL.map(Flag::name).to_vec())?;
        module.add("SENT_FLAGS", super::decoding::flag_names().to_vec())?;
        let validities = VALIDITIES.map(|(name, _)| name);
        module.add("VALIDITIES", validities.to_vec())?;
        module.add("AXES", Axis::ALL.map(Axis::name).to_vec())
    }
}
