"""Selection of parameters against labels."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import footfall

HALF_WIDTHS = "half_width.acceleration_m_s2"
GRID: dict[str, list[Any]] = {HALF_WIDTHS: [0.05, 0.4, 3.0], "window": ["20ms", "50ms"]}
CONFIG: dict[str, Any] = {"method": "half_widths", "half_width": {"angular_rate_rad_s": 0.1}}


@pytest.fixture(scope="module")
def walks() -> list[footfall.Simulation]:
    """Feet on three kinds of ground, which different parameters fit."""
    return [
        footfall.simulate("walk", 10.0, seed=1),
        footfall.simulate("trot", 10.0, seed=2, ground="soft"),
        footfall.simulate("walk", 10.0, seed=3, shaking=1.5),
    ]


def scored(walk: footfall.Simulation, config: footfall.Config | None = None) -> footfall.Score:
    assert walk.label is not None
    return footfall.score(walk.estimate(config=config), walk.label)


def figures(walks: list[footfall.Simulation], by: str) -> npt.NDArray[np.float64]:
    """The figure of each combination and recording, each estimated by itself."""
    table = []
    for half_width in GRID[HALF_WIDTHS]:
        for window in GRID["window"]:
            config = {
                "method": "half_widths",
                "half_width": {"angular_rate_rad_s": 0.1, "acceleration_m_s2": half_width},
                "window": window,
            }
            table.append([getattr(scored(walk, config), by) for walk in walks])
    return np.array(table)


@pytest.mark.parametrize("by", ["rmse", "roc_auc", "calibration_error"])
def test_best_mean_is_selected_and_each_recording_left_out(
    walks: list[footfall.Simulation], by: footfall.Figure
) -> None:
    chosen = footfall.select(walks, GRID, by=by, config=CONFIG)
    table = figures(walks, by)
    assert [candidate.mean for candidate in chosen.candidates] == pytest.approx(table.mean(axis=1))
    sign = -1.0 if by == "roc_auc" else 1.0
    best = int(np.argmin(sign * table.mean(axis=1)))
    assert chosen.best == chosen.candidates[best]
    assert dict(chosen.best.parameters) == {
        HALF_WIDTHS: GRID[HALF_WIDTHS][best // 2],
        "window": GRID["window"][best % 2],
    }
    unseen = []
    for place, left_out in enumerate(chosen.left_out):
        others = np.delete(table, place, axis=1).mean(axis=1)
        of_others = int(np.argmin(sign * others))
        assert left_out.parameters == chosen.candidates[of_others].parameters
        assert left_out.recording == walks[place].name
        assert getattr(left_out.score, by) == pytest.approx(table[of_others, place])
        unseen.append(table[of_others, place])
    assert len(unseen) == len(walks)
    assert chosen.left_out_mean == pytest.approx(np.mean(unseen))


def test_selected_configuration_gives_the_score_of_the_best(walks: list[footfall.Simulation]) -> None:
    chosen = footfall.select(walks, GRID, config=CONFIG)
    for walk, expected in zip(walks, chosen.best.scores):
        assert scored(walk, chosen.config) == expected
    # The configuration of the caller stays as it is.
    assert CONFIG["half_width"] == {"angular_rate_rad_s": 0.1}
    different = {tuple(left_out.parameters.items()) for left_out in chosen.left_out}
    assert len(different) > 1, "no recording has parameters of its own"


def test_single_recording_leaves_none_out(walks: list[footfall.Simulation]) -> None:
    chosen = footfall.select(walks[:1], {"method": ["self_calibrating"]})
    assert (chosen.left_out, chosen.left_out_mean) == ((), None)
    assert chosen.best.mean == scored(walks[0]).rmse


def test_unusable_arguments_are_refused_by_name(walks: list[footfall.Simulation]) -> None:
    unlabelled = dataclasses.replace(walks[1], label=None)
    one_label = dataclasses.replace(walks[1], label=np.ones(len(walks[1]), np.int8))
    refused: list[tuple[list[footfall.Simulation], dict[str, list[str]], Any, str]] = [
        ([], {}, "rmse", "recordings has no recording"),
        (walks, {"window": []}, "rmse", "grid has no value of window"),
        (walks, {}, "auc", "by is 'auc', but one of rmse, roc_auc, calibration_error"),
        ([walks[0], unlabelled], {}, "rmse", r"recordings\[1\], '.*', has no label"),
        ([one_label], {}, "roc_auc", "has only one label, and by is 'roc_auc'"),
        (walks, {"windw": ["1ms"]}, "rmse", "windw"),
    ]
    for recordings, grid, by, message in refused:
        with pytest.raises(ValueError, match=message):
            footfall.select(recordings, grid, by=by)
