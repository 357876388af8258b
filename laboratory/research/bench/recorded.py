"""Recordings of the bench: each robot in each motion, simulated once and kept in `target/bench`."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import footfall
import mujoco
import numpy as np
import numpy.typing as npt

from ..sets import ROOT, Array, Labelled
from . import humanoid, quadruped
from .motions import MOTIONS, WALKS
from .sensor import readings
from .world import HUMANOID, QUADRUPEDS, STEP, Robot, World

RATES = (1000.0, 416.0)
"""Sample rates, Hz."""

SETTLED = 0.5
"""Duration of the first part of a simulation, in which the robot settles on its feet, s. It is left out."""

FELL = 0.5
"""Duration of the last part before a fall, s. It is left out."""

LOADED = 0.02
"""Load of a foot that is in contact, as a share of the robot's weight."""

STILL = 0.05
"""Speed of the point of contact below which a loaded foot is stable, m/s."""

FOLDER = ROOT / "target/bench"


@dataclass(frozen=True, eq=False)
class Foot:
    """A foot in a motion, at a sample rate."""

    robot: str
    motion: str
    foot: str
    recorded: Labelled
    load: Array
    """Vertical force, as a share of the robot's weight, shape (N,)."""
    slide: Array
    """Speed of the point of contact along the ground, m/s, shape (N,)."""
    velocity: Array
    """Velocity of the IMU, m/s, world frame, shape (N, 3)."""
    fell: bool
    """Whether the robot fell. The recording ends before."""

    @property
    def is_loaded(self) -> npt.NDArray[np.bool_]:
        return self.load > LOADED


@dataclass(frozen=True, eq=False)
class Motions:
    """The base and the feet of a quadruped, at 1 kHz, without errors."""

    force: Array
    """Specific force, m/s², frame of the base."""
    rate: Array
    """Angular rate, rad/s, frame of the base."""
    velocity: Array
    """Velocity of the base, m/s, world frame."""
    quaternion: Array
    """w, x, y, z, base → world."""
    middles: Array
    """Velocities of the middles of the feet, m/s, world frame, shape (4, N, 3)."""


def sets() -> list[tuple[Robot, str]]:
    """Each robot with the name of each of its motions."""
    quadrupeds = [(robot, motion.name) for robot in QUADRUPEDS for motion in MOTIONS]
    return quadrupeds + [(HUMANOID, name) for name in WALKS]


def load(robot: Robot, motion: str) -> Iterator[Foot]:
    """All feet of a set, at all rates. Simulates it if it has not been simulated."""
    arrays = _arrays(robot, motion)
    for rate in RATES:
        for k, name in enumerate(robot.feet):
            acc, gyr, load, contact, velocity, fast = (
                arrays[f"{what} {rate:.0f}"][k] for what in ("acc", "gyr", "load", "slide", "velocity", "moves")
            )
            recording = footfall.Recording(
                name=f"{robot.name}, {motion}", foot=name, format="simulated", rate=rate, gravity="included",
                t=np.arange(len(acc)) / rate, acc=acc, gyr=gyr, load=None,
                label=((load > LOADED) & (fast < STILL)).astype(np.int8),
                validity=np.zeros(len(acc), np.uint8), notices=(),
            )  # fmt: skip
            labelled = Labelled(motion, robot.name, recording)
            yield Foot(robot.name, motion, name, labelled, load, contact, velocity, bool(arrays["fell"]))


def load_base(robot: Robot, motion: str) -> Motions:
    """The base in a set."""
    arrays = _arrays(robot, motion)
    names = ("force", "rate", "velocity", "quaternion")
    base = {name: arrays[f"base {name}"].astype(np.float64) for name in names}
    return Motions(**base, middles=arrays["middles"].astype(np.float64))


def _arrays(robot: Robot, motion: str) -> dict[str, Array]:
    path = FOLDER / f"{_digest()}/{robot.name}, {motion}.npz"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        # Another process may simulate the same set.
        part = path.with_suffix(f".{os.getpid()}.npz")
        np.savez(part, **_simulated(robot, motion))  # type: ignore[arg-type]
        part.replace(path)
    with np.load(path) as of:
        return {key: of[key] for key in of.files}


def _simulated(robot: Robot, motion: str) -> dict[str, Array]:
    seed = [[set_[0].name, set_[1]] for set_ in sets()].index([robot.name, motion])
    random = np.random.default_rng([1, seed])
    if robot is HUMANOID:
        floor, walk, ripple = WALKS[motion]
        world = World(robot, floor, random)
        stands = humanoid.run(humanoid.Humanoid(world, walk, ripple, random), walk.seconds)
    else:
        of = next(one for one in MOTIONS if one.name == motion)
        world = World(robot, of.floor, random)
        walker = quadruped.Quadruped(world, of.ripple, random)
        stands = quadruped.run(walker, of.seconds, of.at(robot.height))
    arrays: dict[str, list[Array]] = {}
    base, feet = world.truth()
    first = round(SETTLED / STEP)
    last = len(base.force) - (0 if stands else round(FELL / STEP))
    for k, truth in enumerate(feet):
        ideal = truth.force[first:last], truth.rate[first:last]
        for rate in RATES:
            t, acc, gyr = readings(ideal, rate, [2, seed, k])
            at = first + np.minimum(np.round(t / STEP).astype(int), last - first - 1)
            slide = truth.slide[at]
            for what, values in (
                ("acc", acc),
                ("gyr", gyr),
                ("load", truth.load[at] / world.weight),
                ("slide", np.hypot(slide[:, 0], slide[:, 1])),
                ("moves", np.linalg.norm(slide, axis=1)),
                ("velocity", truth.velocity[at]),
            ):
                arrays.setdefault(f"{what} {rate:.0f}", []).append(values.astype(np.float32))
    sampled = slice(first, last, round(1.0 / STEP / RATES[0]))
    of_base = {f"base {name}": values[sampled].astype(np.float32) for name, values in vars(base).items()}
    of_base["middles"] = np.array([truth.middle[sampled].astype(np.float32) for truth in feet])
    return {name: np.array(of) for name, of in arrays.items()} | of_base | {"fell": np.array(not stands)}


def _digest() -> str:
    """Digest of the sources and the simulator, which decide the bits of a simulation."""
    of = hashlib.sha256(mujoco.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if path.name in ("world.py", "quadruped.py", "humanoid.py", "motions.py", "sensor.py", "recorded.py"):
            of.update(path.read_bytes())
    return of.hexdigest()[:12]
