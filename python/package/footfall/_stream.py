"""Sample by sample, as a robot has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from . import _footfall
from ._settings import Config, Gravity, Preset, settings


class Estimate(NamedTuple):
    """What the estimator says after one sample."""

    t: float
    """Time of the sample, s."""
    p_stable: float
    """The foot does not move at all: stable contact, in [0, 1]."""
    p_tangential: float
    """No motion along the ground and no turn about up, in [0, 1]."""
    p_vertical: float
    """No lifting and no tilting, in [0, 1]."""
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
        As of :func:`footfall.estimate`.

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
    ) -> None:
        self._estimator = _footfall.Estimator(settings(preset, config, gravity, rate, axes))

    def update(
        self,
        acc: Sequence[float],
        gyr: Sequence[float],
        t: float | None = None,
        load: float | None = None,
    ) -> Estimate:
        """Takes in the next sample.

        Parameters
        ----------
        acc : three floats, m/s²
        gyr : three floats, rad/s
        t : float, s, optional
            Its time on any clock, after that of the sample before; one period later where it is
            not given. Time that was lost is seen by it: give it where samples can be.
        load : float, optional
            The load on the foot, where it is known.

        Raises
        ------
        ValueError
            `t` does not come after the time before. The sample is not taken in.
        """
        row = self._estimator.update(
            (float(acc[0]), float(acc[1]), float(acc[2])),
            (float(gyr[0]), float(gyr[1]), float(gyr[2])),
            t,
            load,
        )
        t, (stable, tangential, vertical), axes, quaternion, linear, sigma_v, status = row
        state, decision, flags = status
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
