"""Trees of recordings on Ray: one row for each foot, and no recording is estimated twice."""

from __future__ import annotations

import contextlib
import glob
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fsspec
import numpy as np
import pyarrow
import pyarrow.parquet as parquet
import pytest

import footfall
from conftest import rows as rows_of_the_program
from footfall import fleet
from test_bits import assert_same, write
from test_files import bag

ray = pytest.importorskip("ray")


@pytest.fixture(scope="module", autouse=True)
def local_ray() -> Iterator[None]:
    """Ray with two workers on this machine."""
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, object_store_memory=100 << 20)
    yield
    ray.shutdown()


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[set[str]]:
    """The names of the recordings that each call had to estimate."""
    calls: list[set[str]] = []
    run = fleet._run

    def watched(recordings: Any, *others: Any) -> Any:
        calls.append({os.path.basename(recording.name) for recording in recordings})
        return run(recordings, *others)

    monkeypatch.setattr(fleet, "_run", watched)
    return calls


def write_parquet(walk: footfall.Recording, path: Path) -> Path:
    """Writes a recording as a table of Parquet."""
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(walk.to_arrow(), path)
    return path


def tree(folder: Path, robots: int = 2) -> Path:
    """Robots with two feet each, and a file that looks like a recording."""
    for robot in range(robots):
        for place, foot in enumerate(("L", "R")):
            walk = footfall.simulate("trot", 6.0, seed=10 * robot + place, rests=(2.0, 1.0))
            write_parquet(walk, folder / f"robot{robot}" / f"{foot}.parquet")
    (folder / "robot1" / "poisoned.parquet").write_bytes(b"PAR1" + bytes(1000) + b"PAR1")
    (folder / "robot1" / "notes.md").write_text("no recording")
    return folder


def by_foot(table: pyarrow.Table) -> dict[tuple[str, str], dict[str, Any]]:
    return {(row["robot"], row["foot"]): row for row in table.to_pylist()}


def test_row_has_the_figures_of_the_result(tmp_path: Path) -> None:
    source = tree(tmp_path / "logs")
    found = by_foot(fleet.estimate(source, tmp_path / "out"))
    assert set(found) == {("robot0", "L"), ("robot0", "R"), ("robot1", "L"), ("robot1", "R"), ("robot1", "poisoned")}
    row = found["robot0", "R"]
    [result] = footfall.estimate_file(source / "robot0/R.parquet")
    kinds = [event.kind for event in result.events()]
    states = result.state_names()
    expected = {
        "recording": str(source / "robot0/R.parquet"),
        "status": "done",
        "error": None,
        "day": None,
        "version": footfall.__version__,
        "samples": 6000,
        "duration_s": result.t[-1] - result.t[0],
        "sample_rate_hz": 1000.0,
        "stance_s": np.sum(states == "stance") / 1000.0,
        "stable_s": result.decision.sum() / 1000.0,
        "steps": kinds.count("touch_down"),
        "slips": kinds.count("slip_start"),
        "settling_samples": result.has_flag("settling").sum(),
        "edge_m_s2": result.edge,
        "gyro_bias_start_wx_rad_s": result.first_gyro_bias[0],
        "gyro_bias_end_wz_rad_s": result.gyro_bias[-1, 2],
        "findings": [finding.name for finding in result.findings],
    }
    assert {name: row[name] for name in expected} == expected
    assert row["steps"] > 3 and row["gyro_bias_start_wx_rad_s"] != row["gyro_bias_end_wx_rad_s"] != 0.0


def test_unreadable_recording_is_a_row_with_its_error(tmp_path: Path, asked: list[set[str]]) -> None:
    source = tree(tmp_path / "logs")
    row = by_foot(fleet.estimate(source, tmp_path / "out"))["robot1", "poisoned"]
    assert row["status"] == "refused" and "poisoned.parquet is damaged" in row["error"] and row["steps"] is None
    # A damaged recording stays so; a missing one is tried again.
    (source / "robot0" / "gone.csv").symlink_to("nowhere.csv")
    for _ in range(2):
        row = by_foot(fleet.estimate(source, tmp_path / "out"))["robot0", "gone"]
        assert row["status"] == "failed" and "gone.csv" in row["error"]
    assert asked[1:] == [{"gone.csv"}, {"gone.csv"}]


