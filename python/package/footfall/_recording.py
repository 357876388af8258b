"""Recordings: from files, or of a simulated foot."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from . import _footfall
from ._footfall import VALIDITIES
from ._result import Result
from ._settings import (
    Config,
    Gravity,
    Preset,
    RecordingDict,
    Times,
    TimeUnit,
    WalkDict,
    read_options,
    settings,
)
from ._sheet import as_table

if TYPE_CHECKING:
    import pyarrow

R = TypeVar("R", bound="Recording")


@dataclass(frozen=True, eq=False)
class Recording:
    """N samples of one foot, in SI units."""

    name: str
    """Name of the recording."""
    foot: str | None
    """Foot, if the file names it."""
    format: str
    """Format of the file, on which the thresholds of the load depend."""
    rate: float
    """Sample rate, Hz."""
    gravity: Gravity
    """Whether `acc` contains gravity."""
    t: npt.NDArray[np.float64]
    """Time on the file's clock, s, shape (N,)."""
    acc: npt.NDArray[np.float32]
    """Specific force, m/s², shape (N, 3)."""
    gyr: npt.NDArray[np.float32]
    """Angular rate, rad/s, shape (N, 3)."""
    load: npt.NDArray[np.float64] | None
    """Load on the foot; NaN where unknown. Shape (N,)."""
    label: npt.NDArray[np.int8] | None
    """Ground truth: 1 stable, 0 not, -1 unknown. Shape (N,)."""
    validity: npt.NDArray[np.uint8]
    """Validity according to the source: 0 valid, 1 accelerometer saturated, 2 gyroscope saturated, 3 both saturated,
    4 stale, 5 invalid. Shape (N,)."""
    notices: tuple[str, ...]
    """One sentence on everything that was omitted or reinterpreted."""
    axes: str | None = None
    """Mounting of the sensor in the foot, as given to :func:`read`; `acc` and `gyr` remain in the frame of the
    sensor."""

    @classmethod
    def _of(cls: type[R], arrays: dict[str, Any]) -> R:
        return cls(**arrays | {"notices": tuple(arrays["notices"])})

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<footfall.{type(self).__name__} {self.name!r}: {len(self)} samples at {self.rate:g} Hz>"

    def _arrays(self) -> RecordingDict:
        return {
            "acc": self.acc,
            "gyr": self.gyr,
            "t": self.t,
            "load": self.load,
            "validity": self.validity,
        }

    def to_arrow(self) -> pyarrow.Table:
        """Returns an Arrow table with the columns that :func:`read` and the program read from Parquet; needs
        ``footfall[arrow]``. An unknown label is null."""
        import pyarrow

        columns: dict[str, Any] = {"t": self.t}
        columns |= {name: self.acc[:, k] for k, name in enumerate(("ax", "ay", "az"))}
        columns |= {name: self.gyr[:, k] for k, name in enumerate(("wx", "wy", "wz"))}
        if self.load is not None:
            columns["force"] = self.load
        if self.label is not None:
            columns["label"] = pyarrow.array(self.label, mask=self.label < 0)
        columns["validity"] = pyarrow.DictionaryArray.from_arrays(self.validity, VALIDITIES)
        return pyarrow.table(columns)

    def estimate(self, *, preset: Preset = "default", config: Config | None = None) -> Result:
        """Estimates the probability of stable contact, as ``footfall replay`` does.

        Parameters
        ----------
        preset, config
            As in :func:`footfall.estimate`.
        """
        chosen = settings(
            preset, config, gravity=self.gravity, rate=self.rate, axes=self.axes, format=self.format
        )
        arrays = _footfall.estimate(self._arrays(), chosen)
        named = {"recording": self.name, "foot": self.foot, "notices": self.notices}
        return Result._of(arrays | named)


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Recording):
    """Recording of a simulated foot, with its ground truth."""

    touch_downs: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """Times of touch-downs, s, shape (M,)."""
    slips: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    """Starts and ends of slips, s, shape (K, 2)."""
    position: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    """True position of the sensor in the world, m, shape (N, 3): x forward, y to the left, z up."""
    velocity: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    """True velocity of the sensor in the world, m/s, shape (N, 3)."""


