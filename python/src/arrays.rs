//! Arrays in, as they lie in memory: f32 or f64, of any layout.

use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Three readings per sample.
pub(crate) enum Readings<'py> {
    Single(PyReadonlyArray2<'py, f32>),
    Double(PyReadonlyArray2<'py, f64>),
}

/// The same while no Python code runs.
#[derive(Clone, Copy)]
pub(crate) enum ReadingsView<'a> {
    Single(ArrayView2<'a, f32>),
    Double(ArrayView2<'a, f64>),
}

impl<'py> Readings<'py> {
    /// An argument of shape (samples, 3).
    pub(crate) fn of(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let (readings, shape) = if let Ok(array) = value.extract::<PyReadonlyArray2<'py, f32>>() {
            let shape = array.shape().to_vec();
            (Self::Single(array), shape)
        } else if let Ok(array) = value.extract::<PyReadonlyArray2<'py, f64>>() {
            let shape = array.shape().to_vec();
            (Self::Double(array), shape)
        } else {
            return Err(PyTypeError::new_err(format!(
                "{name} must be an array of float32 or float64 of shape (samples, 3)"
            )));
        };
        if shape.get(1) != Some(&3) {
            return Err(PyValueError::new_err(format!(
                "{name} has the shape {shape:?}, but (samples, 3) is expected"
            )));
        }
        Ok(readings)
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Single(array) => array.shape()[0],
            Self::Double(array) => array.shape()[0],
        }
    }

    pub(crate) fn view(&self) -> ReadingsView<'_> {
        match self {
            Self::Single(array) => ReadingsView::Single(array.as_array()),
            Self::Double(array) => ReadingsView::Double(array.as_array()),
        }
    }
}

impl ReadingsView<'_> {
    /// The three readings of a sample, rounded to f32 as the program rounds those of a file.
    pub(crate) fn at(&self, sample: usize) -> [f32; 3] {
        match self {
            Self::Single(array) => [0, 1, 2].map(|axis| array[[sample, axis]]),
            Self::Double(array) => [0, 1, 2].map(|axis| array[[sample, axis]] as f32),
        }
    }
}

/// One number per sample.
pub(crate) enum Numbers<'py> {
    Single(PyReadonlyArray1<'py, f32>),
    Double(PyReadonlyArray1<'py, f64>),
}

/// The same while no Python code runs.
#[derive(Clone, Copy)]
pub(crate) enum NumbersView<'a> {
    Single(ArrayView1<'a, f32>),
    Double(ArrayView1<'a, f64>),
}

impl<'py> Numbers<'py> {
    /// An argument of `expected` numbers.
    pub(crate) fn of(name: &str, value: &Bound<'py, PyAny>, expected: usize) -> PyResult<Self> {
        let (numbers, len) = if let Ok(array) = value.extract::<PyReadonlyArray1<'py, f64>>() {
            let len = array.len();
            (Self::Double(array), len)
        } else if let Ok(array) = value.extract::<PyReadonlyArray1<'py, f32>>() {
            let len = array.len();
            (Self::Single(array), len)
        } else {
            return Err(PyTypeError::new_err(format!(
                "{name} must be an array of float64 or float32 of shape (samples,)"
            )));
        };
        if len != expected {
            return Err(PyValueError::new_err(format!(
                "{name} has {len} values, but acc has {expected} samples"
            )));
        }
        Ok(numbers)
    }

    pub(crate) fn view(&self) -> NumbersView<'_> {
        match self {
            Self::Single(array) => NumbersView::Single(array.as_array()),
            Self::Double(array) => NumbersView::Double(array.as_array()),
        }
    }
}

impl NumbersView<'_> {
    pub(crate) fn at(&self, sample: usize) -> f64 {
        match self {
            Self::Single(array) => f64::from(array[sample]),
            Self::Double(array) => array[sample],
        }
    }
}
