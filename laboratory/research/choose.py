"""Searches the constants of the default estimate, without each robot in turn.

`python -m research.choose [evaluations]`, in the folder `laboratory`. Printed for each robot: its RMSE with constants that
were chosen on all others. A robot is one family, whatever the folder; several of its recordings count as one.
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
from .sets import Labelled, load

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
    """Every labelled recording, as it is and at the rate of a foot."""
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
        return float(np.mean([rmse + 0.5 * lost for rmse, lost in by_robot(judged, constants(point)).values()]))

    options = {"maxfevals": evaluations, "verbose": -9, "seed": 1}
    best, _ = cma.fmin2(objective, start, SPREAD, options)
    return constants(list(best))


def main(evaluations: int = EVALUATIONS) -> None:
    judged = recordings()
    default = by_robot(judged, [])
    print("robot       default   lost   without it   lost")
    for robot, (rmse, lost) in default.items():
        others = [one for one in judged if one.robot != robot]
        found = search(others, evaluations)
        alone = by_robot([one for one in judged if one.robot == robot], found)
        print(f"{robot:10}  {rmse:.4f}  {lost:6.3f}   {alone[robot][0]:.4f}   {alone[robot][1]:8.3f}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
