"""Figures of a probability against labels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._arrays import floats
from ._result import Result

BINS = 10
"""Number of bins of the calibration error over [0, 1]."""


@dataclass(frozen=True)
class Score:
    """Figures of a probability against labels, the same as in ``footfall replay``."""

    samples: int
    """Number of samples with a label."""
    rmse: float
    """Root mean square error of the probability, in [0, 1], best 0."""
    roc_auc: float | None
    """Probability that a stable sample ranks above one that is not, in [0, 1], best 1; ``None`` if only one
    label occurs."""
    calibration_error: float
    """Mean distance of the probability from the share of stable samples in ten bins of equal width, weighted by
    their samples, in [0, 1], best 0."""


def score(p: Result | npt.ArrayLike, label: npt.ArrayLike) -> Score:
    """Compares a probability with labels.

    Parameters
    ----------
    p : Result or array_like, shape (N,)
        The probability of stable contact; of a result, :attr:`Result.p_stable`.
    label : array_like, shape (N,)
        The truth: 1 stable, 0 not; -1 or a missing value where it is not known, as
        :attr:`Recording.label`.

    Raises
    ------
    ValueError
        The shapes differ, a label or probability is out of its range, or no label is known.
    TypeError
        An argument is not an array of numbers.
    """
    probability = np.asarray(floats("p", p.p_stable if isinstance(p, Result) else p), dtype=np.float64)
    truth = np.asarray(floats("label", label), dtype=np.float64)
    if probability.ndim != 1 or truth.shape != probability.shape:
        raise ValueError(f"label has the shape {truth.shape}, but p has {probability.shape}")
    is_known = ~(np.isnan(truth) | (truth == -1.0))
    probability, truth = probability[is_known], truth[is_known]
    if not len(truth):
        raise ValueError("label is known for no sample")
    if not np.isin(truth, (0.0, 1.0)).all():
        wrong = truth[~np.isin(truth, (0.0, 1.0))][0]
        raise ValueError(f"label is {wrong:g}, but 1, 0 or -1 is expected")
    if not ((probability >= 0.0) & (probability <= 1.0)).all():
        raise ValueError("p has values that are not in [0, 1]")
    place = np.minimum((probability * BINS).astype(np.int64), BINS - 1)
    apart = np.bincount(place, probability - truth, minlength=BINS)
    return Score(
        samples=len(truth),
        rmse=float(np.sqrt(np.mean((probability - truth) ** 2))),
        roc_auc=_roc_auc(probability, truth == 1.0),
        calibration_error=float(np.abs(apart).sum() / len(truth)),
    )


def _roc_auc(probability: npt.NDArray[np.float64], is_stable: npt.NDArray[np.bool_]) -> float | None:
    """Mann and Whitney's U over all pairs, ties counting half."""
    stable = int(is_stable.sum())
    pairs = stable * (len(is_stable) - stable)
    if not pairs:
        return None
    _, place, counts = np.unique(probability, return_inverse=True, return_counts=True)
    mean_ranks = np.cumsum(counts) - (counts - 1) / 2.0
    return float((mean_ranks[place][is_stable].sum() - stable * (stable + 1) / 2.0) / pairs)
