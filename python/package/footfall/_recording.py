"""Recordings: from files, or of a simulated foot."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _footfall
from ._result import Result
from ._settings import Config, Gravity, Preset, ReadDict, RecordingDict, settings


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

    @classmethod
    def _of(cls, arrays: dict[str, Any]) -> Recording:
        return cls(**arrays | {"notices": tuple(arrays["notices"])})

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

    def estimate(self, *, preset: Preset = "default", config: Config | None = None) -> Result:
        """Estimates the probability of stable contact, as ``footfall replay`` does.

        Parameters
        ----------
        preset, config
            As of :func:`footfall.estimate`.
        """
        chosen = settings(preset, config, self.gravity, self.rate, self.format)
        return Result._of(_footfall.estimate(self._arrays(), chosen))


def read(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    rate: float | None = None,
    gravity: Gravity | None = None,
    map: str | None = None,
    units: str | None = None,
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    times: Literal["keep", "drop-bad", "rate"] | None = None,
) -> list[Recording]:
    """Reads the recording of each foot in a file, in every format that ``footfall replay`` reads.

    Parameters
    ----------
    path : path
        The file.
    format, rate, gravity, map, units, time_unit, times
        As the options of ``footfall replay``: ``docs/formats.md``.

    Raises
    ------
    ValueError
        The file is not understood; the message names the place and what to do.
    OSError
        It cannot be read.
    """
    options: ReadDict = {
        "format": format,
        "rate": rate,
        "gravity": gravity,
        "map": map,
        "units": units,
        "time_unit": time_unit,
        "times": times,
    }
    return [Recording._of(arrays) for arrays in _footfall.read(os.fspath(path), options)]


def simulate(
    gait: str = "walk", seconds: float = 20.0, seed: int = 1, *, ground: str = "hard"
) -> Recording:
    """Simulates a foot with an LSM6DSOX of its own at 1 kHz, with load and labels.

    The truth is kinematic: a score that is reached here is no score on a robot. The same arguments
    give the same bits on every machine.

    Parameters
    ----------
    gait : {"stand", "walk", "trot", ...}
        The gait; an error lists all of them.
    seconds : float, s
        How long, 0.001 to 86 400 s, with two seconds of standing at the beginning.
    seed : int
        What the steps, the specimen of the sensor and its noise are drawn from.
    ground : {"hard", "greased", "soft"}
        What is under the foot.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    """
    return Recording._of(_footfall.simulate(gait, ground, float(seconds), seed))
