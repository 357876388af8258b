"""Estimate sample by sample, for streams."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from . import _footfall
from ._footfall import VALIDITIES
from ._result import Event
from ._settings import Config, Gravity, Preset, settings


_MOST_SAMPLES = 1_000_000
"""Most samples of a read."""


class Estimate(NamedTuple):
    """Estimate after one sample."""

    t: float
    """Time of the sample, s."""
    p_stable: float
    """Stable contact: the foot moves as little as in its stances. In [0, 1]."""
    p_tangential: float
    """No motion along the ground; with the preset ``"paper"`` also no turn about up. In [0, 1]."""
    p_vertical: float
    """No lifting; with the preset ``"paper"`` also no tilting. In [0, 1]."""
    p_axes: tuple[float, ...]
    """No motion along or about each axis of :data:`footfall.AXES`, in [0, 1]."""
    quaternion: tuple[float, ...]
    """Orientation w, x, y, z, Hamilton, foot → world, z up."""
    linear_acceleration: tuple[float, ...]
    """Acceleration without gravity in the frame of the foot, m/s²."""
    sigma_v: float
    """Standard deviation of the foot's velocity about zero, each axis, m/s."""
    state: str
    """One of :data:`footfall.STATES`; ``unknown`` without a load."""
    decision: bool
    """The debounced decision: whether contact is stable."""
    flags: tuple[str, ...]
    """Reasons to doubt, of :data:`footfall.FLAGS`."""


