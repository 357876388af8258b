"""Scores the default estimate and three other methods in MuJoCo, on robots of which only two helped choose a constant.

`python -m research.bench`, in the folder `laboratory`, writes `results/bench.json` and `results/bench-velocity.json`;
docs/reference/robots-nobody-tuned-on.md describes them. With --check it writes nothing, prints the differences, and
fails if a figure is beyond its bound. With --smoke it simulates and scores one short motion of one robot. Motions
already simulated are read from `target/bench`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from multiprocessing import get_context
from typing import Any

from ..results import Result, write
from ..score import Answers, shares
from . import velocity
from .judged import METHODS, OURS, Judgement, after, figures, is_long_enough, judge_motions
from .recorded import RATES, sets
from .world import HUMANOID, JUDGES, QUADRUPEDS

COMMAND = "python -m research.bench"

TROTS = ("trot", "fast trot", "turns", "rough", "steps", "soft")

GROUPS: dict[str, tuple[str, ...]] = {
    "trots": TROTS,
    "slippery": ("slippery",),
    "crawl": ("crawl",),
    "stand": ("stand",),
    "stand, ripple": ("stand, ripple",),
    "stand and move": ("stand and move",),
    "trot, stand and move, trot": ("trot, stand and move, trot",),
    "picked up by hand": ("picked up by hand",),
    "lifted by a crane": ("lifted by a crane",),
}
"""Motions of the quadrupeds by rows of the tables."""

OF_HUMANOID: dict[str, tuple[str, ...]] = {
    "humanoid: walks": ("walk", "fast walk", "turns", "soft"),
    "humanoid: stand": ("stand", "stand, ripple"),
    "humanoid: stand and move": ("stand and move",),
    "humanoid: walk, stand and move, walk": ("walk, stand and move, walk",),
    "humanoid: picked up by hand": ("picked up by hand",),
    "humanoid: lifted by a crane": ("lifted by a crane",),
}

BOUNDS = {("trots", "rmse"): 0.35, ("trots", "calibration_error"): 0.1, ("humanoid: walks", "rmse"): 0.4}
"""Most that a figure of ours may be at 1 kHz. A simulation of another processor may fall in other steps, so no figure
must be equal."""

Judged = dict[str, Judgement]


def select(
    feet: Sequence[Judged], rate: float, motions: Sequence[str], robots: Sequence[str], method: str
) -> list[Judgement]:
    # A robot that falls in the first seconds has no figures. The result names it.
    found = [of[method] for of in feet if method in of and is_long_enough(of[method])]
    return [
        one
        for one in found
        if one.foot.recorded.recording.rate == rate and one.foot.motion in motions and one.foot.robot in robots
    ]


def rows(feet: Sequence[Judged]) -> list[dict[str, Any]]:
    """Figures by motion, rate and method, and by robot for our method."""
    quadrupeds = [robot.name for robot in QUADRUPEDS]
    found = []
    for groups, robots in ((GROUPS, quadrupeds), (OF_HUMANOID, [HUMANOID.name])):
        for group, motions in groups.items():
            for rate in RATES:
                # The lower rate is scored for ours alone.
                for method in METHODS if rate == RATES[0] else (OURS,):
                    chosen = select(feet, rate, motions, robots, method)
                    if chosen:
                        found.append(
                            {"motion": group, "rate_hz": rate, "method": method, "robot": "all"} | figures(chosen)
                        )
    for robot in quadrupeds:
        for group in ("trots", "crawl", "stand and move"):
            chosen = select(feet, RATES[0], GROUPS[group], [robot], OURS)
            if chosen:
                found.append({"motion": group, "rate_hz": RATES[0], "method": OURS, "robot": robot} | figures(chosen))
    return found


def of_bench(feet: Sequence[Judged], robots: list[str]) -> Result:
    what = "Scores on robots of MuJoCo with exact truth, from three seconds on. The judges were in view when some constants were chosen."
    fallen = sorted({f"{one.foot.robot}, {one.foot.motion}" for of in feet for one in of.values() if one.foot.fell})
    ours = [of[OURS] for of in feet if of[OURS].foot.recorded.recording.rate == RATES[0]]
    walks = [one for one in ours if one.foot.motion in (*TROTS, *OF_HUMANOID["humanoid: walks"], "crawl")]
    values = {
        "robots": robots,
        "judges": list(JUDGES),
        "fallen": fallen,
        "reliability": shares(Answers.together([after(one) for one in walks])),
    }
    return Result("bench", what, COMMAND, values=values, rows=rows(feet))


def of_velocity(found: Sequence[tuple[str, dict[str, Any]]]) -> Result:
    what = "Velocity of the base and drift of its position in a minute, with four ways to trust a foot."
    return Result("bench-velocity", what, COMMAND, rows=[{"robot": robot} | of for robot, of in found])


def beyond(result: Result) -> list[str]:
    """Figures beyond their bounds."""
    problems = []
    for (motion, key), most in BOUNDS.items():
        for row in result.rows:
            is_ours = (row["motion"], row["method"], row["robot"], row["rate_hz"]) == (motion, OURS, "all", RATES[0])
            if is_ours and row[key] > most:
                problems.append(f"{key} of {motion} is {row[key]}, not at most {most:g}")
    return problems


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="print what differs, and write nothing")
    parser.add_argument("--robots", help="names with commas between them; all if none is given")
    parser.add_argument("--smoke", action="store_true", help="one short motion of one robot")
    parser.add_argument("--processes", type=int, default=2, help="default: 2")
    arguments = parser.parse_args()
    known = {robot.name: robot for robot in (*QUADRUPEDS, HUMANOID)}
    names = arguments.robots.split(",") if arguments.robots else list(known)
    for name in names:
        if name not in known:
            parser.error(f"no robot is named {name!r}: {', '.join(known)}")
    robots = [known[name] for name in names]
    chosen = [
        (robot.name, [motion for of, motion in sets() if of is robot and motion != velocity.MOTION]) for robot in robots
    ]
    quadrupeds = [robot for robot in robots if robot is not HUMANOID]
    if arguments.smoke:
        chosen = [(QUADRUPEDS[0].name, ["trot"])]
    with get_context("spawn").Pool(arguments.processes) as pool:
        feet = [foot for of in pool.imap(judge_motions, chosen, chunksize=1) for foot in of]
        velocities = [] if arguments.smoke else pool.map(velocity.of_base, quadrupeds, chunksize=1)
    result = of_bench(feet, [robot.name for robot in robots])
    if arguments.smoke:
        for row in result.rows:
            print({key: row[key] for key in ("motion", "rate_hz", "method", "rmse", "roc_auc", "stances", "lost")})
        return int(bool(beyond(result)))
    measured = [result, of_velocity(velocities)]
    for difference in (difference for one in measured for difference in one.differences()):
        print(difference)
    if not arguments.check:
        write(measured)
    problems = beyond(result)
    for problem in problems:
        print(problem, file=sys.stderr)
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