def test_samples_have_the_bits_of_the_program(program: str, tmp_path: Path) -> None:
    walk = footfall.simulate("walk", 10.0, seed=3)
    (tmp_path / "logs").mkdir()
    write(walk, tmp_path / "logs/FL.csv")
    [row] = fleet.estimate(tmp_path / "logs", tmp_path / "out", samples=True).to_pylist()
    table = parquet.read_table(tmp_path / "out" / row["samples_file"])
    [result] = footfall.estimate_file(tmp_path / "logs/FL.csv")
    expected = rows_of_the_program(program, "logs/FL.csv", cwd=tmp_path)
    assert_same(result, expected)
    assert table.drop_columns(["recording", "robot", "foot"]).equals(result.to_arrow())
    assert set(table["foot"].to_pylist()) == {"FL"}


def test_bags_and_tables_of_a_tree_keep_their_options(tmp_path: Path) -> None:
    feet = {name: footfall.simulate("walk", 3.0, seed) for seed, name in enumerate(["FL", "FR"])}
    bag(tmp_path / "logs/spot/monday", feet, 2500)
    write_parquet(feet["FL"], tmp_path / "logs/spot/RL.parquet")
    options: Any = {"topic": "all", "load_topic": "/{foot}/ft:force.z"}
    found = by_foot(fleet.estimate(tmp_path / "logs", tmp_path / "out", time_unit="s", **options))
    assert {key: row["status"] for key, row in found.items()} == dict.fromkeys(
        [("spot", "FL"), ("spot", "FR"), ("spot", "RL")], "done"
    )
    assert found["spot", "FL"]["recording"] == found["spot", "FR"]["recording"] == str(tmp_path / "logs/spot/monday")
    assert found["spot", "FL"]["day"] == "2023-11-14" and found["spot", "RL"]["day"] is None
    assert {row["steps"] > 0 for row in found.values()} == {True}


def test_path_names_robot_foot_and_day(tmp_path: Path) -> None:
    walk = footfall.simulate("walk", 3.0, seed=1)
    for foot in ("fl", "fr"):
        write_parquet(walk, tmp_path / f"logs/site/spot-3/2026-05-01/run1_{foot}.parquet")
    write_parquet(walk, tmp_path / "logs/other.parquet")
    axes = "fl=x,y,z,fr=-x,-y,z"
    pattern = "**/{robot}/{day}/*_{foot}.parquet"
    found = by_foot(fleet.estimate(tmp_path / "logs", tmp_path / "out", pattern=pattern, axes=axes))
    assert set(found) == {("spot-3", "fl"), ("spot-3", "fr")}
    assert {row["day"] for row in found.values()} == {"2026-05-01"}
    [turned] = footfall.estimate_file(tmp_path / "logs/other.parquet", axes="-x,-y,z")
    assert found["spot-3", "fr"]["gyro_bias_end_wx_rad_s"] == turned.gyro_bias[-1, 0]
    assert found["spot-3", "fl"]["gyro_bias_end_wx_rad_s"] == -turned.gyro_bias[-1, 0]
    for wrong in ("{leg}.csv", "{foot}/{foot}.csv"):
        with pytest.raises(ValueError, match="pattern"):
            fleet.estimate(tmp_path / "logs", tmp_path / "out", pattern=wrong)


