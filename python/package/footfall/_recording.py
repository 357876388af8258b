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
from ._words import arguments_in_errors, with_arguments

if TYPE_CHECKING:
    import pyarrow

R = TypeVar("R", bound="Recording")


@dataclass(frozen=True, eq=False)
class Recording:
    """N samples of one foot, in SI units."""

    name: str
    """What it is called."""
    foot: str | None
    """The foot, where the file names it."""
    format: str
    """The format of the file, which the thresholds of the load depend on."""
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
    """Load on the foot; not a number where it is not known. Shape (N,)."""
    label: npt.NDArray[np.int8] | None
    """The truth: 1 stable, 0 not, -1 not known. Shape (N,)."""
    validity: npt.NDArray[np.uint8]
    """What the source knew: 0 valid, 1 accelerometer saturated, 2 gyroscope saturated, 3 both,
    4 stale, 5 invalid. Shape (N,)."""
    notices: tuple[str, ...]
    """One sentence on each thing that was left out or reinterpreted."""
    axes: str | None = None
    """Mounting of the sensor in the foot, as given to :func:`read`; `acc` and `gyr` are in the frame of
    the sensor all the same."""

    @classmethod
    def _of(cls: type[R], arrays: dict[str, Any]) -> R:
        return cls(**arrays | {"notices": tuple(map(with_arguments, arrays["notices"]))})

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<footfall.Recording {self.name!r}: {len(self)} samples at {self.rate:g} Hz>"

    def _arrays(self) -> RecordingDict:
        return {
            "acc": self.acc,
            "gyr": self.gyr,
            "t": self.t,
            "load": self.load,
            "validity": self.validity,
        }

    def to_arrow(self) -> pyarrow.Table:
        """A table of Arrow with the columns that :func:`read` and the program read from Parquet; needs
        ``footfall[arrow]``. A label that is not known is null."""
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
            As of :func:`footfall.estimate`.
        """
        chosen = settings(preset, config, self.gravity, self.rate, self.axes, self.format)
        with arguments_in_errors():
            arrays = _footfall.estimate(self._arrays(), chosen)
        named = {"recording": self.name, "foot": self.foot, "notices": self.notices}
        return Result._of(arrays | named)


@dataclass(frozen=True, eq=False)
class Simulation(Recording):
    """The recording of a simulated foot, and what really happened."""

    touch_downs: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """When the foot touched down, s, shape (M,)."""
    slips: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    """When it began and ended to slide, s, shape (K, 2)."""


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
    map: str | Mapping[str, str] | None = None,
    units: str | None = None,
    scale: tuple[float, float] | None = None,
    decimal: str | None = None,
    time_unit: TimeUnit | None = None,
    times: Times | None = None,
) -> list[Recording]:
    """Reads the recording of each foot in a file, in every format that ``footfall replay`` reads.

    ``docs/formats.md`` describes the formats and options: those of the program have the same names.

    Parameters
    ----------
    path : path
        The file, or the folder of a rosbag2.
    format : str, optional
        How the file is laid out, where its first bytes do not show it: ``"csv"``, ``"pce-atlas"``, ...
    rate : float, Hz, optional
        Sample rate, 20 to 10 000 Hz, where the file does not tell or its nominal rate is wrong.
    gravity : {"included", "removed"}, optional
        Whether the accelerations contain gravity; what is usual for the format where it is not given.
    axes : str, optional
        How the sensor lies in the foot, as of :func:`footfall.estimate`. It is kept for
        :meth:`Recording.estimate`, and turns no sample.
    topic : str or several, optional
        Of a bag of ROS 2: the topic of each foot, or ``"all"``. May be left out where there is one.
    not_topic : str or several, optional
        Of a bag: topics to leave out, such as ``"/trunk/*"`` with ``topic="all"``; ``*`` stands for any text.
    frame : str or several, optional
        Of a bag: the frame of each foot, where one topic has messages of several.
    load_topic : str or several, optional
        Of a bag: the load of each foot, in the order of `topic`, as ``"/topic"`` or ``"/topic:field"``, or one
        with ``{foot}`` in the place of the foot's name.
    map : str or mapping, optional
        Which columns of a table stand for ours: ``{"t": "stamp"}`` or ``"t=stamp"``.
    units : str, optional
        Units of the six axes where they are not ``"m/s2,rad/s"``: ``"g"``, ``"dps"``, ``"g,dps"``,
        ``"mg,mdps"``.
    scale : two floats, optional
        Factors of accelerometer and gyroscope, before `units` apply: the values of a count.
    decimal : {".", ","}, optional
        Mark before the fractions of a table's numbers.
    time_unit : {"s", "ms", "us", "ns"}, optional
        Unit of the times, where it is not that of the column's name or s.
    times : {"keep", "drop-bad", "rate"}, optional
        Times that are not in order: an error, leave those rows out, or space all rows by the rate.

    Returns
    -------
    list of Recording
        One for each foot: in the order of `topic`, by name with ``"all"``, and just one where the file
        is of one foot. :attr:`Recording.foot` has its name.

    Raises
    ------
    ValueError
        The file is not understood; the message names the place and what to do.
    OSError
        It cannot be read.
    """
    options = read_options(
        format, rate, gravity, topic, frame, load_topic, map, units, time_unit, times, not_topic,
        scale, decimal,
    )
    with arguments_in_errors():
        feet = _footfall.read(os.fspath(path), options)
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

    The truth is kinematic: a score that is reached here is no score on a robot. The same arguments
    give the same bits on every machine.

    Parameters
    ----------
    gait : {"stand", "walk", "trot", ..., "demo"}
        The gait; an error lists all of them. ``"demo"`` is the walk of ``footfall demo``, which has its own
        duration and ground: of the other arguments, only `seed`, `warming` and `gyro_drift` apply to it.
    seconds : float, s
        How long, 0.001 to 86 400 s, with two seconds of standing at the beginning.
    seed : int
        What the steps, the specimen of the sensor (its biases, its clock) and its noise are drawn from.
    ground : {"hard", "greased", "soft"}
        What is under the foot.
    greased : float, 0 to 1
        The share of steps that meet a greased patch, where the foot slips once.
    step_length : float, 0.1 to 3
        How long the steps are, as a factor of those of the gait.
    shaking : float, 0 to 10
        How much the robot shakes the standing foot, as a factor of what is usual.
    rests : two floats, s, optional
        For how long it walks, 0.1 s at least, and for how long it then stands still, by turns.
    warming : float, 0 to 60 °C
        By how much the sensor warms up, with a time constant of three minutes; its biases change with it.
    gyro_drift : three floats, -1 to 1 rad/s²
        By how much the gyroscope's bias grows in each second: a sensor that fails.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    """
    x, y, z = (float(axis) for axis in gyro_drift)
    walk: WalkDict = {
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
    return Simulation._of(_footfall.simulate(walk))
