"""Searches the constants of the default estimate, leaving out each robot in turn.

`python -m research.choose [robot …]`, in the folder `laboratory`, writes `results/without-robot.json`: the RMSE of
each robot with constants that were chosen on all others, and the scores of such constants on the sets of the means.
A robot is one family, whatever the folder; several of its recordings count as one.
"""

from __future__ import annotations

import math
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cma
import numpy as np
from footfall import _footfall

from .resample import resample
from .results import Result, write
from .score import Answers, Figures
from .sets import AVERAGED, POOLS, Labelled, load
from .sets import ROBOTS as REAL

ROBOTS = {
    "ATLAS": ["ground", "3 steps", "slip", "ATLAS 7k", "ATLAS 500 Hz"],
    "NAO": ["NAO", "real NAO", "pushed NAO"],
    "GO1": ["GO1"],
    "TALOS": ["TALOS"],
    "shoe": ["shoe"],
    "simulated": ["demo"],
}
"""Sets of recordings by robot."""

PRODUCT = 1000.0
"""Sample rate of a foot, Hz."""

LOST = 0.3
"""Share of a stance with P > 0.5 below which it counts as lost."""

EVALUATIONS = 300
"""Sets of constants that a search tries."""

SPREAD = 0.2
"""First step of a search, of the logarithm of a constant."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A recording at a rate."""

    robot: str
    set: str
    file: Labelled

    def figures(self, changed: list[tuple[str, float]]) -> tuple[float, int, int, int]:
        """Sum of squared errors, number of samples, stances, and stances lost."""
        recording = self.file.recording
        removed = recording.gravity == "removed"
        p = _footfall.p_stable(recording.acc, recording.gyr, recording.rate, removed, changed)
        label = self.file.label[: len(p)]
        known = label >= 0
        squares = float(np.sum((p[known] - label[known]) ** 2))
        edges = np.flatnonzero(np.diff(label)) + 1
        stances = [of for of, what in zip(np.split(p, edges), np.split(label, edges)) if what[0] == 1]
        lost = sum(float(np.mean(of > 0.5)) < LOST for of in stances)
        return squares, int(known.sum()), len(stances), lost


def recordings() -> list[Judged]:
    """Every labelled recording, at its own rate and at the rate of a foot."""
    found = []
    for robot, names in ROBOTS.items():
        for file in load(names):
            found.append(Judged(robot, file.set, file))
            if file.recording.rate < 0.9 * PRODUCT:
                at_rate = Labelled(file.set, file.family, resample(file.recording, PRODUCT))
                found.append(Judged(robot, f"{file.set} at 1 kHz", at_rate))
    return found


def by_robot(judged: list[Judged], changed: list[tuple[str, float]]) -> dict[str, tuple[float, float]]:
    """Mean RMSE of the sets of each robot, and the share of its stances that are lost."""
    with ThreadPoolExecutor() as pool:
        figures = list(pool.map(lambda one: one.figures(changed), judged))
    result = {}
    for robot in dict.fromkeys(one.robot for one in judged):
        sets: dict[str, list[tuple[float, int, int, int]]] = {}
        for one, of in zip(judged, figures):
            if one.robot == robot:
                sets.setdefault(one.set, []).append(of)
        sums = [np.sum(of, axis=0) for of in sets.values()]
        rmse = float(np.mean([math.sqrt(squares / samples) for squares, samples, _, _ in sums]))
        _, _, stances, lost = np.sum(sums, axis=0)
        result[robot] = rmse, float(lost / stances)
    return result


def search(judged: list[Judged], evaluations: int) -> list[tuple[str, float]]:
    """Constants with the least mean over robots of RMSE and of half of the share of stances lost."""
    default = _footfall.constants()
    start = [math.log(value) for _, value in default]

    def constants(point: list[float]) -> list[tuple[str, float]]:
        return [(name, math.exp(value)) for (name, _), value in zip(default, point)]

    def objective(point: list[float]) -> float:
        try:
            found = by_robot(judged, constants(point))
        except ValueError:
            # A constant is out of its range. The search draws another point instead.
            return math.nan
        return float(np.mean([rmse + 0.5 * lost for rmse, lost in found.values()]))

    options = {"maxfevals": evaluations, "verbose": -9, "seed": 1}
    best, _ = cma.fmin2(objective, start, SPREAD, options)
    return constants(list(best))


def answers(judged: list[Judged], sets: list[str], changed: list[tuple[str, float]]) -> list[Answers]:
    """Of recordings as they are."""
    found = []
    for file in (one.file for one in judged if one.set in sets):
        recording = file.recording
        p = _footfall.p_stable(recording.acc, recording.gyr, recording.rate, recording.gravity == "removed", changed)
        found.append(Answers.of(file.label, p.astype(np.float64)))
    return found


def scores(judged: list[Judged], chosen: dict[str, list[tuple[str, float]]]) -> dict[str, float | None]:
    """Means over sets, each with the constants that were chosen without its robot; none if a robot is missing."""

    def of(sets: list[str]) -> list[Answers] | None:
        robots = [robot for name in sets for robot, names in ROBOTS.items() if name in names]
        if not set(robots) <= chosen.keys():
            return None
        return [one for robot, name in zip(robots, sets, strict=True) for one in answers(judged, [name], chosen[robot])]

    def mean(sets: list[str], figure: str, decimals: int) -> float | None:
        found = [of([name]) for name in sets]
        known = [Figures.of(one) for one in found if one is not None]
        return round(getattr(Figures.mean(known), figure), decimals) if len(known) == len(sets) else None

    def pooled(sets: list[str]) -> float | None:
        found = of(sets)
        return None if found is None else round(Figures.of(found).rmse, 4)

    return {
        "rmse": mean(AVERAGED, "rmse", 4),
        "roc_auc": mean(AVERAGED, "roc_auc", 3),
        "calibration_error": mean(AVERAGED, "calibration_error", 3),
        "f1": mean(AVERAGED, "f1", 3),
        "false_stable": mean(AVERAGED, "false_stable", 3),
        "robots_rmse": mean(REAL, "rmse", 4),
        "robots_roc_auc": mean(REAL, "roc_auc", 3),
        "atlas_rmse": pooled(POOLS["ATLAS"]),
        "lcd_rmse": pooled(POOLS["LCD"]),
    }


def main(robots: list[str]) -> None:
    judged = recordings()
    default = by_robot(judged, [])
    chosen, rows = {}, []
    for robot in robots or list(ROBOTS):
        rmse, lost = default[robot]
        chosen[robot] = search([one for one in judged if one.robot != robot], EVALUATIONS)
        alone, lost_alone = by_robot([one for one in judged if one.robot == robot], chosen[robot])[robot]
        row = {"rmse": rmse, "lost": lost, "without_rmse": alone, "without_lost": lost_alone}
        rows.append({"robot": robot} | {key: round(value, 3) for key, value in row.items()})
        print(rows[-1], flush=True)
    what = f"RMSE and lost stances of robots with constants chosen on all others, by {EVALUATIONS} trials each."
    command = " ".join(["python -m research.choose", *robots])
    write([Result("without-robot", what, command, values=scores(judged, chosen), rows=rows)])


if __name__ == "__main__":
    main(sys.argv[1:])