def test_second_call_does_what_is_missing_or_changed(tmp_path: Path, asked: list[set[str]]) -> None:
    source, out = tree(tmp_path / "logs"), tmp_path / "out"
    first = fleet.estimate(source, out)
    assert fleet.estimate(source, out).equals(first) and len(asked) == 1
    write_parquet(footfall.simulate("trot", 5.0, seed=99), source / "robot0/L.parquet")
    write_parquet(footfall.simulate("trot", 5.0, seed=98), source / "robot2/new.parquet")
    found = by_foot(fleet.estimate(source, out))
    assert asked[1] == {"L.parquet", "new.parquet"}
    assert found["robot0", "L"]["samples"] == found["robot2", "new"]["samples"] == 5000
    # Rows of recordings that a call does not name stay.
    config = tmp_path / "config.toml"
    config.write_text("decision.on_delay_s = 0.05\n")
    assert fleet.estimate(source / "robot0", out, config=config).num_rows == 2
    assert asked[2] == {"L.parquet", "R.parquet"}
    assert fleet.estimate([source / "robot0"], out, config={"decision": {"on_delay_s": 0.06}}).num_rows == 2
    assert asked[3] == asked[2] and parquet.read_table(out / fleet.ROWS).num_rows == 6


def test_interrupted_call_leaves_the_rows_of_what_is_done(tmp_path: Path, asked: list[set[str]]) -> None:
    source, out = tree(tmp_path / "logs"), tmp_path / "out"
    rows = fleet.estimate(source, out)
    # As if the process had ended before it merged the rows into one file, and a worker in the middle of a file.
    (out / fleet.NEW).mkdir()
    parquet.write_table(rows.slice(0, 3), out / fleet.NEW / "0.parquet")
    (out / fleet.NEW / "1.parquet").write_bytes((out / fleet.NEW / "0.parquet").read_bytes()[:2000])
    (out / fleet.ROWS).unlink()
    assert fleet.estimate(source, out).equals(rows)
    assert len(asked[1]) == rows.num_rows - 3 and os.listdir(out) == [fleet.ROWS]


def readers(path: Path) -> set[int]:
    """The other processes that have a file open."""
    pids = set()
    for link in glob.glob("/proc/[0-9]*/fd/*"):
        with contextlib.suppress(OSError):
            if os.readlink(link) == str(path):
                pids.add(int(link.split("/")[2]))
    return pids - {os.getpid()}


@contextlib.contextmanager
def deadly(path: Path, most: int) -> Iterator[list[int]]:
    """Replaces a recording by a pipe, and kills up to `most` of the processes that wait to read it."""
    contents = path.read_bytes()
    path.unlink()
    os.mkfifo(path)
    killed: list[int] = []
    ended = threading.Event()

    def serve() -> None:
        while True:
            # Waits for a reader.
            with open(path, "wb"):
                # A reader may be gone before it is seen.
                while not (found := readers(path)):
                    if ended.wait(0.01):
                        return
                killed.extend(found)
                if len(killed) >= most:
                    path.unlink()
                    path.write_bytes(contents)
                os.kill(killed[-1], signal.SIGKILL)
            if len(killed) >= most:
                return
            while readers(path):
                time.sleep(0.01)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield killed
    finally:
        ended.set()
        while thread.is_alive():
            os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
            thread.join(0.1)
        path.unlink()
        path.write_bytes(contents)


@pytest.mark.parametrize(("most", "status"), [(1, "done"), (1000, "lost")])
def test_lost_worker_costs_only_its_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int, status: str
) -> None:
    source, out = tmp_path / "logs", tmp_path / "out"
    one = write_parquet(footfall.simulate("trot", 2.0, seed=5), source / "robot0" / "0.parquet")
    for k in range(1, 8):
        shutil.copy(one, one.with_name(f"{k}.parquet"))
    write(footfall.simulate("trot", 2.0, seed=5), source / "robot0" / "victim.csv")
    # In its first task the recording is together with others.
    monkeypatch.setattr(fleet, "TASKS", 2)
    with deadly(source / "robot0" / "victim.csv", most) as killed:
        found = by_foot(fleet.estimate(source, out))
    assert killed and found.pop(("robot0", "victim"))["status"] == status
    assert len(found) == 8 and {row["status"] for row in found.values()} == {"done"}
    again = by_foot(fleet.estimate(source, out))
    assert again["robot0", "victim"]["status"] == "done" and len(again) == 9


