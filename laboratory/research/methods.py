"""The methods that are compared: their answers on each recording, and their figures on sets of recordings.

No method reads a label of the recording on which it is scored. But the constants of the default preset were chosen by its
RMSE on these recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import peers
from .resample import resample
from .score import Answers, Figures
from .sets import NO_TEACHER, Array, Labelled

OTHERS, FAMILY = "tuned on other families", "tuned on its family"

DEFAULT, WARM, FROZEN = "footfall, default preset", "footfall, warm start", "footfall, nothing learnt"
PAPER, AUTHORS = "footfall, paper preset", "authors' script (looks ahead)"
SHOE, ARED = "SHOE / GLRT, as published", "ARED, as published"
HMM = "hidden Markov model of the amplitude"
ADAPTIVE = f"SHOE, adaptive threshold, {OTHERS}"
TRIGGER, FUZZY = "force Schmitt trigger 10/5 %", "fuzzy c-means, force and IMU"

RATES = (100.0, 390.0, 500.0, 1000.0, 1660.0)
"""Sample rates at which the default preset is scored, Hz. Recordings at 100 Hz or less are not decimated to 100 Hz."""

Runs = list[Answers | None]
"""Answers on each recording; none if the recording lacks a signal that the method needs."""


class Evaluation:
    """Figures of all methods on any sets."""

    def __init__(self, files: list[Labelled]) -> None:
        self.files = files
        self.runs = run(files)

    def answers(self, method: str, sets: Sequence[str]) -> list[Answers] | None:
        runs = [run for file, run in zip(self.files, self.runs[method], strict=True) if file.set in sets]
        answers = [run for run in runs if run is not None]
        return answers if len(answers) == len(runs) else None

    def pooled(self, method: str, sets: Sequence[str]) -> Figures | None:
        """Figures over all samples of sets; none if the method cannot run on one."""
        answers = self.answers(method, sets)
        return None if answers is None else Figures.of(answers)

    def mean(self, method: str, sets: Sequence[str]) -> Figures | None:
        """Mean of the figures of sets; none if the method cannot run on one."""
        figures = [self.pooled(method, [name]) for name in sets]
        known = [of for of in figures if of is not None]
        return Figures.mean(known) if len(known) == len(figures) else None


def run(files: list[Labelled]) -> dict[str, Runs]:
    """All methods, in the order of tables."""
    methods: dict[str, Runs] = {
        DEFAULT: [_footfall(file) for file in files],
        **{f"{DEFAULT}, at {rate:.0f} Hz": [_at_rate(file, rate) for file in files] for rate in RATES},
        WARM: [_warm(file, files[_unlabelled(files, k)]) for k, file in enumerate(files)],
        FROZEN: [_footfall(file, config={"learning": "frozen"}) for file in files],
        PAPER: [
            _footfall(file, preset="paper", config={"window": f"{1e3 * peers.PAPER_WINDOW:.0f}ms"}) for file in files
        ],
        AUTHORS: [_probability(file, peers.authors_script(file)) for file in files],
        SHOE: [_published(file, peers.published_shoe) for file in files],
        ARED: [_published(file, peers.published_ared) for file in files],
    }
    scores = {detector: [of(file) for file in files] for detector, of in peers.TUNED.items()}
    for teachers in (OTHERS, FAMILY):
        for detector, of_files in scores.items():
            methods[f"{detector}, {teachers}"] = _tuned(files, of_files, teachers)
    methods[ADAPTIVE] = _adaptive(files)
    methods[HMM] = [
        _probability(file, peers.hidden_markov(files[_unlabelled(files, k)], file)) for k, file in enumerate(files)
    ]
    shares = [file.load_share for file in files]
    methods[TRIGGER] = [
        _probability(file, None if share is None else peers.schmitt_trigger(share))
        for file, share in zip(files, shares, strict=True)
    ]
    methods[FUZZY] = [
        _probability(file, peers.fuzzy_c_means(files[_unlabelled(files, k)], file)) for k, file in enumerate(files)
    ]
    return methods


def _probability(file: Labelled, p: Array | None) -> Answers | None:
    return None if p is None else Answers.of(file.label, p)


def _footfall(file: Labelled, **settings: Any) -> Answers:
    return Answers.of(file.label, file.recording.estimate(**settings).p_stable.astype(np.float64))


def _at_rate(file: Labelled, rate: float) -> Answers | None:
    if max(rate, file.recording.rate) <= RATES[0]:
        return None
    recording = resample(file.recording, rate)
    assert recording.label is not None
    return Answers.of(recording.label, recording.estimate().p_stable.astype(np.float64))


def _warm(file: Labelled, learnt_on: Labelled) -> Answers:
    """Estimates with a warm start: the values learnt by the end of another recording."""
    learnt = [float(value) for value in learnt_on.recording.estimate().learnt]
    names = ("still", "moving", "speed", "still_seconds", "moving_seconds")
    return _footfall(file, config={"learnt": {"version": 1, **dict(zip(names, learnt, strict=True))}})


def _published(file: Labelled, scores: Callable[[Labelled], Array]) -> Answers:
    ranking = scores(file)
    return Answers.of(file.label, (ranking > -peers.OPENSHOE_THRESHOLD).astype(np.float64), ranking)


def _tuned(files: list[Labelled], scores: list[Array | None], teachers: str) -> Runs:
    runs: Runs = []
    # All recordings of a family have the same teachers, because teachers come from other families.
    thresholds: dict[tuple[int, ...], float] = {}
    for k, (file, ranking) in enumerate(zip(files, scores, strict=True)):
        from_files = tuple(other for other in _teachers(files, k, teachers) if scores[other] is not None)
        if ranking is None or not from_files:
            runs.append(None)
            continue
        if from_files not in thresholds:
            thresholds[from_files] = peers.threshold(_by_family(files, scores, from_files))
        runs.append(Answers.of(file.label, (ranking > thresholds[from_files]).astype(np.float64), ranking))
    return runs


def _adaptive(files: list[Labelled]) -> Runs:
    """SHOE with an adaptive threshold, whose two constants have the fewest wrong answers on all other families."""
    mistakes = [peers.adaptive_mistakes(file) for file in files]
    runs: Runs = []
    for k, file in enumerate(files):
        families: dict[str, list[int]] = {}
        for other in _teachers(files, k, OTHERS):
            families.setdefault(files[other].family, []).append(other)
        by_family = [
            np.average([mistakes[k] for k in of], axis=0, weights=[len(files[k].label) for k in of])
            for of in families.values()
        ]
        wrong = np.sum(by_family, axis=0)
        best, growth = np.unravel_index(int(np.argmin(wrong)), wrong.shape)
        constants = peers.ADAPTIVE_THRESHOLDS[[best]], peers.ADAPTIVE_GROWTHS[[growth]]
        statistic = peers.shoe(file, file.samples_in(peers.PAPER_WINDOW), peers.PAPER_BANDWIDTH)
        stable, limits = peers.adaptive_shoe(statistic, 1.0 / file.recording.rate, *constants)
        ranking = -np.log(statistic + 1.0e-9) + np.log(limits[:, 0])
        runs.append(Answers.of(file.label, stable[:, 0].astype(np.float64), ranking))
    return runs


def _by_family(
    files: list[Labelled], scores: list[Array | None], indices: tuple[int, ...]
) -> list[tuple[Array, npt.NDArray[np.int8]]]:
    families: dict[str, list[Answers]] = {}
    for k in indices:
        ranking = scores[k]
        assert ranking is not None
        families.setdefault(files[k].family, []).append(Answers.of(files[k].label, ranking))
    return [
        (np.concatenate([answers.p for answers in of]), np.concatenate([answers.label for answers in of]))
        for of in families.values()
    ]


def _teachers(files: list[Labelled], index: int, teachers: str) -> list[int]:
    """Recordings whose labels may tune a method for the one at `index`."""
    if teachers == FAMILY:
        return _relatives(files, index)[:1]
    family = files[index].family
    return [k for k, file in enumerate(files) if file.family != family and file.set not in NO_TEACHER]


def _relatives(files: list[Labelled], index: int) -> list[int]:
    return [k for k, file in enumerate(files) if k != index and file.family == files[index].family]


def _unlabelled(files: list[Labelled], index: int) -> int:
    """The recording to learn from without labels: another one of the same robot, or itself if there is no other."""
    relatives = _relatives(files, index)
    if files[index].family in ("LCD", "robots"):
        # Each set is from another robot.
        relatives = [k for k in relatives if files[k].set == files[index].set]
    return relatives[0] if relatives else index
