"""One recording of a batch, as a machine of a cluster estimates it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.dataset as ds
import pytest

import footfall
from footfall import _footfall
from footfall._settings import BatchDict, IdentityDict, read_options, settings

BATCH: BatchDict = {"window": None, "strict": False, "only_foot": None}

IDENTITY: IdentityDict = {
    "name": "logs/spot 1/fl.csv",
    "robot": "spot 1",
    "foot": None,
    "day": "2024-05-01",
}

SETTINGS = settings("default", None, None, None)

OPTIONS = read_options()


def write_walk(path: Path) -> footfall.Recording:
    walk = footfall.simulate("walk", seconds=6.0, seed=4)
    assert walk.t is not None and walk.load is not None
    columns = np.column_stack([walk.t, walk.acc, walk.gyr, walk.load])
    header = "t,ax,ay,az,wx,wy,wz,force"
    np.savetxt(path, columns, delimiter=",", header=header, comments="", fmt="%.17g")
    return walk


def test_a_recording_is_written_as_partitions_that_pyarrow_reads(tmp_path: Path) -> None:
    path = tmp_path / "copy.csv"
    write_walk(path)
    out = tmp_path / "out"
    text = _footfall.batch_recording(str(path), IDENTITY, OPTIONS, SETTINGS, BATCH, str(out))
    (row,) = json.loads(text)
    assert row["status"] == "done" and row["samples"] == 6000
    assert (row["robot"], row["foot"], row["day"]) == ("spot 1", "fl", "2024-05-01")
    assert row["key"] == _footfall.batch_key("logs/spot 1/fl.csv")
    assert row["settings_blake3"] == _footfall.batch_settings_hash(OPTIONS, SETTINGS, BATCH)

    (recording,) = footfall.read(str(path))
    estimate = recording.estimate()
    samples = ds.dataset(out / "samples", partitioning="hive").to_table()
    assert samples["robot"].unique().to_pylist() == ["spot 1"]
    assert samples["day"].unique().to_pylist() == ["2024-05-01"]
    assert samples["recording"].unique().to_pylist() == ["logs/spot 1/fl.csv"]
    p_stable = samples["p_stable"].to_numpy()
    assert p_stable.dtype == np.float32
    np.testing.assert_array_equal(p_stable, estimate.p_stable)

    events = ds.dataset(out / "events", partitioning="hive").to_table().to_pylist()
    assert sum(event["event"] == "touch_down" for event in events) == row["steps"] > 3

    (found,) = ds.dataset(out / "recordings", partitioning="hive").to_table().to_pylist()
    for name, value in row.items():
        if isinstance(value, float):
            assert found[name] == pytest.approx(value, rel=1e-6), name
        else:
            assert found[name] == value, name


def test_a_recording_that_fails_is_a_row_and_no_exception(tmp_path: Path) -> None:
    path = tmp_path / "copy.csv"
    path.write_text("t,ax\n0,0\n")
    out = str(tmp_path / "out")
    (row,) = json.loads(_footfall.batch_recording(str(path), IDENTITY, OPTIONS, SETTINGS, BATCH, out))
    assert row["status"] == "failed"
    assert row["error"].startswith("logs/spot 1/fl.csv, line 1: missing")


def test_arguments_are_checked(tmp_path: Path) -> None:
    wrong: IdentityDict = {**IDENTITY, "day": "May"}
    with pytest.raises(ValueError, match="invalid day"):
        _footfall.batch_recording("x.csv", wrong, OPTIONS, SETTINGS, BATCH, str(tmp_path))
