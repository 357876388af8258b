"""A simulated robot of four feet, with its base and joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import _footfall
from ._recording import Simulation, walk_arguments


@dataclass(frozen=True)
class Leg:
    """Geometry of a leg, in the frame of the base: x forward, y to the left, z up.

    The joints are abduction about x, then hip and knee about y. With all angles 0 the leg is stretched downwards.
    """

    hip: tuple[float, float, float]
    """Position of the axis of abduction, m."""
    offset: float
    """Distance along y from the axis of abduction to the plane of thigh and shank, m; negative on the right."""
    thigh: float
    """Length of the thigh, m."""
    shank: float
    """Length of the shank, m."""

    def foot_position(self, angles: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Returns the position of the foot in the frame of the base, m, from angles in rad; both of shape (..., 3)."""
        abduction, hip, knee = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
        along = -self.thigh * np.sin(hip) - self.shank * np.sin(hip + knee)
        down = self.thigh * np.cos(hip) + self.shank * np.cos(hip + knee)
        sin, cos = np.sin(abduction), np.cos(abduction)
        turned = [along, self.offset * cos + down * sin, self.offset * sin - down * cos]
        return np.asarray(np.stack(turned, axis=-1) + self.hip)

    def jacobian(self, angles: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Returns the change of the foot's position with each angle, m/rad, shape (..., 3, 3): the column of a joint is
        the last axis."""
        angles = np.asarray(angles, dtype=np.float64)
        abduction, hip, _ = np.moveaxis(angles, -1, 0)
        foot = self.foot_position(angles) - self.hip
        zero = np.zeros_like(abduction)
        sin, cos = np.sin(abduction), np.cos(abduction)
        axis = np.stack([zero, cos, sin], axis=-1)
        thigh = self.thigh * np.stack([-np.sin(hip), np.cos(hip) * sin, -np.cos(hip) * cos], axis=-1)
        below_knee = foot - self.offset * axis - thigh
        forward = np.array([1.0, 0.0, 0.0])
        columns = [np.cross(forward, foot), np.cross(axis, foot), np.cross(axis, below_knee)]
        return np.asarray(np.stack(columns, axis=-1))


@dataclass(frozen=True, eq=False)
class RobotLeg:
    """A leg of a simulated robot, and the recording of its foot."""

    foot: Simulation
    """Recording of the foot, by a sensor with a clock of its own, and the true motion."""
    geometry: Leg
    """Geometry of the leg."""
    angles: npt.NDArray[np.float64]
    """True angles of the joints at the times of the base, rad, shape (N, 3)."""
    rates: npt.NDArray[np.float64]
    """True rates of the joints at the times of the base, rad/s, shape (N, 3)."""


@dataclass(frozen=True, eq=False)
class Base:
    """The base of a simulated robot: readings of its IMU, and its true motion."""

    t: npt.NDArray[np.float64]
    """Time of each sample, s, shape (N,)."""
    acc: npt.NDArray[np.float32]
    """Specific force in the frame of the base, m/s², shape (N, 3)."""
    gyr: npt.NDArray[np.float32]
    """Angular rate in the frame of the base, rad/s, shape (N, 3)."""
    position: npt.NDArray[np.float64]
    """True position in the world, m, shape (N, 3)."""
    velocity: npt.NDArray[np.float64]
    """True velocity in the world, m/s, shape (N, 3)."""
    quaternion: npt.NDArray[np.float64]
    """True orientation w, x, y, z, base → world, shape (N, 4)."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A simulated quadruped."""

    base: Base
    """The base, with an IMU at its origin."""
    legs: dict[str, RobotLeg]
    """The legs by the names of their feet: ``"FL"``, ``"FR"``, ``"RL"`` and ``"RR"``."""


def simulate_robot(
    gait: str = "trot",
    seconds: float = 20.0,
    seed: int = 1,
    *,
    ground: str = "hard",
    greased: float = 0.0,
    step_length: float = 1.0,
    shaking: float = 1.0,
    rests: tuple[float, float] | None = None,
    warming: float = 0.0,
) -> Robot:
    """Simulates a robot of the size of a Unitree GO1: four feet with an IMU each, the base with one, and the joints.

    The base walks straight ahead and sways, and the feet step to the places that fit its future position. The
    motion is prescribed and not the result of forces: a score on a simulation does not predict the score on a
    robot. The same arguments give the same bits on every machine. Each sensor is a specimen of its own, and has a
    clock of its own.

    Parameters
    ----------
    gait : {"stand", "walk", "trot", "run"}
        The gait.
    seconds : float, s
        Duration, 0.001 to 86 400 s, with two seconds of standing at the beginning and about one at the end.
    seed, ground, greased, step_length, shaking, warming
        As in :func:`simulate`.
    rests : two floats, s, optional
        Durations of walking and of standing still, by turns. The robot walks in whole strides, in which it reaches its
        speed and stops: a walk takes at least 2.701 s, a trot 2.08 s and a run 2.1 s.

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
        gyro_drift=(0.0, 0.0, 0.0),
    )
    arrays = _footfall.simulate_robot(walk)
    legs = {
        name: RobotLeg(
            foot=Simulation._of(leg["foot"]),
            geometry=Leg(*leg["geometry"]),
            angles=leg["angles"],
            rates=leg["rates"],
        )
        for name, leg in arrays["legs"].items()
    }
    return Robot(base=Base(**arrays["base"]), legs=legs)
