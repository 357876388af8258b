"""What a fleet's rows say: half-widths of robots, slips, and sensors that drift."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

AXES = ("wx", "wy", "wz")

OUTLIER = 3.0
"""A bias that changes by so many times as much as that of nine in ten feet is one of a sensor that fails."""


@dataclass(frozen=True)
class RobotFigures:
    """One robot, over all its feet."""

    name: str
    steps: int
    slips: int
    acceleration_half_width: float
    """Where stillness ends, median of its feet, m/s²."""
    rate_half_width: float
    """The same of the angular rate, rad/s."""

    @property
    def slips_per_thousand_steps(self) -> float:
        """How often it slips."""
        return 1000.0 * self.slips / max(self.steps, 1)


@dataclass(frozen=True)
class Drift:
    """By how much the gyroscope's bias of a foot changed from its first rest to its last."""

    robot: str
    foot: str
    change: float
    """rad/s; not a number where the foot never rested."""


def robots(rows: Iterable[dict[str, Any]]) -> list[RobotFigures]:
    """The robots, those that slip most first."""
    by_robot: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        if row["status"] == "done":
            by_robot.setdefault(row["robot"], []).append(row)

    def median(feet: list[dict[str, Any]], column: str) -> float:
        known = [foot[column] for foot in feet if foot[column] is not None]
        return float(np.median(known)) if known else float("nan")

    figures = [
        RobotFigures(
            name=name,
            steps=sum(foot["steps"] for foot in feet),
            slips=sum(foot["slips"] for foot in feet),
            acceleration_half_width=median(feet, "acceleration_half_width_m_s2"),
            rate_half_width=median(feet, "rate_half_width_rad_s"),
        )
        for name, feet in by_robot.items()
    ]
    return sorted(figures, key=lambda robot: (-robot.slips_per_thousand_steps, robot.name))


def drifts(rows: Iterable[dict[str, Any]]) -> list[Drift]:
    """The change of every foot's bias, the greatest first."""
    changes = []
    for row in rows:
        if row["status"] != "done":
            continue
        ends = [[row[f"gyro_bias_{end}_{axis}_rad_s"] for axis in AXES] for end in ("start", "end")]
        start, end = (np.array(bias, dtype=float) for bias in ends)
        changes.append(Drift(row["robot"], row["foot"], float(np.linalg.norm(end - start))))
    return sorted(changes, key=lambda drift: -np.nan_to_num(drift.change, nan=-1.0))


def drifting(rows: Iterable[dict[str, Any]]) -> list[Drift]:
    """The feet whose sensor drifts: their bias changes unlike that of the fleet."""
    changes = drifts(rows)
    limit = OUTLIER * np.nanpercentile([drift.change for drift in changes], 90)
    return [drift for drift in changes if drift.change > limit]


def rank_correlation(one: npt.ArrayLike, other: npt.ArrayLike) -> float:
    """Spearman's, in [-1, 1]: 1 where both rank alike; equal values share their rank."""

    def ranks(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
        _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
        last = np.cumsum(counts)
        return np.asarray((last - (counts - 1) / 2.0)[place], dtype=np.float64)

    return float(np.corrcoef(ranks(one), ranks(other))[0, 1])
