"""Selection of parameters against labels."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Literal

from ._recording import Recording
from ._score import Score, score
from ._settings import Preset

Figure = Literal["rmse", "roc_auc", "calibration_error"]

FIGURES: dict[Figure, float] = {"rmse": 1.0, "roc_auc": -1.0, "calibration_error": 1.0}
"""The figures, with 1 where less is better and -1 where more is."""


@dataclass(frozen=True)
class Candidate:
    """A combination of the grid, and its figures."""

    parameters: Mapping[str, Any]
    """Values by the keys of the grid."""
    scores: tuple[Score, ...]
    """Figures of each recording."""
    mean: float
    """Mean of the selected figure over the recordings, each of which counts the same."""


@dataclass(frozen=True)
class LeftOut:
    """A recording, with the parameters that score best on all others."""

    recording: str
    """Name of the recording."""
    parameters: Mapping[str, Any]
    """Parameters that are selected on the other recordings."""
    score: Score
    """Figures of this recording with them."""


@dataclass(frozen=True)
class Selection:
    """Parameters that fit labels best, and their score on recordings that did not take part in their selection."""

    by: Figure
    """Figure that selects."""
    best: Candidate
    """Combination with the best mean; the first in the grid if several are equal."""
    config: Mapping[str, Any]
    """Configuration with it, for ``config=``."""
    candidates: tuple[Candidate, ...]
    """All combinations, in the order of the grid: the last key varies first."""
    left_out: tuple[LeftOut, ...]
    """Each recording with parameters selected on the others; empty for a single recording."""
    left_out_mean: float | None
    """Mean of the figure over the recordings left out, an estimate for new recordings. ``None`` for a single
    recording."""


def select(
    recordings: Sequence[Recording],
    grid: Mapping[str, Sequence[Any]],
    *,
    by: Figure = "rmse",
    preset: Preset = "default",
    config: Mapping[str, Any] | None = None,
    workers: int | None = None,
) -> Selection:
    """Selects parameters by a figure of :func:`score` against the labels of recordings.

    Every combination of the grid estimates every recording. Each recording is then left out once: the parameters that
    are best on the other recordings are scored on it. If the mean is much better than the mean over the recordings
    left out, the parameters fit these recordings only.

    The figures score `p_stable`, so keys that change only the decision, the state or `sigma_v` have no effect on
    them.

    Parameters
    ----------
    recordings
        With labels, as :func:`read` or :func:`simulate` return them.
    grid
        Values to try, by keys of the configuration, such as ``{"half_width.acceleration_m_s2": [0.2, 0.4]}``;
        ``footfall config`` lists all keys.
    by
        Figure that selects: ``"rmse"`` or ``"calibration_error"``, the less the better, or ``"roc_auc"``.
    preset, config
        As in :func:`footfall.estimate`; the grid overrides them.
    workers
        Number of threads; by default as Python's ``ThreadPoolExecutor`` chooses.

    Raises
    ------
    ValueError
        There is no recording or no value of a key, a recording has no label or a single one with ``by="roc_auc"``, or
        a parameter is invalid.

    Examples
    --------
    >>> import footfall
    >>> walks = [footfall.simulate("walk", seconds=10.0, seed=seed) for seed in (1, 2)]
    >>> chosen = footfall.select(walks, {"method": ["self_calibrating", "half_widths"]})
    >>> chosen.best.parameters, len(chosen.left_out)
    ({'method': 'self_calibrating'}, 2)
    """
    if by not in FIGURES:
        raise ValueError(f"by is {by!r}, but one of {', '.join(FIGURES)} is expected")
    if not recordings:
        raise ValueError("recordings has no recording")
    for key, values in grid.items():
        if not len(values):
            raise ValueError(f"grid has no value of {key}")
    for place, recording in enumerate(recordings):
        if recording.label is None or not (recording.label >= 0).any():
            raise ValueError(f"recordings[{place}], {recording.name!r}, has no label")
    combinations = [dict(zip(grid, values)) for values in itertools.product(*grid.values())]
    configs = [_merged(config or {}, parameters) for parameters in combinations]

    def scored(job: tuple[Recording, dict[str, Any]]) -> Score:
        recording, chosen = job
        assert recording.label is not None
        return score(recording.estimate(preset=preset, config=chosen), recording.label)

    with ThreadPoolExecutor(workers) as pool:
        jobs = [(recording, chosen) for chosen in configs for recording in recordings]
        scores = list(pool.map(scored, jobs))
    count = len(recordings)
    by_combination = [tuple(scores[k * count : (k + 1) * count]) for k in range(len(configs))]
    figures = [[_figure(s, by, r) for s, r in zip(of_all, recordings)] for of_all in by_combination]
    candidates = tuple(
        Candidate(parameters, of_all, sum(row) / count)
        for parameters, of_all, row in zip(combinations, by_combination, figures)
    )

    def best_of(rows: Sequence[Sequence[float]]) -> int:
        """Returns the index of the combination with the best mean, the first of several that are equal."""
        means = [FIGURES[by] * sum(row) / len(row) for row in rows]
        return means.index(min(means))

    left_out, unseen = [], []
    for place in range(count if count > 1 else 0):
        others = [[figure for k, figure in enumerate(row) if k != place] for row in figures]
        chosen = best_of(others)
        name = recordings[place].name
        left_out.append(LeftOut(name, combinations[chosen], by_combination[chosen][place]))
        unseen.append(figures[chosen][place])
    best = best_of(figures)
    return Selection(
        by=by,
        best=candidates[best],
        config=configs[best],
        candidates=candidates,
        left_out=tuple(left_out),
        left_out_mean=sum(unseen) / len(unseen) if unseen else None,
    )


def _figure(of: Score, by: Figure, recording: Recording) -> float:
    """The figure that selects."""
    figure: float | None = getattr(of, by)
    if figure is None:
        raise ValueError(f"{recording.name!r} has only one label, and by is {by!r}")
    return figure


def _merged(config: Mapping[str, Any], parameters: Mapping[str, Any]) -> dict[str, Any]:
    """A configuration with other values of keys, in which a dot separates tables."""
    merged = {key: dict(value) if isinstance(value, Mapping) else value for key, value in config.items()}
    for key, value in parameters.items():
        table: dict[str, Any] = merged
        *tables, last = key.split(".")
        for name in tables:
            inner = table.get(name)
            # Copy the table, because it may belong to the caller's configuration.
            table[name] = dict(inner) if isinstance(inner, Mapping) else {}
            table = table[name]
        table[last] = value
    return merged
