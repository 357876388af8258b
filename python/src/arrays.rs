//! Arrays: arguments as they lie in memory, f32 or f64 of any layout, and tables that Python then owns.

use numpy::ndarray::{Array2, ArrayView, Dimension, Ix1, Ix2};
use numpy::{PyReadonlyArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// An argument that is an array of f32 or f64.
pub(crate) enum Numbers<'py, D: Dimension> {
    Single(PyReadonlyArray<'py, f32, D>),
    Double(PyReadonlyArray<'py, f64, D>),
}

/// View of such an array, for use without the interpreter lock.
pub(crate) enum View<'a, D: Dimension> {
    Single(ArrayView<'a, f32, D>),
    Double(ArrayView<'a, f64, D>),
}

impl<'py, D: Dimension> Numbers<'py, D> {
    fn read(name: &str, value: &Bound<'py, PyAny>, shape: &str) -> PyResult<Self> {
        let single = value.extract().map(Self::Single);
        let either = single.or_else(|_| value.extract().map(Self::Double));
        either.map_err(|_| {
            PyTypeError::new_err(format!(
                "{name} must be an array of float32 or float64 of shape {shape}"
            ))
        })
    }

    fn shape(&self) -> &[usize] {
        match self {
            Self::Single(array) => array.shape(),
            Self::Double(array) => array.shape(),
        }
    }

    /// Returns the number of samples.
    pub(crate) fn len(&self) -> usize {
        self.shape().first().copied().unwrap_or(0)
    }

    pub(crate) fn view(&self) -> View<'_, D> {
        match self {
            Self::Single(array) => View::Single(array.as_array()),
            Self::Double(array) => View::Double(array.as_array()),
        }
    }
}

impl<'py> Numbers<'py, Ix2> {
    /// Reads an argument of three readings per sample.
    pub(crate) fn triples(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let readings = Self::read(name, value, "(samples, 3)")?;
        match readings.shape() {
            [_, 3] => Ok(readings),
            shape => Err(PyValueError::new_err(format!(
                "{name} has the shape {shape:?}, but (samples, 3) is expected"
            ))),
        }
    }
}

impl<'py> Numbers<'py, Ix1> {
    /// Reads an argument of one number per sample.
    pub(crate) fn column(name: &str, value: &Bound<'py, PyAny>, samples: usize) -> PyResult<Self> {
        let numbers = Self::read(name, value, "(samples,)")?;
        match numbers.len() {
            len if len == samples => Ok(numbers),
            len => Err(PyValueError::new_err(format!(
                "{name} has {len} values, but acc has {samples} samples"
            ))),
        }
    }
}

impl View<'_, Ix2> {
    /// Returns the three readings of a sample.
    pub(crate) fn at(&self, sample: usize) -> [f64; 3] {
        match self {
            Self::Single(array) => [0, 1, 2].map(|axis| f64::from(array[[sample, axis]])),
            Self::Double(array) => [0, 1, 2].map(|axis| array[[sample, axis]]),
        }
    }
}

impl View<'_, Ix1> {
    pub(crate) fn at(&self, sample: usize) -> f64 {
        match self {
            Self::Single(array) => f64::from(array[sample]),
            Self::Double(array) => array[sample],
        }
    }
}

/// Returns a table with rows of `width` numbers.
pub(crate) fn table<T: Default>(numbers: Vec<T>, width: usize) -> Array2<T> {
    let rows = numbers.len() / width;
    // Numbers are appended by rows, so none are left over.
    Array2::from_shape_vec((rows, width), numbers).unwrap_or_default()
}
