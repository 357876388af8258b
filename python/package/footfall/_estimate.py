"""Probabilities of whole recordings, in arrays or in files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy.typing as npt

from . import _footfall
from ._arrays import floats, times, validities
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
from ._sheet import as_table


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
    """Estimates the probability of stable contact for every sample, from past samples only.

    Arrays of float32 and float64 are read in place, whatever their strides. Fields of packed records and arrays in
    another byte order are copied. A missing value (``None``, ``pandas.NA``, masked) counts as NaN. The global
    interpreter lock is released during the estimate, so that threads can estimate several feet at once.

    Parameters
    ----------
    acc : array_like, shape (N, 3), m/s²
        Specific force in the frame of the sensor, gravity included unless `gravity` says otherwise.
    gyr : array_like, shape (N, 3), rad/s
        Angular rate in the same frame.
    t : array_like, shape (N,), s, optional
        Time of each sample, from any start, increasing by at least 1 µs; or ``datetime64``, as in a
        ``DatetimeIndex``: the times of the result are then s since 1970.
    rate : float, Hz, optional
        Sample rate, 20 to 10 000 Hz. Required without `t`; with `t`, both must agree within 10 %, and this one is used.
    load : array_like, shape (N,), optional
        Load on the foot in the unit of the load's thresholds, N by default; NaN where unknown. Without it the state is
        ``unknown``, and nothing else changes.
    preset : {"default", "paper"}
        Parameters to start from: the method that finds its own limits, or the half-widths of the paper.
    config : mapping or path, optional
        Parameters that differ from the preset: the keys of the program's configuration file, or its path.
    gravity : {"included", "removed"}, optional
        Whether `acc` contains gravity; by default as in the configuration, or included.
    axes : str, optional
        Mounting of the sensor in the foot: the sensor's axes along the foot's x, y and z, such as ``"x,-z,y"``, or a
        unit quaternion ``"w,x,y,z"`` from the sensor's frame to the foot's. By default as in the configuration, or no
        rotation.
    validity : array_like of uint8, shape (N,), optional
        Validity of each sample according to its source, as in :attr:`Recording.validity`.

    Returns
    -------
    Result
        One estimate for each sample.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    TypeError
        An argument is not an array of numbers.
    """
    recording: RecordingDict = {
        "acc": floats("acc", acc),
        "gyr": floats("gyr", gyr),
        "t": None if t is None else times("t", t),
        "load": None if load is None else floats("load", load),
        "validity": None if validity is None else validities(validity),
    }
    chosen = settings(preset, config, gravity=gravity, rate=rate, axes=axes)
    arrays = _footfall.estimate(recording, chosen)
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
    rename: str | Mapping[str, str] | None = None,
    map: str | Mapping[str, str] | None = None,
    units: str | None = None,
    scale: tuple[float, float] | tuple[float, float, float] | None = None,
    decimal: str | None = None,
    time_unit: TimeUnit | None = None,
    times: Times | None = None,
    estimate_again: bool = False,
    foot: str | None = None,
) -> list[Result]:
    """Estimates each foot in a file, as ``footfall replay`` does.

    Samples are read one by one; only the estimates are kept in memory.

    Parameters
    ----------
    path : path
        A recording in any of the formats of ``docs/reference/formats.md``, or an ``.xlsx`` as for :func:`read`.
    preset, config, gravity, axes
        As in :func:`estimate`.
    format, rate, topic, not_topic, frame, load_topic, rename, map, units, scale, decimal, time_unit,
    times
        As in :func:`read`. A given `rate`, `gravity` or `axes` overrides `config`.
    estimate_again : bool
        Whether to estimate again from the samples of a bag that holds the contacts of its feet, as written by
        ``footfall record``. By default these contacts are the estimates, with their times and rate: settings have no
        effect, values that a contact lacks are NaN, and :attr:`Result.learnt` is empty.
    foot : str, optional
        Name of the only foot, if the file has none, for settings of single feet.

    Returns
    -------
    list of Result
        One for each foot, in the order of `topic`, or by name with ``"all"``. :attr:`Result.foot` holds its name.

    Raises
    ------
    ValueError
        The file is not understood, or an argument is out of its range; the message names the place and the remedy.
    OSError
        The file cannot be read.
    ImportError
        The format needs a feature with which this package was not built.
    """
    options = read_options(
        format=format,
        rate=rate,
        gravity=gravity,
        topic=topic,
        not_topic=not_topic,
        frame=frame,
        load_topic=load_topic,
        rename=rename,
        map=map,
        units=units,
        scale=scale,
        decimal=decimal,
        time_unit=time_unit,
        times=times,
        estimate_again=estimate_again,
    )
    chosen = settings(preset, config, gravity=gravity, rate=rate, axes=axes)
    with as_table(path) as table:
        feet = _footfall.estimate_file(table, options, chosen, foot)
    return [Result._of(arrays) for arrays in feet]
