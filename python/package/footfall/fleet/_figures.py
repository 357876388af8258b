"""Figures of a fleet: half-widths and slips of its robots, and sensors that drift."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Union

import numpy as np

if TYPE_CHECKING:
    import pyarrow

Rows = Union[Iterable[dict[str, Any]], "pyarrow.Table"]

AXES = ("wx", "wy", "wz")

OUTLIER = 3.0
"""Drift of a bias, in multiples of the 90th percentile over all feet, from which a sensor is taken to fail."""


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


def robots(rows: Rows) -> list[RobotFigures]:
    """Returns steps, slips and half-widths of each robot, that which slips most first.

    `rows` are those of :func:`rows`, or as many of them as dicts.
    """
    by_robot: dict[str, list[dict[str, Any]]] = {}
    for row in _done(rows):
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


def drifts(rows: Rows) -> list[Drift]:
    """Returns the change of the gyroscope's bias of every foot, the greatest first."""
    changes = []
    for row in _done(rows):
        ends = [[row[f"gyro_bias_{end}_{axis}_rad_s"] for axis in AXES] for end in ("start", "end")]
        start, end = (np.array(bias, dtype=float) for bias in ends)
        changes.append(Drift(row["robot"], row["foot"], float(np.linalg.norm(end - start))))
    return sorted(changes, key=lambda drift: -np.nan_to_num(drift.change, nan=-1.0))


def drifting(rows: Rows) -> list[Drift]:
    """Returns the feet whose sensor drifts: their bias changes :data:`OUTLIER` times as much as that of nine feet in
    ten."""
    changes = [drift for drift in drifts(rows) if not np.isnan(drift.change)]
    if not changes:
        return []
    limit = OUTLIER * np.percentile([drift.change for drift in changes], 90)
    return [drift for drift in changes if drift.change > limit]


def _done(rows: Rows) -> list[dict[str, Any]]:
    several = rows if isinstance(rows, Iterable) and not hasattr(rows, "to_pylist") else rows.to_pylist()
    return [row for row in several if row["status"] == "done"]
