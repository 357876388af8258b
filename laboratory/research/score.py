"""Figures of merit of a method on recordings whose samples are taken together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields

import numpy as np
import numpy.typing as npt
from sklearn.metrics import f1_score, roc_auc_score

from .sets import Array

BINS = 10


@dataclass(frozen=True, eq=False)
class Answers:
    """Answers of a method on a recording, at the samples with a label."""

    label: npt.NDArray[np.int8]
    p: Array
    """The probability; 1 or 0 of a detector."""
    ranking: Array
    """Score on which the answer is a threshold; the probability if there is no such score."""

    @classmethod
    def of(cls, label: npt.NDArray[np.int8], p: Array, ranking: Array | None = None) -> Answers:
        """Leaves out samples without a label, and samples at the end without an answer."""
        known = np.flatnonzero(label[: len(p)] >= 0)
        return cls(label[known], p[known], (p if ranking is None else ranking)[known])

    @classmethod
    def together(cls, answers: Sequence[Answers]) -> Answers:
        """Joins the samples of several recordings, which have equal weight."""
        return cls(*(np.concatenate([getattr(of, field.name) for of in answers]) for field in fields(cls)))


@dataclass(frozen=True)
class Figures:
    """Figures of a set, or their means over sets."""

    rmse: float
    """Root of the Brier score, the mean of (P − label)²."""
    roc_auc: float
    """Area under the receiver operating characteristic of the ranking."""
    f1: float
    """F1 of the answer "stable", P > 0.5."""
    calibration_error: float
    """Expected calibration error in ten bins; of a detector, its share of wrong answers."""
    false_stable: float
    """Share of the samples labelled not stable that are answered stable."""

    @classmethod
    def of(cls, answers: Sequence[Answers]) -> Figures:
        of = Answers.together(answers)
        label, p = of.label, of.p
        probability, stable, samples = bins(label, p)
        return cls(
            rmse=float(np.sqrt(np.mean((p - label) ** 2))),
            roc_auc=float(roc_auc_score(label, of.ranking)),
            f1=float(f1_score(label, p > 0.5)),
            calibration_error=float(np.average(np.abs(probability - stable), weights=samples)),
            false_stable=float(np.mean(p[label == 0] > 0.5)),
        )

    @classmethod
    def mean(cls, sets: Sequence[Figures]) -> Figures:
        return cls(*np.mean([astuple(of) for of in sets], axis=0).tolist())


def bins(label: npt.NDArray[np.int8], p: Array) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Mean probability, share of stable samples, and number of samples in each bin. Bins have equal widths, and empty
    bins are left out."""
    place = np.minimum((p * BINS).astype(np.int64), BINS - 1)
    samples = np.bincount(place, minlength=BINS)
    filled = samples > 0
    probability, stable = (np.bincount(place, of, minlength=BINS)[filled] / samples[filled] for of in (p, label))
    return probability, stable, samples[filled]


def shares(of: Answers) -> dict[str, list[float | None]]:
    """For each of ten ranges of P: the share of its samples that are stable, None if it has no samples, and its share
    of all samples."""
    place = np.minimum((of.p * BINS).astype(np.int64), BINS - 1)
    samples, stable = np.bincount(place, minlength=BINS), np.bincount(place, of.label, minlength=BINS)
    return {
        "stable": [round(float(a / b), 2) if b else None for a, b in zip(stable, samples, strict=True)],
        "samples": [round(float(b / len(place)), 3) for b in samples],
    }