def test_ten_thousand_unchanged_recordings_need_no_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, out = tmp_path / "logs", tmp_path / "out"
    for robot in range(100):
        (source / f"robot{robot}").mkdir(parents=True)
        for k in range(100):
            (source / f"robot{robot}" / f"{k}.csv").touch()
    monkeypatch.setattr(fleet, "_run", lambda todo, *_: [fleet._row_of(recording, "done") for recording in todo])
    assert fleet.estimate(source, out).num_rows == 10_000
    monkeypatch.delattr(fleet, "_run")
    assert fleet.estimate(source, out).num_rows == 10_000


def test_s3_is_read_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: list[set[str]]
) -> None:
    source = tree(tmp_path / "logs")
    with s3_server(tmp_path) as access:
        monkeypatch.setitem(fsspec.config.conf, "s3", access)
        storage = fsspec.filesystem("s3")
        storage.mkdir("robots")
        storage.put(str(source), "robots/logs", recursive=True)
        storage.mkdir("tables")
        found = fleet.estimate("s3://robots/logs", "s3://tables/contact", samples=True)
        assert fleet.estimate("s3://robots/logs", "s3://tables/contact", samples=True).equals(found)
        assert len(asked) == 1
        row = by_foot(found)["robot0", "L"]
        assert row["recording"] == "s3://robots/logs/robot0/L.parquet"
        local = by_foot(fleet.estimate(source, tmp_path / "out", samples=True))["robot0", "L"]
        same = ["samples", "steps", "stable_s", "gyro_bias_end_wx_rad_s", "edge_m_s2"]
        assert [row[name] for name in same] == [local[name] for name in same]
        with storage.open(f"tables/contact/{row['samples_file']}") as file:
            there = parquet.read_table(file)
        here = parquet.read_table(tmp_path / "out" / local["samples_file"])
        assert there.drop_columns(["recording"]).equals(here.drop_columns(["recording"]))


@contextlib.contextmanager
def s3_server(tmp_path: Path) -> Iterator[dict[str, str]]:
    """Runs a server of S3 on this machine. Yields the options with which fsspec finds it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with open(tmp_path / "moto.log", "wb") as log, subprocess.Popen(command, stdout=log, stderr=log) as server:
        try:
            end = time.monotonic() + 120.0
            while time.monotonic() < end:
                assert server.poll() is None, "another program may have the port"
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
                    break
                time.sleep(0.1)
            else:
                raise TimeoutError("moto does not answer")
            yield {"endpoint_url": f"http://127.0.0.1:{port}", "key": "key", "secret": "secret"}
        finally:
            server.terminate()


def test_wrong_arguments_are_refused_before_any_work(tmp_path: Path, asked: list[set[str]]) -> None:
    source = tree(tmp_path / "logs")
    wrong: list[tuple[dict[str, Any], type[Exception], str]] = [
        ({"preset": "best"}, ValueError, "preset"),
        ({"units": "feet"}, ValueError, "units"),
        ({"config": {"decision": {"threshold": 7.0}}}, ValueError, "decision.threshold"),
        ({"speed": 1}, TypeError, "speed"),
        ({"pattern": "*.csv"}, FileNotFoundError, "no recording in .* of the pattern"),
    ]
    for options, kind, match in wrong:
        with pytest.raises(kind, match=match):
            fleet.estimate(source, tmp_path / "out", **options)
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        fleet.estimate(source, tmp_path / "file")
    assert not asked


def test_document_describes_each_column() -> None:
    text = (Path(__file__).parents[2] / "docs/guide/fleet.md").read_text(encoding="utf-8")
    table = text.partition("| columns | meaning |")[2].partition("\n\n")[0]
    names = "".join(line.split("|")[1] for line in table.splitlines() if line.startswith("| `"))
    assert set(re.findall(r"`(\w+)`", names)) == set(fleet.COLUMNS)


def test_missing_extra_is_named_in_the_error() -> None:
    code = "import sys; sys.modules['fsspec'] = None; import footfall.fleet"
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "ImportError: footfall.fleet needs fsspec: pip install 'footfall[fleet]'" in output.stderr