class Estimator:
    """The estimator of one foot, for streams: the same bits as :func:`footfall.estimate`.

    Parameters
    ----------
    rate : float, Hz
        The sample rate, 20 to 10 000 Hz.
    preset, config, gravity, axes
        As in :func:`footfall.estimate`.
    format : str, optional
        The format of the recording that the samples come from, :attr:`footfall.Recording.format`: the
        thresholds of the load depend on it. Without it they are in N.
    units : str, optional
        Units of the samples, such as ``"g,dps"``; by default m/s² and rad/s. With other units that no foot can have, a
        warning comes after a second: see :meth:`check_unit`.

    A copy continues from the same state with the same bits. An estimator cannot be pickled: keep the samples, or
    :attr:`learnt` for a warm start.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.

    Examples
    --------
    >>> foot = Estimator(rate=1000.0)
    >>> foot.update((0.0, 0.0, 9.81), (0.0, 0.0, 0.0)).state
    'unknown'
    """

    def __init__(
        self,
        rate: float,
        *,
        preset: Preset = "default",
        config: Config | None = None,
        gravity: Gravity | None = None,
        axes: str | None = None,
        format: str | None = None,
        units: str | None = None,
    ) -> None:
        self._settings = settings(
            preset, config, gravity=gravity, rate=rate, axes=axes, format=format, units=units
        )
        self._samples = 0
        self._is_unit_checked = False
        self._estimator = _footfall.Estimator(self._settings)

    def __copy__(self) -> Estimator:
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._estimator = self._estimator.copy()
        return other

    def __deepcopy__(self, memo: dict[int, object]) -> Estimator:
        return self.__copy__()

    @property
    def gyro_bias(self) -> tuple[float, float, float] | None:
        """Bias of the gyroscope at the newest sample, rad/s; ``None`` until the foot has been at rest."""
        return self._estimator.gyro_bias()

    @property
    def learnt(self) -> npt.NDArray[np.float32]:
        """State learnt up to the newest sample, as in :attr:`footfall.Result.learnt`."""
        return np.array(self._estimator.learnt(), dtype=np.float32)

    def events(self, ended: bool = False) -> tuple[Event, ...]:
        """Returns touch-downs, lift-offs and slips since the last call, as in :meth:`footfall.Result.events`.

        A touch-down comes with the sample that decides it, without a duration and with the greatest probability so far.
        Its lift-off has both. With `ended` the remaining events of the stream are returned.
        """
        return tuple(Event(*event) for event in self._estimator.events(ended))  # type: ignore[arg-type]

    def batch_times(self, t: float, count: int) -> tuple[float, ...]:
        """Returns the times of samples that were read at once, such as from a sensor's FIFO: pass them to :meth:`update`.

        They lie evenly between the newest sample of the previous read and that of this one, as in the libraries for C and
        Rust. If that is too long for `count` samples, some are missing, and the times are one period apart, as in the
        first read.

        Parameters
        ----------
        t : float, s
            The time of the newest sample.
        count : int
            The number of samples, 0 to 1 000 000.

        Raises
        ------
        ValueError
            `count` is out of its range, or `t` is not a time.

        Examples
        --------
        >>> foot = Estimator(rate=1000.0)
        >>> foot.batch_times(0.004, 4)
        (0.001, 0.002, 0.003, 0.004)
        """
        if not 0 <= count <= _MOST_SAMPLES:
            raise ValueError(f"count is {count}, but 0 to {_MOST_SAMPLES} are expected")
        return tuple(self._estimator.batch_times(t, count))

    def check_unit(self) -> None:
        """Checks that the forces of the last half second can come from a foot, in m/s² after `units`.

        :meth:`update` calls it after the first second, and warns.

        Raises
        ------
        ValueError
            No foot can have these forces, because they are in another unit or of another full scale.
        """
        force = self._estimator.implausible_force()
        if force is not None:
            raise ValueError(
                f"acc is {force:.3g} m/s² on average, which no foot has: give the unit, as in units=\"g,dps\", or"
                " multiply counts by their value"
            )

    def _warn_of_unit(self) -> None:
        try:
            self.check_unit()
        except ValueError as error:
            warnings.warn(str(error), RuntimeWarning, stacklevel=3)
        # The unit is not checked again: a plausible force shows that it is right, and one warning is enough.
        self._is_unit_checked = True

    def __reduce__(self) -> NoReturn:
        raise TypeError("an Estimator has no pickle: keep its samples, or .learnt for a warm start")

    def update(
        self,
        acc: Sequence[float],
        gyr: Sequence[float],
        t: float | None = None,
        load: float | None = None,
        validity: str | int = "valid",
    ) -> Estimate:
        """Processes the next sample.

        Parameters
        ----------
        acc : three floats, m/s²
        gyr : three floats, rad/s
        t : float, s, optional
            Its time on any clock, later than the time of the previous sample; by default one period later. Pass it if
            samples may be lost: only the time shows the gap.
        load : float, optional
            Load on the foot, if known.
        validity : str or int
            Validity of the sample according to its source: a name, or a number as in
            :attr:`footfall.Recording.validity`.

        Raises
        ------
        ValueError
            `t` is not later than the previous time, `acc` or `gyr` does not have three numbers, or `validity` is
            unknown. The sample is then ignored.
        """
        row = self._estimator.update(
            _three("acc", acc), _three("gyr", gyr), t, load, _place(validity)
        )
        t, (stable, tangential, vertical), axes, quaternion, linear, sigma_v, status = row
        state, decision, flags = status
        self._samples += 1
        if not self._is_unit_checked and self._samples >= self._settings["rate"]:
            self._warn_of_unit()
        return Estimate(
            t,
            stable,
            tangential,
            vertical,
            tuple(axes),
            tuple(quaternion),
            tuple(linear),
            sigma_v,
            state,
            decision,
            tuple(flags),
        )


def _three(name: str, values: Sequence[float]) -> tuple[float, float, float]:
    numbers = tuple(float(value) for value in values)
    if len(numbers) != 3:
        raise ValueError(f"{name} has {len(numbers)} values, but 3 are expected")
    return numbers


def _place(validity: str | int) -> int:
    known = validity in VALIDITIES if isinstance(validity, str) else 0 <= validity < len(VALIDITIES)
    if not known:
        numbered = ", ".join(f"{place} {name}" for place, name in enumerate(VALIDITIES))
        raise ValueError(f"validity is {validity!r}, but one of these is expected: {numbered}")
    return VALIDITIES.index(validity) if isinstance(validity, str) else int(validity)
