"""Figures of methods on feet with exact truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import footfall
import numpy as np
from hmmlearn.hmm import GaussianHMM
from sklearn.metrics import f1_score, roc_auc_score

from .. import peers
from ..delays import Mask, Stances, closed, runs
from ..score import Answers, bins
from ..sets import Array
from .recorded import RATES, Foot, load
from .world import HUMANOID, QUADRUPEDS

FROM = 3.0
"""Figures are from this time on, s. A foot has learnt its first steps by then."""

SLIDES = (0.05, 0.02, 0.005)
"""Speed (m/s), duration (s) and distance (m) that a slide exceeds."""

LANDS, LIFTS = 0.06, 0.03
"""Parts of a stance without slides: after the landing and before the lift-off, s."""

OURS, SHOE, HMM, FORCE = "footfall", "SHOE, as published", "hidden Markov model", "force threshold"
METHODS = (OURS, SHOE, HMM, FORCE)


@dataclass(frozen=True, eq=False)
class Judgement:
    """Answers of a method on a foot."""

    foot: Foot
    p: Array
    ranking: Array
    decision: Mask
    slips: list[float]
    """Times of the reported slips, s."""


FIRST = ("trot", "walk")
"""First motion of a quadruped and of the humanoid."""


def judge_motions(of: tuple[str, list[str]]) -> list[dict[str, Judgement]]:
    """Answers of all methods on all feet of the robot with this name, in these motions and at all rates."""
    name, motions = of
    # The robot is looked up by its name, because a robot from another process would be a copy.
    robot = next(one for one in (*QUADRUPEDS, HUMANOID) if one.name == name)

    def key(foot: Foot) -> tuple[str, float]:
        return foot.foot, foot.recorded.recording.rate

    first = [foot for foot in load(robot, FIRST[robot is HUMANOID]) if key(foot)[1] == RATES[0]]
    states = {key(foot): peers.two_states(foot.recorded) for foot in first}
    return [judge(foot, states.get(key(foot))) for motion in motions for foot in load(robot, motion)]


def judge(foot: Foot, states: GaussianHMM | None) -> dict[str, Judgement]:
    """Answers of all methods. `states` are the states that the hidden Markov model has learnt from the first motion of the
    same foot; without them only our answers are returned."""
    recorded = foot.recorded
    recording = recorded.recording
    estimate = footfall.estimate(recording.acc, recording.gyr, recording.t)
    slips = [event.t for event in estimate.events() if event.kind == "slip_start"]
    p = estimate.p_stable.astype(np.float64)
    ours = {OURS: Judgement(foot, p, p, estimate.decision, slips)}
    if states is None:
        return ours
    shoe = peers.published_shoe(recorded)
    still = shoe > -peers.OPENSHOE_THRESHOLD
    markov = peers.quiet_state(states, recorded)
    load = foot.load.astype(np.float64)
    loaded = peers.schmitt_trigger(load)
    return ours | {
        SHOE: Judgement(foot, still.astype(np.float64), shoe, still, []),
        HMM: Judgement(foot, markov, markov, markov > 0.5, []),
        FORCE: Judgement(foot, loaded, load, loaded > 0.5, []),
    }


@dataclass
class Counts:
    """Slides and slips of any number of feet."""

    slides: int = 0
    """Slides in stances with P > ½ before."""
    fast: int = 0
    """Number of these slides that are faster than 0.1 m/s."""
    found: int = 0
    """Fast slides in which P falls below ½."""
    found_early: int = 0
    """The same, within 20 mm."""
    events: int = 0
    """Fast slides that are reported as slips."""
    slips: int = 0
    """Slips that are reported."""
    false_slips: int = 0
    """Of them, without a slide."""
    seconds: float = 0.0
    trusted: float = 0.0
    """Time of stable contact with P > ½, s."""
    decided: float = 0.0
    """Time of stable contact in which the decision is stable, s."""
    stable: float = 0.0
    """Time of stable contact, s."""

    def add(self, of: Judgement) -> None:
        rate, high = of.foot.recorded.recording.rate, of.p > 0.5
        first = round(FROM * rate)
        stable = of.foot.recorded.label[first:] == 1
        self.seconds += len(stable) / rate
        self.stable += float(stable.sum()) / rate
        self.trusted += float((stable & high[first:]).sum()) / rate
        self.decided += float((stable & of.decision[first:]).sum()) / rate
        loaded = closed(of.foot.is_loaded, rate)
        self._slides(of, loaded, rate, first)

    def _slides(self, of: Judgement, loaded: Mask, rate: float, first: int) -> None:
        speed, p = of.foot.slide.astype(np.float64), of.p
        found = slides(loaded, speed, rate)
        for begin, end in found:
            if begin < first or p[begin - 1] <= 0.5:
                continue
            self.slides += 1
            if speed[begin:end].max() < 0.1:
                continue
            self.fast += 1
            low = np.flatnonzero(p[begin:end] < 0.5)
            if len(low):
                self.found += 1
                self.found_early += float(speed[begin : begin + low[0]].sum()) / rate <= 0.02
            self.events += any(begin / rate - 0.05 <= t <= end / rate + 0.1 for t in of.slips)
        for t in of.slips:
            if t >= FROM:
                self.slips += 1
                self.false_slips += not any(begin / rate - 0.05 <= t <= end / rate + 0.1 for begin, end in found)


def figures(of: Sequence[Judgement]) -> dict[str, Any]:
    """Figures over all feet of some sets. In the RMSE, AUC, calibration and F1, each set has the same weight."""
    by_set: dict[tuple[str, str], list[Judgement]] = {}
    counts, stances = Counts(), Stances()
    for one in of:
        by_set.setdefault((one.foot.robot, one.foot.motion), []).append(one)
        counts.add(one)
        stances.add(one.foot.is_loaded, one.p, one.decision, one.foot.recorded.recording.rate, FROM)
    scores = [_scores(feet) for feet in by_set.values()]

    def mean(key: str) -> float | None:
        known = [value for value in (of[key] for of in scores) if value is not None]
        return round(float(np.mean(known)), 3) if known else None

    return {
        "sets": len(by_set),
        **{key: mean(key) for key in scores[0]},
        **stances.figures(),
        "trusted": round(counts.trusted / counts.stable, 3) if counts.stable else None,
        "decided": round(counts.decided / counts.stable, 3) if counts.stable else None,
        "slides": counts.slides,
        "fast_slides": counts.fast,
        "fast_slides_found": counts.found,
        "fast_slides_found_within_20_mm": counts.found_early,
        "fast_slides_reported": counts.events,
        "slips": counts.slips,
        "false_slips": counts.false_slips,
        "foot_minutes": round(counts.seconds / 60.0, 1),
    }


def _scores(feet: list[Judgement]) -> dict[str, float | None]:
    answers = Answers.together([after(one) for one in feet])
    label, p = answers.label == 1, answers.p
    probability, stable, samples = bins(answers.label, p)
    decision = np.concatenate([one.decision[_first(one) :] for one in feet])
    return {
        "rmse": float(np.sqrt(np.mean((p - label) ** 2))),
        # A foot that always stands has no ranking.
        "roc_auc": float(roc_auc_score(label, answers.ranking)) if 0 < label.sum() < len(label) else None,
        "calibration_error": float(np.average(np.abs(probability - stable), weights=samples)),
        "f1": float(f1_score(label, p > 0.5)),
        "decision_f1": float(f1_score(label, decision)),
    }


def after(one: Judgement) -> Answers:
    """Answers from `FROM` on."""
    first = _first(one)
    return Answers.of(one.foot.recorded.label[first:], one.p[first:], one.ranking[first:])


def is_long_enough(one: Judgement) -> bool:
    """Whether there are answers from `FROM` on, for at least a second."""
    return len(one.p) >= _first(one) + one.foot.recorded.recording.rate


def _first(one: Judgement) -> int:
    return round(FROM * one.foot.recorded.recording.rate)


def slides(loaded: Mask, speed: Array, rate: float) -> list[tuple[int, int]]:
    """First and last sample of each slide in the middle of a stance."""
    least, duration, distance = SLIDES
    found = []
    for begin, end in runs(loaded):
        inner = slice(begin + round(LANDS * rate), end - round(LIFTS * rate))
        for a, b in runs(closed(speed[inner] > least, rate)):
            a, b = a + inner.start, b + inner.start
            if b - a > duration * rate and float(speed[a:b].sum()) / rate > distance:
                found.append((a, b))
    return found