def read(
    path: str | os.PathLike[str],
    *,
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
) -> list[Recording]:
    """Reads the recording of each foot in a file, in every format that ``footfall replay`` reads, or in the first sheet of an
    ``.xlsx``, with pandas and openpyxl.

    ``docs/reference/formats.md`` describes the formats and options, which have the same names in the program.

    Parameters
    ----------
    path : path
        The file, or the folder of a rosbag2.
    format : str, optional
        Format of the file, if its first bytes do not show it: ``"csv"``, ``"pce-atlas"``, ...
    rate : float, Hz, optional
        Sample rate, 20 to 10 000 Hz, if the file does not state it or its nominal rate is wrong.
    gravity : {"included", "removed"}, optional
        Whether the accelerations contain gravity; by default as usual for the format.
    axes : str, optional
        Mounting of the sensor, as in :func:`footfall.estimate`. It is kept for :meth:`Recording.estimate`, and does
        not rotate the samples.
    topic : str or several, optional
        For a ROS 2 bag: topic of each foot, or ``"all"``. Not needed if there is one foot.
    not_topic : str or several, optional
        For a bag: topics to omit, such as ``"/trunk/*"`` with ``topic="all"``; ``*`` matches any text.
    frame : str or several, optional
        For a bag: frame of each foot, if one topic has messages of several.
    load_topic : str or several, optional
        For a bag: load of each foot, in the order of `topic`, as ``"/topic"`` or ``"/topic:field"``, or one with
        ``{foot}`` in place of the foot's name.
    rename : str or mapping, optional
        For a bag: other names of feet: ``{"leg_1": "FL"}`` or ``"leg_1=FL"``.
    map : str or mapping, optional
        Columns of a table by the names used here: ``{"t": "stamp"}`` or ``"t=stamp"``.
    units : str, optional
        Units of the six axes if they are not ``"m/s2,rad/s"``: ``"g"``, ``"dps"``, ``"g,dps"``,
        ``"mg,mdps"``.
    scale : two or three floats, optional
        Factors that convert the readings of accelerometer and gyroscope to `units`, such as the values of a count; the
        third belongs to the load.
    decimal : {".", ","}, optional
        Decimal mark of a table's numbers.
    time_unit : {"s", "ms", "100us", "us", "ns"}, optional
        Unit of the times, if the column's name does not give it and it is not s.
    times : {"auto", "keep", "drop-bad", "smooth", "rate"}, optional
        Treatment of times: smooth times that jitter without gaps, leave them as they are, omit rows that do not advance,
        space rows evenly between gaps, or space all rows by the rate.

    Returns
    -------
    list of Recording
        One for each foot, in the order of `topic`, or by name with ``"all"``. :attr:`Recording.foot` holds its name.

    Raises
    ------
    ValueError
        The file is not understood; the message names the position and the remedy.
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
    )
    with as_table(path) as table:
        feet = _footfall.read(table, options)
    return [Recording._of(arrays | {"axes": axes}) for arrays in feet]


def simulate(
    gait: str = "walk",
    seconds: float = 20.0,
    seed: int = 1,
    *,
    ground: str = "hard",
    greased: float = 0.0,
    step_length: float = 1.0,
    shaking: float = 1.0,
    rests: tuple[float, float] | None = None,
    warming: float = 0.0,
    gyro_drift: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Simulation:
    """Simulates a foot with an LSM6DSOX of its own at 1 kHz, with load and labels.

    The ground truth is kinematic: a score on a simulation does not predict the score on a robot. The same arguments
    give the same bits on every machine.

    Parameters
    ----------
    gait : {"stand", "walk", "trot", ..., "demo"}
        The gait; an error lists all of them. ``"demo"`` is the walk of ``footfall demo``, which has its own
        duration and ground: of the other arguments, only `seed`, `warming` and `gyro_drift` apply to it.
    seconds : float, s
        Duration, 0.001 to 86 400 s, which begins with two seconds of standing.
    seed : int
        Seed of the steps, of the specimen of the sensor (its biases, its clock) and of its noise.
    ground : {"hard", "greased", "soft"}
        Ground under the foot.
    greased : float, 0 to 1
        Share of steps on a greased patch, on which the foot slips once.
    step_length : float, 0.1 to 3
        Length of the steps, as a factor of the gait's length.
    shaking : float, 0 to 10
        Shaking of the standing foot by the robot, as a factor of the usual frequency and of the usual amplitudes of
        acceleration and angular rate.
    rests : two floats, s, optional
        Durations of walking, at least 0.1 s, and of standing still, by turns.
    warming : float, 0 to 60 °C
        Warming of the sensor, with a time constant of three minutes; its biases change with the temperature.
    gyro_drift : three floats, -1 to 1 rad/s²
        Growth of the gyroscope's bias per second, as in a failing sensor.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    """
    walk = walk_arguments(
        gait=gait,
        seconds=seconds,
        seed=seed,
        ground=ground,
        greased=greased,
        step_length=step_length,
        shaking=shaking,
        rests=rests,
        warming=warming,
        gyro_drift=gyro_drift,
    )
    return Simulation._of(_footfall.simulate(walk))


def walk_arguments(
    *,
    gait: str,
    seconds: float,
    seed: int,
    ground: str,
    greased: float,
    step_length: float,
    shaking: float,
    rests: tuple[float, float] | None,
    warming: float,
    gyro_drift: tuple[float, float, float],
) -> WalkDict:
    """Returns the arguments of a simulation in the form that the Rust part takes."""
    x, y, z = (float(axis) for axis in gyro_drift)
    return {
        "gait": gait,
        "seconds": float(seconds),
        "seed": seed,
        "ground": ground,
        "greased": float(greased),
        "step_length": float(step_length),
        "shaking": float(shaking),
        "rests": None if rests is None else (float(rests[0]), float(rests[1])),
        "warming": float(warming),
        "gyro_drift": (x, y, z),
    }
