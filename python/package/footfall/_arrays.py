"""Arrays in the form that the Rust part reads: float32 or float64, in native byte order."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._footfall import VALIDITIES


def floats(name: str, values: npt.ArrayLike) -> npt.NDArray[np.floating]:
    """Returns an array of floats: the given one if it can be read in place, otherwise a copy. Missing values
    become NaN. A ``TypeError`` names the argument."""
    missing = np.ma.getmaskarray(values) if np.ma.isMaskedArray(values) else None
    try:
        array = np.asarray(values)
        if array.dtype == object:
            array = np.array([_float(value) for value in array.flat]).reshape(array.shape)
        if array.dtype not in (np.float32, np.float64):
            array = array.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name} is not an array of numbers") from error
    if missing is not None and missing.any():
        array = np.where(missing, array.dtype.type(np.nan), array)
    # The Rust part counts strides in elements; fields of packed records lie between them.
    is_readable = array.flags.aligned and all(step % array.itemsize == 0 for step in array.strides)
    return array if is_readable else array.copy()


def times(name: str, values: npt.ArrayLike) -> npt.NDArray[np.floating]:
    """Returns times in s: floats unchanged, ``datetime64`` of any unit and time zone as s since 1970."""
    if str(getattr(values, "dtype", "")).startswith("datetime64"):
        nanoseconds = np.asarray(values, dtype="datetime64[ns]")
        seconds = nanoseconds.astype(np.int64) / 1.0e9
        return np.where(np.isnat(nanoseconds), np.nan, seconds)
    return floats(name, values)


def validities(values: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Returns validities as ``uint8``. Raises ``ValueError`` if a number is not a validity, and ``TypeError`` if the
    array is not numeric."""
    array = np.asarray(values)
    if array.dtype.kind not in "buif":
        raise TypeError(f"validity is an array of {array.dtype}, but numbers are expected")
    is_known = np.isin(array, np.arange(len(VALIDITIES)))
    if not is_known.all():
        sample = int(np.argmin(is_known))
        raise ValueError(
            f"validity[{sample}] is {array.flat[sample]}, but 0 to {len(VALIDITIES) - 1} are expected: "
            f"{', '.join(VALIDITIES)}"
        )
    return np.ascontiguousarray(array, dtype=np.uint8)


def _float(value: Any) -> float:
    """Converts an object to a number; a missing value becomes NaN."""
    is_missing = value is None or type(value).__name__ in ("NAType", "NaTType")
    return float("nan") if is_missing else float(value)
