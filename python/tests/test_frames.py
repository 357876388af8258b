"""Results as tables and pictures, scores against labels, the classifier, and messages in words of Python."""

from __future__ import annotations

import inspect
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest

import footfall

TABLES = pytest.mark.parametrize("library", ["pandas", "polars"])


@TABLES
def test_frame_has_the_columns_of_arrow(walk: footfall.Recording, library: str) -> None:
    pytest.importorskip(library)
    result = walk.estimate()
    frame = getattr(result, f"to_{library}")()
    table = result.to_arrow()
    assert list(frame.columns) == table.column_names
    for name in table.column_names:
        assert list(frame[name]) == table[name].to_pylist(), name
    assert "flag_bits" in table.column_names and np.array_equal(frame["flag_bits"].to_numpy(), result.flags)


def test_pandas_reads_every_column_as_an_attribute(walk: footfall.Recording) -> None:
    frame = walk.estimate().to_pandas()
    for name in frame.columns:
        assert np.array_equal(getattr(frame, name).to_numpy(), frame[name].to_numpy()), name


def test_plot_draws_the_probability(walk: footfall.Recording) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    result = walk.estimate()
    ax = result.plot()
    [line] = ax.lines
    assert np.array_equal(line.get_ydata(), result.p_stable)
    assert result.plot(ax) is ax
    pyplot.close("all")


def test_score_is_that_of_the_program(program: str, tmp_path: Path) -> None:
    walk = footfall.simulate("walk", 30.0, seed=2)
    assert walk.label is not None
    parquet.write_table(walk.to_arrow(), tmp_path / "walk.parquet")
    command = [program, "replay", str(tmp_path / "walk.parquet"), "--json"]
    output = subprocess.run(command, check=True, capture_output=True)
    [summary] = json.loads(output.stdout)["recordings"]
    row = summary["metrics"]
    found = footfall.score(walk.estimate(), walk.label)
    assert found.samples == row["labelled_samples"]
    assert found.rmse == pytest.approx(row["rmse"], rel=1e-9)
    assert found.roc_auc == pytest.approx(row["roc_auc"], rel=1e-9)
    assert found.calibration_error == pytest.approx(row["calibration_error"], rel=1e-9)


def test_score_takes_known_labels_alone() -> None:
    assert footfall.score([0.5, 1.0, 0.0], [np.nan, 1, -1]) == footfall.Score(1, 0.0, None, 0.0)
    tied = footfall.score([0.5, 0.5, 0.25, 1.0], [1, 0, 0, 1])
    assert tied.roc_auc == pytest.approx(3.5 / 4) and tied.rmse == pytest.approx(np.sqrt(0.5625 / 4))
    for p, label, message in (
        ([0.5], [-1], "known for no sample"),
        ([0.5], [2], "label is 2, but 1, 0 or -1"),
        ([1.5], [1], "not in"),
        ([0.5], [1, 0], r"shape \(2,\), but p has \(1,\)"),
    ):
        with pytest.raises(ValueError, match=message):
            footfall.score(p, label)


def test_classifier_has_the_estimate_of_a_warm_start(walk: footfall.Recording) -> None:
    X = np.hstack([walk.acc, walk.gyr])
    cold = footfall.ContactClassifier(rate=1000.0)
    assert np.array_equal(cold.predict_proba(X)[:, 1], footfall.estimate(walk.acc, walk.gyr, rate=1000.0).p_stable)
    warm = footfall.ContactClassifier(rate=1000.0).fit(X)
    calibration = footfall.calibrate(walk)
    assert set(warm.calibration_.config) == set(calibration.config)
    proba = warm.predict_proba(X)
    config = warm.calibration_.config
    expected = footfall.estimate(walk.acc, walk.gyr, rate=1000.0, config=config).p_stable
    assert np.array_equal(proba[:, 1], expected) and not np.array_equal(proba, cold.predict_proba(X))
    assert proba.shape == (len(walk), 2) and np.allclose(proba.sum(axis=1), 1.0)
    assert np.array_equal(warm.predict(X), proba[:, 1] > 0.5)
    assert walk.label is not None and warm.score(X, walk.label) > 0.85
    with pytest.raises(ValueError, match="no label is 0 or 1"):
        warm.score(X, np.full(len(walk), np.nan))


