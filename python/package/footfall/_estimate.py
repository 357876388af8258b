"""Probabilities of a whole recording: one that is in arrays, or those of a file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from . import _footfall
from ._arrays import floats, times
from ._result import Result
from ._settings import (
    Config,
    Gravity,
    Preset,
    RecordingDict,
    Times,
    TimeUnit,
    read_options,
    settings,
)
from ._words import arguments_in_errors


def estimate(
    acc: npt.ArrayLike,
    gyr: npt.ArrayLike,
    t: npt.ArrayLike | None = None,
    rate: float | None = None,
    load: npt.ArrayLike | None = None,
    *,
    preset: Preset = "default",
    config: Config | None = None,
    gravity: Gravity | None = None,
    axes: str | None = None,
    validity: npt.ArrayLike | None = None,
) -> Result:
    """Estimates the probability of stable contact for every sample, from the past alone.

    Arrays of float32 and float64 are read where they lie, whatever their strides, unless they are
    fields of packed records or in another byte order: those are copied. A missing value (``None``,
    ``pandas.NA``, masked) is not a number. The global interpreter lock is released meanwhile, so
    threads estimate several feet at once.

    Parameters
    ----------
    acc : array_like, shape (N, 3), m/s²
        Specific force in the frame of the sensor, gravity included unless `gravity` says otherwise.
    gyr : array_like, shape (N, 3), rad/s
        Angular rate in the same frame.
    t : array_like, shape (N,), s, optional
        The time of each sample, from any start, advancing by 1 µs at least; or of ``datetime64``, as
        a ``DatetimeIndex`` has it: then the result's times are s since 1970.
    rate : float, Hz, optional
        The sample rate, 20 to 10 000 Hz. Needed without `t`; with it, they agree within 1 %.
    load : array_like, shape (N,), optional
        Load on the foot in the unit of the load's thresholds, N by default; not a number where it
        is not known. Without it the state is ``unknown``, and nothing else changes.
    preset : {"default", "paper"}
        Where the parameters start from: the estimate that finds its own limits, or the half-widths
        of the paper.
    config : mapping or path, optional
        Parameters that differ from the preset: the keys of the program's configuration file, or the
        file.
    gravity : {"included", "removed"}, optional
        Whether `acc` contains gravity. The configuration's where it is not given, else included.
    axes : str, optional
        How the sensor lies in the foot: the sensor's axes along the foot's x, y and z, such as
        ``"x,-z,y"``, or a unit quaternion ``"w,x,y,z"`` from the sensor's frame to the foot's. The
        configuration's where it is not given, else the two frames are one.
    validity : array_like of uint8, shape (N,), optional
        What the source knows about each sample, as :attr:`Recording.validity` has it.

    Returns
    -------
    Result
        One estimate for each sample.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    TypeError
        An argument is no array of numbers.
    """
    recording: RecordingDict = {
        "acc": floats(acc),
        "gyr": floats(gyr),
        "t": None if t is None else times(t),
        "load": None if load is None else floats(load),
        "validity": None if validity is None else np.ascontiguousarray(validity, dtype=np.uint8),
    }
    with arguments_in_errors():
        arrays = _footfall.estimate(recording, settings(preset, config, gravity, rate, axes))
    return Result._of(arrays)


def estimate_file(
    path: str | os.PathLike[str],
    *,
    preset: Preset = "default",
    config: Config | None = None,
    format: str | None = None,
    rate: float | None = None,
    gravity: Gravity | None = None,
    axes: str | None = None,
    topic: str | Sequence[str] | None = None,
    not_topic: str | Sequence[str] | None = None,
    frame: str | Sequence[str] | None = None,
    load_topic: str | Sequence[str] | None = None,
    map: str | Mapping[str, str] | None = None,
    units: str | None = None,
    scale: tuple[float, float] | None = None,
    decimal: str | None = None,
    time_unit: TimeUnit | None = None,
    times: Times | None = None,
    estimate_again: bool = False,
    foot: str | None = None,
) -> list[Result]:
    """Estimates each foot in a file, as ``footfall replay`` does.

    Samples go from the file to the estimator one by one; only the estimates are in memory.

    Parameters
    ----------
    path : path
        A recording in any of the formats of ``docs/formats.md``.
    preset, config, gravity, axes
        As of :func:`estimate`.
    format, rate, topic, not_topic, frame, load_topic, map, units, scale, decimal, time_unit,
    times
        As of :func:`read`. A `rate`, `gravity` or `axes` that is given wins over that of `config`.
    estimate_again : bool
        Whether to estimate from the samples of a bag that has the contacts of its feet, as ``footfall record``
        writes them. Otherwise these contacts are the estimates, with their times and rate: no setting applies,
        numbers that a contact lacks are not a number, and :attr:`Result.learnt` is empty.
    foot : str, optional
        The name of the only foot, where the file has none: settings of single feet apply by it.

    Returns
    -------
    list of Result
        One for each foot: in the order of `topic`, by name with ``"all"``, and just one where the
        file is of one foot. :attr:`Result.foot` has its name.

    Raises
    ------
    ValueError
        The file is not understood, or an argument is out of its range; the message names the place,
        and what to do.
    OSError
        It cannot be read.
    """
    options = read_options(
        format, rate, gravity, topic, frame, load_topic, map, units, time_unit, times, not_topic,
        scale, decimal, estimate_again,
    )
    chosen = settings(preset, config, gravity, rate, axes)
    with arguments_in_errors():
        feet = _footfall.estimate_file(os.fspath(path), options, chosen, foot)
    return [Result._of(arrays) for arrays in feet]
