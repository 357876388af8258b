"""Arrays in the form that the Rust part reads: float32 or float64, in native byte order."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def floats(values: npt.ArrayLike) -> npt.NDArray[np.floating]:
    """Returns an array of floats: the given one if it can be read in place, otherwise a copy. Missing values
    become NaN."""
    missing = np.ma.getmaskarray(values) if np.ma.isMaskedArray(values) else None
    array = np.asarray(values)
    if array.dtype == object:
        array = np.array([_float(value) for value in array.flat]).reshape(array.shape)
    if array.dtype not in (np.float32, np.float64):
        array = array.astype(np.float64)
    if missing is not None and missing.any():
        array = np.where(missing, array.dtype.type(np.nan), array)
    # The Rust part counts strides in elements; fields of packed records lie between them.
    is_readable = array.flags.aligned and all(step % array.itemsize == 0 for step in array.strides)
    return array if is_readable else array.copy()


def times(values: npt.ArrayLike) -> npt.NDArray[np.floating]:
    """Returns times in s: floats unchanged, ``datetime64`` of any unit and time zone as s since 1970."""
    if str(getattr(values, "dtype", "")).startswith("datetime64"):
        nanoseconds = np.asarray(values, dtype="datetime64[ns]")
        seconds = nanoseconds.astype(np.int64) / 1.0e9
        return np.where(np.isnat(nanoseconds), np.nan, seconds)
    return floats(values)


def _float(value: Any) -> float:
    """Converts an object to a number; a missing value becomes NaN."""
    is_missing = value is None or type(value).__name__ in ("NAType", "NaTType")
    return float("nan") if is_missing else float(value)