@pytest.mark.parametrize("is_file", [False, True])
def test_classifier_keeps_its_configuration(tmp_path: Path, walk: footfall.Recording, is_file: bool) -> None:
    # Gravity is removed as if the foot did not turn.
    acc, gyr = walk.acc - np.array([0.0, 0.0, 9.81], dtype=np.float32), walk.gyr
    config: dict[str, Any] = {
        "gravity": "removed",
        "decision": {"threshold": 0.7},
        "accelerometer": {"scale": {"ax": 1.5}},
    }
    given: Any = config
    if is_file:
        given = tmp_path / "robot.toml"
        given.write_text('gravity = "removed"\ndecision.threshold = 0.7\naccelerometer.scale.ax = 1.5\n')
    X = np.hstack([acc, gyr])
    warm = footfall.ContactClassifier(rate=1000.0, config=given).fit(X)
    kept = warm.calibration_.config
    assert {name: kept[name] for name in config} == config and "learnt" in kept
    learnt = {"learnt": kept["learnt"]}
    proba = warm.predict_proba(X)[:, 1]
    assert np.array_equal(proba, footfall.estimate(acc, gyr, rate=1000.0, config=config | learnt).p_stable)
    assert not np.array_equal(proba, footfall.estimate(acc, gyr, rate=1000.0, config=learnt).p_stable)


def test_classifier_has_the_parameters_of_its_constructor() -> None:
    one = footfall.ContactClassifier(rate=500.0, preset="paper")
    assert set(one.get_params()) == set(inspect.signature(footfall.ContactClassifier).parameters)
    other = footfall.ContactClassifier().set_params(**one.get_params())
    assert repr(other) == repr(one) and other.get_params() == one.get_params()
    with pytest.raises(ValueError, match="'C' is unknown, but one of rate, preset"):
        other.set_params(C=1)
    with pytest.raises(ValueError, match=r"X has the shape \(3,\), but \(N, 6\)"):
        other.predict([1.0, 2.0, 3.0])
    sklearn = pytest.importorskip("sklearn.base")
    assert sklearn.clone(one).get_params() == one.get_params()


