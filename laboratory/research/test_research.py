"""Tests formulas whose errors would not be visible in the figures."""

from __future__ import annotations

import json

import footfall
import numpy as np
import pytest

from . import ablate, choose, odometry, peers
from .resample import resample
from .results import ROOT, Result
from .score import Answers, Figures, bins
from .sets import Array, Labelled


def labelled(acc: Array, gyr: Array, rate: float = 200.0, gravity: str = "included") -> Labelled:
    recording = footfall.Recording(
        name="made", foot=None, format="csv", rate=rate, gravity=gravity, t=np.arange(len(acc)) / rate,  # type: ignore[arg-type]
        acc=acc.astype(np.float32), gyr=gyr.astype(np.float32), load=None, label=np.ones(len(acc), np.int8),
        validity=np.zeros(len(acc), np.uint8), notices=(),
    )  # fmt: skip
    return Labelled("made", "made", recording)


def test_shoe_removes_gravity_along_the_mean_force() -> None:
    g = peers.GRAVITY
    tilted = labelled(np.tile([0.6 * g, 0.0, -0.8 * g], (3, 1)), np.zeros((3, 3)))
    assert peers.shoe(tilted, 2, (1.0, 0.1)) == pytest.approx(0.0, abs=1e-4)
    aside = labelled(np.array([[0.5, 0.0, g], [-0.5, 0.0, g]]), np.array([[0.3, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert peers.shoe(aside, 2, (1.0, 0.1))[1] == pytest.approx(0.25 + 4.5, abs=1e-4)


def test_ared_rests_below_17_degrees_per_second() -> None:
    for degrees, rests in ((17.0, True), (18.0, False)):
        turning = labelled(np.zeros((50, 3)), np.tile([np.radians(degrees), 0.0, 0.0], (50, 1)))
        assert (peers.published_ared(turning)[-1] > -peers.OPENSHOE_THRESHOLD) == rests


def test_mbgtd_equals_its_definition() -> None:
    window = np.random.default_rng(1).normal(size=(7, 3))
    n = len(window)
    weights = [
        sum(np.linalg.norm(window[i] - window[j]) for i in range(s + 1) for j in range(t, n)) / ((t - s) * (n - t + 1))
        for t in range(1, n)
        for s in range(t)
    ]
    assert peers.heaviest_cut(window[None]) == pytest.approx(max(weights), rel=1e-5)


def test_threshold_weights_groups_equally() -> None:
    # Alone, the long group has its threshold at 2, the short one at 5.
    long = (np.tile([1.0, 3.0], 50), np.tile(np.array([0, 1], np.int8), 50))
    short = (np.array([3.0, 4.0, 6.0]), np.array([0, 0, 1], np.int8))
    assert peers.threshold([long, short]) == 5.0
    assert peers.threshold([long]) == 2.0
    assert peers.threshold([(np.array([-3.0, 2.0]), np.array([1, 1], np.int8))]) < -3.0
    assert peers.threshold([(np.array([-3.0, 2.0]), np.array([0, 0], np.int8))]) >= 2.0


def test_adaptive_threshold_grows_from_the_last_stance() -> None:
    statistic = np.array([1.0, 9.0, 9.0, 9.0, 9.0])
    stable, limits = peers.adaptive_shoe(statistic, 0.5, np.array([4.0, 4.0]), np.array([0.0, 1.0]))
    assert stable[:, 0].tolist() == [True, False, False, False, False]
    # γ (1 + Δt): 4 + 2 per sample.
    assert limits[:, 1].tolist() == [4.0, 4.0, 6.0, 8.0, 10.0]
    assert stable[:, 1].tolist() == [True, False, False, False, True]


def test_hidden_markov_model_finds_the_quiet_state() -> None:
    random = np.random.default_rng(1)
    moves = np.arange(4000) // 200 % 2 == 1
    acc = random.normal(size=(4000, 3)) * np.where(moves, 8.0, 0.4)[:, None]
    file = labelled(acc, np.zeros((4000, 3)), gravity="removed")
    p = peers.hidden_markov(file, file)
    assert np.mean((p > 0.5) == ~moves) > 0.98
    # A sample does not change the answers before it.
    start = labelled(acc[:1100], np.zeros((1100, 3)), gravity="removed")
    assert peers.hidden_markov(file, start) == pytest.approx(p[:1100])


def test_schmitt_trigger_keeps_its_state_between_levels() -> None:
    shares = np.array([0.0, 0.07, 0.1, 0.07, 0.05, 0.049, 0.07])
    assert peers.schmitt_trigger(shares).tolist() == [0, 0, 1, 1, 1, 0, 0]


def test_authors_script_sees_motion_before_it_begins() -> None:
    step = np.where(np.arange(300)[:, None] < 200, 0.0, 9.0) * np.ones(3)
    p = peers.authors_script(labelled(step, step, 1000.0, "removed"))
    assert p is not None and len(p) == 250
    assert p[150] > 0.9 and p[175] < 0.1


def test_each_part_can_be_switched_off() -> None:
    for part in ablate.PARTS:
        source = (ROOT / ablate.SOURCES / part.file).read_text(encoding="utf-8")
        assert part.off(source) != source


def test_resampling_keeps_slow_motion_and_removes_aliases() -> None:
    t = np.arange(2000) / 1000.0

    def largest(frequency: float, rate: float) -> float:
        wave = np.sin(2.0 * np.pi * frequency * t)[:, None] * np.ones(3)
        return float(np.abs(resample(labelled(wave, wave, 1000.0).recording, rate).acc[1:-1]).max())

    # 210 Hz would alias to 10 Hz.
    assert largest(5.0, 100.0) > 0.99 and largest(210.0, 100.0) < 0.03 and largest(5.0, 1660.0) > 0.99


def test_resampling_takes_the_label_of_the_sample_before() -> None:
    recording = labelled(np.zeros((2000, 3)), np.zeros((2000, 3)), 1000.0).recording
    assert recording.label is not None
    recording.label[:1000] = 0
    for rate in (100.0, 390.0, 1660.0):
        converted = resample(recording, rate)
        assert np.array_equal(converted.label == 1, converted.t >= 1.0)


def test_error_is_of_the_answers_and_auc_of_the_ranking() -> None:
    label = np.array([0, 1, 1, 0, -1], np.int8)
    answers = Answers.of(label, np.array([0.0, 0.0, 1.0, 0.0, 1.0]), np.array([-9.0, -3.0, -2.0, -8.0, 0.0]))
    figures = Figures.of([answers])
    assert (figures.rmse, figures.roc_auc, figures.calibration_error) == (0.5, 1.0, 0.25)


def test_bin_includes_its_lower_end_and_the_last_one_also_1() -> None:
    probability, stable, samples = bins(np.array([0, 1, 1], np.int8), np.array([0.05, 0.1, 1.0]))
    assert samples.tolist() == [1, 1, 1] and stable.tolist() == [0, 1, 1] and probability.tolist() == [0.05, 0.1, 1.0]


def test_stance_removes_a_drift() -> None:
    # A bias of 0.1 m/s² drifts 20 cm in 2 s; the second filter has measurements at the end.
    acc = np.tile([0.0, 0.0, 9.8], (220, 1))
    acc[20:, 0] = 0.1
    sigmas = np.full((220, 2), odometry.NO_MEASUREMENT)
    sigmas[215:, 1] = odometry.YES
    with np.errstate(invalid="ignore"):
        positions, _ = odometry.navigate(acc, np.zeros((220, 3)), 0.01, sigmas)
    assert positions[-1, 0, 0] == pytest.approx(0.2, abs=0.01)
    assert abs(positions[-1, 1, 0]) < 0.03


def test_heading_and_start_do_not_affect_the_error() -> None:
    truth = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 3.0, 0.0]])
    turned = np.stack([7.0 - truth[:, 1], 5.0 + truth[:, 0], truth[:, 2] - 3.0], axis=1)
    mirrored = truth * [1.0, -1.0, 1.0]
    turned_error, mirrored_error = odometry.position_errors(np.stack([turned, mirrored], axis=1), truth)
    assert turned_error < 1e-9 < 0.1 < mirrored_error


def test_result_file_has_the_format_of_those_that_rust_writes() -> None:
    for name in ("gate", "methods", "attitude"):
        text = (ROOT / f"laboratory/results/{name}.json").read_text(encoding="utf-8")
        of = json.loads(text)
        result = Result(name, of["what"], of["command"], of.get("values", {}), of["rows"], of.get("machine"))
        assert result.text(of["commit"], of["date"]) == text
        assert result.differences() == []


def test_differing_figure_is_named_with_its_place() -> None:
    of = json.loads((ROOT / "laboratory/results/attitude-peers.json").read_text(encoding="utf-8"))
    rows = [{**row, "mean_deg": 9.0} if k == 1 else row for k, row in enumerate(of["rows"])]
    [difference] = Result("attitude-peers", "", "", rows=rows).differences()
    assert difference.startswith("laboratory/results/attitude-peers.json.rows[VQF].mean_deg is 9.0, not")


def test_search_draws_again_where_a_constant_is_out_of_its_range(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = labelled(np.tile([0.0, 0.0, peers.GRAVITY], (100, 1)), np.zeros((100, 3)))
    judged = choose.Judged("made", "made", recording)

    def by_robot(judged: list[choose.Judged], changed: list[tuple[str, float]]) -> dict[str, tuple[float, float]]:
        # The least value is at 1.2, where the constant is refused.
        for one in judged:
            one.figures(changed)
        return {"made": (abs(dict(changed)["turn_settled"] - 1.2), 0.0)}

    monkeypatch.setattr(choose, "by_robot", by_robot)
    found = dict(choose.search([judged], 120))["turn_settled"]
    assert 0.9 < found <= 1.0
