"""Switches the parts of the default estimate off, one at a time.

`python -m research.ablate [--tests] [part …]`, in the folder `laboratory`. A part is switched off in the source: the
committed files are copied to `target/ablation`, one expression is replaced, and the extension is built there. So no
switch is part of the estimate.

For each part it prints the change of the RMSE without the part, as recorded and at 1 kHz, on seven sets, on real
robots, and on two groups of feet that the search of the constants did not use. A positive number is the gain of the
part. With `--tests` it also lists the tests of behaviour that fail without the part, which takes minutes for each part.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .sets import AVERAGED, FURTHER, ROBOTS, ROOT, WALKERS

PRODUCT = 1000.0
"""Sample rate of a foot, Hz."""

GROUPS = {"seven": AVERAGED, "robots": ROBOTS, "more": list(FURTHER), "walkers": list(WALKERS)}
"""Sets whose RMSE is averaged. The search of the constants did not use the last two."""

COPY = ROOT / "target/ablation"

SOURCES = Path("estimator-core/src")

BEHAVIOURS = [
    "learning::", "hanging::", "robustness::", "slip::", "events::", "feet::", "attitude::", "drift::", "ringing::",
]  # fmt: skip
"""Tests of `host-tests` on behaviour, beside all of `footfall-estimator`."""


@dataclass(frozen=True)
class Part:
    """A part of the estimate, and how to switch it off."""

    name: str
    file: str
    find: str
    """Occurs once in the file."""
    replace: str

    def off(self, source: str) -> str:
        """The file without the part."""
        if source.count(self.find) != 1:
            raise ValueError(f"{self.name}: {self.file} has {source.count(self.find)} times: {self.find}")
        return source.replace(self.find, self.replace)


MODEL, REST, ATTITUDE, BIAS = "self_calibrating.rs", "rest.rs", "attitude.rs", "gyro_bias.rs"

PARTS = [
    # Stillness and turn.
    Part("turn", MODEL, "constants.turn_weight > 0.0", "constants.turn_weight > 1.0e9"),
    Part("turn: firm stances are not excused", MODEL, "self.has_stood_firmly && turn_below > 0.0", "false"),
    Part("turn: limited distances", MODEL, "x.greater(-most).lesser(most);", "x.greater(-most * 1.0e9);"),
    Part("turn: weight by the variances", MODEL, "(separation * acceleration_variance)", "(separation * variance)"),
    # Slide.
    Part("slide", MODEL, "1.0 / (1.0 + ratio * ratio)", "1.0 / (1.0 + 0.0 * ratio)"),
    Part("slide: rolling", MODEL, "+ rolling * rolling +", "+"),
    Part("slide: relative to swings", MODEL, "exp(self.usual + louder)", "exp(self.usual + 0.0 * louder)"),
    Part("slide: false idea of up", MODEL, "+ tilted * tilted;", "+ 0.0 * tilted;"),
    Part("slide: apparent acceleration", MODEL, "level - self.apparent.clipped(explained)", "level - self.apparent.clipped(0.0)"),
    Part("slide: limited acceleration", MODEL, "level.clipped(constants.slide_acceleration)", "level.clipped(1.0e9)"),
    Part("slide: learnt speed", MODEL, "self.usual += difference *", "self.usual += 0.0 * difference *"),
    # Evidence.
    Part("evidence", MODEL, "if self.is_given { 1.0 } else { UNPROVEN }", "1.0"),
    Part("evidence: rest", MODEL, "since(lands || has_rested,", "since(lands,"),
    Part("evidence: swing before a landing", MODEL, "let lands = fall.lands && has_moved;", "let lands = fall.lands;"),
    Part("landing: lost speed", MODEL, "begins && has_lost_speed);", "begins);"),
    Part("landing: corrections of up", MODEL, "self.corrected += STANDARD_GRAVITY", "self.corrected += 0.0"),
    Part("rest: change of the acceleration", REST,
         "            && is_within(acceleration_change, constants.rest_acceleration_change)\n", ""),
    Part("rest: change of the rate", REST, "is_within(rate_change, constants.rest_rate_change);", "rate_change.x < 1.0e9;"),
    Part("rest: small rate", REST, "            && is_within(self.rate.newest, constants.turn_noise)\n", ""),
    # Learning.
    Part("learning: only with evidence", MODEL, "self.learning == Learning::Frozen || !may_learn",
         "self.learning == Learning::Frozen"),
    Part("learning: first part of a stance", MODEL, "            || walks_slowly\n", "            || walks_slowly || true\n"),
    Part("learning: slow walks", MODEL, "            || walks_slowly\n", "            || false & walks_slowly\n"),
    Part("learning: whole stance after a landing", MODEL, "|| self.evidence.fell_within(2.0 * self.constants.stance)", ""),
    Part("learning: doubt after a landing without a stance", MODEL, "if !self.stood {", "if false {"),
    Part("bridged gaps", MODEL, "missing > (self.window / 2).max(1)", "missing > 0"),
    # Up, gravity and bias.
    Part("up: restart after wrong first samples", ATTITUDE, "has_force && self.age < LAST_RESTART &&", "false &&"),
    Part("up: guessed turn in gaps", ATTITUDE, "} else if seconds <= longest_guess {",
         "} else if seconds <= 0.0 * longest_guess {"),
    Part("up: doubt after a guessed turn", ATTITUDE, "self.raise_towards(TURN_GUESSED, share.lesser(1.0));",
         "self.raise_towards(1.0e9, 1.0);"),
    Part("up: doubt with the rate", ATTITUDE, "const RATE_DOUBT: f32 = 0.1;", "const RATE_DOUBT: f32 = 0.0;"),
    Part("up: doubt with the change of rate", ATTITUDE, "const TURN_DOUBT: f32 = 1.0;", "const TURN_DOUBT: f32 = 0.0;"),
    Part("up: doubt after a clipped force", ATTITUDE, "self.raise_towards(ACCELEROMETER_CLIPPED,",
         "self.raise_towards(1.0e9,"),
    Part("up: doubt after a clipped rate", ATTITUDE, "self.raise_towards(TURN_UNKNOWN, dt /", "self.raise_towards(1.0e9, dt /"),
    Part("up: quietness", REST, "* self.coefficients.least_noise).lesser(1.0)",
         "* self.coefficients.least_noise).lesser(1.0).greater(1.0)"),
    Part("up: quietness by the rate", REST, "deviation * deviation + rate * rate;", "deviation * deviation + 0.0 * rate;"),
    Part("gravity", ATTITUDE, "self.set(self.value + (reading - self.value) * share);",
         "self.set(self.value + 0.0 * (reading - self.value) * share);"),
    Part("gravity: from the first samples", ATTITUDE, "            self.set(force);\n", "            self.set(self.value + 0.0 * force);\n"),
    Part("gravity: from a walk", ATTITUDE, "self.approach(upward, dt / Self::MOTION_TIME_CONSTANT);",
         "self.approach(upward, 0.0 * dt / Self::MOTION_TIME_CONSTANT);"),
    Part("bias: from a walk", ATTITUDE, "if self.correcting >= FOLLOWS_EVERY {", "if self.correcting >= 1.0e9 {"),
    Part("bias: walks that contradict a rest", BIAS, "> CONTRADICTED * CONTRADICTED {", "> 1.0e9 * CONTRADICTED {"),
    Part("bias: rest undoes corrections", BIAS, "since_rest.dot(since_rest) < gate * gate {",
         "since_rest.dot(since_rest) < 0.0 * gate {"),
    Part("bias: gate that opens", BIAS, "let gate = GATE + self.opening;", "let gate = GATE + 0.0 * self.opening;"),
    Part("bias: contradictions must last", BIAS, "let contradicts = self.learnt > KNOWN_AFTER &&",
         "let contradicts = self.learnt > 1.0e9 &&"),
    Part("rest: gravity stays", REST, "            && !self.sways();", "            ;"),
]  # fmt: skip


def score() -> dict[str, float]:
    """Mean RMSE of each group, as recorded and at the rate of a foot."""
    from .resample import resample
    from .sets import SETS, load

    SETS.update(FURTHER | WALKERS)
    squares: dict[tuple[str, str, str], list[float]] = {}
    for group, names in GROUPS.items():
        for file in load(names):
            for rate in ("native", "1 kHz"):
                recording = file.recording
                if rate == "1 kHz" and recording.rate < 0.9 * PRODUCT:
                    recording = resample(recording, PRODUCT)
                assert recording.label is not None
                p = recording.estimate().p_stable
                known = recording.label >= 0
                of = squares.setdefault((group, rate, file.set), [0.0, 0.0])
                of[0] += float(np.sum((p[known] - recording.label[known]) ** 2))
                of[1] += float(known.sum())
    result: dict[str, float] = {}
    for group in GROUPS:
        for rate in ("native", "1 kHz"):
            of_sets = [math.sqrt(a / b) for (g, r, _), (a, b) in squares.items() if (g, r) == (group, rate)]
            result[f"{group}, {rate}"] = sum(of_sets) / len(of_sets)
    return result


def copy() -> None:
    """Copies the committed files, and keeps the results of earlier builds."""
    COPY.mkdir(parents=True, exist_ok=True)
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    subprocess.run(["tar", "--extract", "--directory", str(COPY)], input=archive, check=True)


def cargo(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"FOOTFALL_DATASETS": os.path.abspath(_datasets())}
    command = ["cargo", *arguments]
    return subprocess.run(command, cwd=COPY, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def _datasets() -> Path:
    from .sets import DATASETS

    return DATASETS


def scored() -> dict[str, float]:
    """Builds the extension of the copy, and scores it."""
    built = cargo("build", "--release", "--package", "footfall-python")
    if built.returncode:
        raise RuntimeError(built.stdout)
    package = COPY / "python/package"
    shutil.copy(COPY / "target/release/lib_footfall.so", package / "footfall/_footfall.abi3.so")
    environment = os.environ | {"PYTHONPATH": str(package), "FOOTFALL_DATASETS": os.path.abspath(_datasets())}
    command = [sys.executable, "-m", "research.ablate", "--score"]
    output = subprocess.run(command, cwd=COPY / "laboratory", env=environment, check=True, stdout=subprocess.PIPE).stdout
    found: dict[str, float] = json.loads(output)
    return found


def failures() -> list[str]:
    """Names of the tests of behaviour that fail in the copy."""
    core = cargo("test", "--package", "footfall-estimator", "--lib", "--no-fail-fast")
    hosts = cargo("test", "--package", "host-tests", "--test", "thorough", "--no-fail-fast", "--", *BEHAVIOURS)
    if "test result" not in hosts.stdout:
        raise RuntimeError(hosts.stdout)
    return sorted(set(re.findall(r"^test (\S+) \.\.\. FAILED$", core.stdout + hosts.stdout, re.MULTILINE)))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", help="names of parts; all if none is given")
    parser.add_argument("--tests", action="store_true", help="also run the tests of behaviour")
    parser.add_argument("--score", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.score:
        print(json.dumps(score()))
        return 0
    known = {part.name: part for part in PARTS}
    unknown = [name for name in arguments.parts if name not in known]
    if unknown:
        parser.error(f"no part is named {unknown[0]!r}: {', '.join(known)}")
    copy()
    whole = scored()
    print("| part | " + " | ".join(whole) + (" | tests that fail |" if arguments.tests else " |"))
    print("|---" * (len(whole) + 1 + arguments.tests) + "|")
    print("| RMSE with all parts | " + " | ".join(f"{rmse:.4f}" for rmse in whole.values()) + " |", flush=True)
    for part in [known[name] for name in arguments.parts] or PARTS:
        path = COPY / SOURCES / part.file
        source = path.read_text(encoding="utf-8")
        path.write_text(part.off(source), encoding="utf-8")
        try:
            without = scored()
            cells = [f"{without[group] - rmse:+.4f}" for group, rmse in whole.items()]
            if arguments.tests:
                cells.append(", ".join(failures()) or "none")
        finally:
            path.write_text(source, encoding="utf-8")
        print(f"| {part.name} | " + " | ".join(cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
