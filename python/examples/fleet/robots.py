"""A fleet of simulated robots: each walks in its own way, some on grease, and the gyroscope of three feet fails.

The recordings are written by Ray tasks as ``ROBOT/DAY/FOOT.parquet``, the truth about them as ``truth.json``.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import footfall
from footfall.fleet._need import need

FEET = ("FL", "FR", "RL", "RR")

DAY = "2026-11-21"

PATH_PATTERN = "{robot}/{day}/{foot}.parquet"

DRIFTING = (("robot-07", "RL"), ("robot-23", "FR"), ("robot-41", "FL"))
"""The feet whose gyroscope drifts."""

DRIFT_PER_ROUND = 0.0036
"""By how much, from one rest to the next, rad/s: inside what the estimator follows at rest."""


def rounds(seconds: float) -> tuple[float, float]:
    """For how long a robot walks and then stands, by turns, in a recording of so many seconds, s."""
    return (5.0, 7.0) if seconds < 600.0 else (590.0, 10.0)


@dataclass(frozen=True)
class Robot:
    """What sets a robot apart."""

    name: str
    gait: str
    ground: str
    greased: float
    """The share of its steps that meet a greased patch."""
    step_length: float
    shaking: float


@dataclass(frozen=True)
class Truth:
    """What really happened to a foot."""

    robot: str
    foot: str
    steps: int
    slips: int
    drifts: bool


def fleet(robots: int = 50, seed: int = 2026) -> list[Robot]:
    """Robots of all kinds; the same seed makes the same ones."""
    random = np.random.default_rng(seed)
    return [
        Robot(
            name=f"robot-{k:02}",
            gait=str(random.choice(["walk", "trot"])),
            ground=str(random.choice(["hard", "hard", "soft"])),
            greased=float(random.choice([0.0, 0.05, 0.1, 0.2, 0.4])),
            step_length=float(random.uniform(0.8, 1.3)),
            shaking=float(random.uniform(0.7, 1.6)),
        )
        for k in range(robots)
    ]


def record(robot: Robot, foot: str, seed: int, seconds: float, folder: str) -> dict[str, Any]:
    """Records one foot, and returns the truth about it."""
    parquet = need("pyarrow.parquet")
    walking, rest = rounds(seconds)
    drifts = (robot.name, foot) in DRIFTING
    drift = DRIFT_PER_ROUND / (walking + rest) if drifts else 0.0
    walk = footfall.simulate(
        robot.gait,
        seconds,
        seed,
        ground=robot.ground,
        greased=robot.greased,
        step_length=robot.step_length,
        shaking=robot.shaking,
        rests=(walking, rest),
        warming=20.0,
        gyro_drift=(drift, -drift / 2.0, drift / 2.0),
    )
    path = Path(folder) / robot.name / DAY / f"{foot}.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(walk.to_arrow(), path, compression="zstd")
    truth = Truth(robot.name, foot, len(walk.touch_downs), len(walk.slips), drifts)
    return asdict(truth)


def simulate(folder: str | Path, seconds: float, robots: int = 50) -> list[Truth]:
    """Records all feet of a fleet on Ray, and writes the truth beside the recordings."""
    ray = need("ray")
    # Workers need not have this file.
    need("ray.cloudpickle").register_pickle_by_value(sys.modules[__name__])
    remote = ray.remote(num_cpus=1, memory=record_memory(seconds))(record)
    tasks = [
        remote.remote(robot, foot, 4 * k + place, seconds, str(Path(folder).resolve()))
        for k, robot in enumerate(fleet(robots))
        for place, foot in enumerate(FEET)
    ]
    truths = [Truth(**truth) for truth in ray.get(tasks)]
    text = json.dumps([asdict(truth) for truth in truths], indent=1)
    (Path(folder) / "truth.json").write_text(text, encoding="utf-8")
    return truths


def record_memory(seconds: float) -> int:
    """What recording a foot needs, bytes: the simulation keeps its samples and the truth in memory."""
    return int((200 << 20) + seconds * 1000.0 * 600.0)