def test_errors_and_findings_name_arguments(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_text("ax,ay,az,wx,wy,wz\n" + 50 * "0,0,1,0,0,0\n")
    for read in (footfall.read, footfall.estimate_file):
        with pytest.raises(ValueError, match="it must be given: rate="):
            read(path)
    [recording] = footfall.read(path, rate=100.0)
    [finding] = recording.estimate().findings
    assert 'units="g"' in finding.message
    path.write_text("t,acc_x [g],acc_y,acc_z,gyr_x,gyr_y,gyr_z\n0,0,0,1,0,0,0\n0.01,0,0,1,0,0,0\n")
    with pytest.raises(ValueError, match='would be read in m/s2: units="g,rad/s"$'):
        footfall.read(path)
    path.write_text("t,ax,ay,az,wx,wy,wz\n0,0,0,1,0,0,0\n0,0,0,1,0,0,0\n")
    with pytest.raises(ValueError, match='leave such rows out with times="drop-bad", or smooth'):
        footfall.read(path)
    with pytest.raises(ValueError, match='topic=, not_topic=, frame= and load_topic= are for mcap, rosbag2 and rosbag1'):
        footfall.read(path, topic="/imu")


def arguments_in(message: str) -> set[str]:
    """Arguments that a message names."""
    return set(re.findall(r"\b([a-z_]+)=", message))


def test_remedies_of_arrays_can_be_typed(walk: footfall.Recording) -> None:
    known = set(inspect.signature(footfall.estimate).parameters)
    acc, gyr, t = walk.acc, walk.gyr, walk.t
    turned, signs = [0, 2, 1], [1, 1, -1]
    batches = t - np.arange(len(t)) % 2 * 0.0008
    gap = t + np.where(np.arange(len(t)) > len(t) // 2, 30.0, 0.0)
    cases: list[tuple[str, str, footfall.Result]] = [
        ("acceleration_in_g", "acc * 9.80665 is in m/s²", footfall.estimate(acc / 9.80665, gyr, t)),
        ("acceleration_in_other_unit", "multiply counts by their value", footfall.estimate(acc * 100, gyr, t)),
        ("rate_in_degrees", "np.radians(gyr) is in rad/s", footfall.estimate(acc, np.degrees(gyr), t)),
        ("exchanged_sensors", "exchange acc and gyr", footfall.estimate(gyr, acc, t)),
        ("left_handed", "gyr[:, [0, 2, 1]] exchange them", footfall.estimate(acc[:, turned], gyr[:, turned], t)),
        ("left_handed", "-gyr repairs it", footfall.estimate(acc, -gyr, t)),
        ("gravity_not_along_z", 'axes="', footfall.estimate(acc[:, turned] * signs, gyr[:, turned] * signs, t)),
        ("gravity_included", 'gravity="included"', footfall.estimate(acc, gyr, t, gravity="removed")),
        ("batches", "leave out t and give rate=", footfall.estimate(acc, gyr, batches)),
        ("clock_jumps", "samples are missing, or leave out t and give rate=", footfall.estimate(acc, gyr, gap)),
    ]
    for name, remedy, result in cases:
        [message] = [finding.message for finding in result.findings if finding.name == name]
        assert remedy in message, message
        assert arguments_in(message) <= known, message


def test_a_data_frame_has_the_remedies_of_arrays(walk: footfall.Recording) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(np.hstack([walk.acc / 9.80665, walk.gyr]), columns=["ax", "ay", "az", "wx", "wy", "wz"])
    result = footfall.estimate(frame[["ax", "ay", "az"]], frame[["wx", "wy", "wz"]], rate=walk.rate)
    [finding] = result.findings
    assert finding.message.endswith("acc * 9.80665 is in m/s²")


def test_times_in_smaller_units_are_named(tmp_path: Path, walk: footfall.Recording) -> None:
    for words, per_second in (("milliseconds", "1e3"), ("microseconds", "1e6"), ("nanoseconds", "1e9")):
        # From 0, and since 1970.
        for start in (0, 1_700_000_000):
            t = (start * 1000 + np.arange(len(walk))) * (float(per_second) / 1e3)
            for rate in (None, 1000.0):
                with pytest.raises(ValueError, match=f"t looks like {words}: t / {per_second} is in s$"):
                    footfall.estimate(walk.acc, walk.gyr, t, rate=rate)
    rows = "".join(f"{2_000_000 * k},0,0,9.81,0,0,0\n" for k in range(5000))
    path = tmp_path / "walk.csv"
    path.write_text("t,ax,ay,az,wx,wy,wz\n" + rows)
    for estimate in (footfall.read, footfall.estimate_file):
        with pytest.raises(ValueError, match='column t looks like nanoseconds, but is read in s: time_unit="ns"$'):
            estimate(path)
    path.write_text("t,ax,ay,az,wx,wy,wz\n" + rows[:1500])
    with pytest.raises(ValueError, match='column t looks like nanoseconds, but is read in s: time_unit="ns"$'):
        footfall.estimate_file(path)


def test_the_window_of_the_paper_names_the_configuration(tmp_path: Path) -> None:
    path = tmp_path / "walk.parquet"
    # At a quarter of the paper's rate.
    parquet.write_table(footfall.simulate("walk", 5.0).to_arrow().take(np.arange(0, 5000, 4)), path)
    [result] = footfall.estimate_file(path, preset="paper")
    [notice] = [notice for notice in result.notices if "window" in notice]
    found = re.search(r"config=(\{.*\})", notice)
    assert found is not None, notice
    config = json.loads(found[1])
    [other] = footfall.estimate_file(path, preset="paper", config=config)
    assert not any("window" in notice for notice in other.notices)
