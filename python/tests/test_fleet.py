"""The fleet on a real Ray cluster of this machine: what a call does, and what does not stop it."""

from __future__ import annotations

import contextlib
import importlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fsspec
import numpy as np
import numpy.typing as npt
import pyarrow.parquet as parquet
import pytest

import footfall
from footfall import fleet
from footfall._settings import read_options, settings
from footfall.fleet._catalog import NOTES, ROWS
from footfall.fleet._run import MEMORY
from footfall.fleet._sources import find, name_of
from footfall.fleet._work import Task, work
from test_files import bag

ray = pytest.importorskip("ray")
from ray.cluster_utils import Cluster  # noqa: E402

EXAMPLE = Path(__file__).parents[1] / "examples/fleet"
WAIT_S = 120.0
COUNT = 30
SECONDS = 36.0


def write_parquet(walk: footfall.Recording, path: Path) -> None:
    """Writes a recording as a table of Parquet."""
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(walk.to_arrow(), path)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three robots with two feet, and a file that is not a recording."""
    folder = tmp_path_factory.mktemp("fleet") / "recordings"
    for robot in range(3):
        for place, foot in enumerate(("L", "R")):
            walk = footfall.simulate("trot", 6.0, seed=10 * robot + place)
            write_parquet(walk, folder / f"robot{robot}" / f"{foot}.parquet")
    (folder / "robot1" / "poisoned.parquet").write_bytes(b"PAR1" + bytes(1000) + b"PAR1")
    return folder


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A head of one core; what Ray writes goes into a folder of its own, and nothing is left."""
    home = tmp_path_factory.mktemp("home")
    before = {name: os.environ.get(name) for name in ("HOME", "RAY_AUTH_MODE", "RAY_TMPDIR", "RAY_USAGE_STATS_ENABLED")}
    os.environ |= {"HOME": str(home), "RAY_AUTH_MODE": "disabled", "RAY_USAGE_STATS_ENABLED": "0"}
    # The path of a socket has no room for a long folder.
    folder = os.environ.get("RAY_TMPDIR")
    made = None if folder else tempfile.mkdtemp(prefix="ray-")
    os.environ["RAY_TMPDIR"] = folder or str(made)
    cluster = Cluster(
        initialize_head=True,
        head_node_args={
            "num_cpus": 1,
            "memory": 4 << 30,
            "object_store_memory": 100 << 20,
            "include_dashboard": False,
        },
    )
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster
    ray.shutdown()
    cluster.shutdown()
    if made:
        shutil.rmtree(made, ignore_errors=True)
    for name, value in before.items():
        os.environ.pop(name, None) if value is None else os.environ.update({name: value})


NOTES_OF_THE_PROGRAM = ".inputs.json"


def files(out: Path) -> dict[str, bytes]:
    """The files of a folder of tables, by their paths below it, without copies and notes."""
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file() and path.name not in (ROWS, NOTES, NOTES_OF_THE_PROGRAM)
    }


def batch(program: str, recordings: Path, out: Path, *options: str) -> dict[str, bytes]:
    """The files that the program writes on this machine."""
    command = [program, "batch", str(recordings), "--out", str(out), *options]
    subprocess.run(command, check=False, capture_output=True)
    return files(out)


def statuses(report: fleet.Report) -> dict[str, int]:
    known = ("done", "failed", "up_to_date", "lost")
    return {status: report.count(status) for status in known if report.count(status)}


def test_the_bytes_are_those_of_the_program_and_a_second_call_does_what_is_missing(
    cluster: Cluster, program: str, recordings: Path, tmp_path: Path
) -> None:
    out = tmp_path / "tables"
    report = fleet.estimate(recordings, out)
    assert statuses(report) == {"done": 6, "failed": 1}, report.outcomes
    [failed] = [outcome for outcome in report.outcomes if outcome.status == "failed"]
    assert failed.recording.endswith("robot1/poisoned.parquet") and failed.error
    expected = batch(program, recordings, tmp_path / "program")
    assert_same(files(out), expected)
    assert len(expected) == 3 * 6 + 1

    again = fleet.estimate(recordings, out)
    assert statuses(again) == {"up_to_date": 6, "failed": 1} and again.samples == 0
    assert files(out) == expected

    lost = next(path for path in expected if path.startswith("samples/robot=robot2"))
    (out / lost).unlink()
    changed = recordings / "robot0" / "L.parquet"
    original = changed.read_bytes()
    write_parquet(footfall.simulate("trot", 5.0, seed=99), changed)
    report = fleet.estimate(recordings, out)
    changed.write_bytes(original)
    reasons = {outcome.recording.rpartition("recordings/")[2]: outcome.reason for outcome in report.outcomes}
    assert {name: reason for name, reason in reasons.items() if reason} == {
        "robot0/L.parquet": "the recording has changed",
        lost_recording(lost): "the results are not complete",
    }
    other = fleet.estimate(recordings / "robot0", out, robot="robot0", config={"decision": {"on_delay_s": 0.05}})
    assert statuses(other) == {"done": 2}
    assert {outcome.reason for outcome in other.outcomes} == {"the settings are others"}


def test_each_foot_of_a_bag_has_a_task(cluster: Cluster, program: str, tmp_path: Path) -> None:
    feet = {name: footfall.simulate("walk", 3.0, seed) for seed, name in enumerate(["FL", "FR"])}
    folder, out = tmp_path / "bags", tmp_path / "tables"
    bag(folder / "robot" / "monday", feet, 2500)
    report = fleet.estimate(folder, out, topic="all")
    assert {outcome.foot for outcome in report.outcomes} == {"FL", "FR"}
    assert {outcome.reason for outcome in report.outcomes} == {"there are no results"}
    expected = batch(program, folder, tmp_path / "program", "--topic", "all")
    assert_same(files(out), expected)
    assert len(expected) == 6
    again = fleet.estimate(folder, out, topic="all")
    assert statuses(again) == {"up_to_date": 1} and len(again.outcomes[0].rows) == 2


def assert_same(found: dict[str, bytes], expected: dict[str, bytes]) -> None:
    """Compares two folders of tables file by file, byte by byte."""
    assert list(found) == list(expected)
    for path, contents in found.items():
        assert contents == expected[path], path


def lost_recording(below: str) -> str:
    foot = below.partition("foot=")[2].partition("/")[0]
    return f"robot2/{foot}.parquet"


def test_rows_are_a_table_and_recordings_come_from_patterns_lists_and_datasets(
    cluster: Cluster, recordings: Path, tmp_path: Path
) -> None:
    out = tmp_path / "tables"
    report = fleet.estimate(f"{recordings}/robot*/L.parquet", out)
    assert statuses(report) == {"done": 3}
    source = fleet.Source(str(recordings / "robot0" / "R.parquet"), robot="spot", foot="left", day="2026-01-02")
    assert statuses(fleet.estimate([source, recordings / "robot2"], out)) == {"done": 2, "up_to_date": 1}
    paths = [{"path": str(recordings / f"robot{k}" / "R.parquet"), "robot": f"r{k}"} for k in (1, 2)]
    dataset = ray.data.from_items(paths)
    assert statuses(fleet.estimate(dataset, out)) == {"done": 2}
    with pytest.raises(ValueError, match="column is 'file', but the dataset has path, robot"):
        fleet.estimate(dataset, out, column="file")
    table = fleet.rows(out)
    found = set(zip(*(table[name].to_pylist() for name in ("robot", "foot", "day"))))
    assert ("spot", "left", "2026-01-02") in found and ("r1", "R", "unknown") in found
    assert min(table["samples"].to_pylist()) == 6000
    with pytest.raises(FileNotFoundError, match="nothing has been estimated"):
        fleet.rows(tmp_path / "nowhere")
    with pytest.raises(FileNotFoundError):
        fleet.estimate(tmp_path / "nowhere", out)
    with pytest.raises(ValueError, match="preset"):
        fleet.estimate(recordings, out, preset="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="in braces"):
        fleet.estimate(recordings, out, path_pattern="{leg}.csv")


def test_a_killed_worker_costs_time_and_a_node_that_comes_takes_work(
    cluster: Cluster, tmp_path: Path
) -> None:
    folder = tmp_path / "recordings"
    walk = footfall.simulate("trot", 120.0, seed=5)
    write_parquet(walk, folder / "robot0" / "foot0.parquet")
    for k in range(1, COUNT):
        shutil.copy(folder / "robot0" / "foot0.parquet", folder / "robot0" / f"foot{k}.parquet")
    # The same in this process, without Ray.
    tasks = [
        Task(
            str(folder / "robot0" / f"foot{k}.parquet"),
            fleet.Source(str(folder / "robot0" / f"foot{k}.parquet"), robot="robot0").identity(None),
            read_options(),
            settings("default", None, None, None),
            {"window": None, "strict": False, "only_foot": None},
            str(tmp_path / "alone"),
            {},
            (),
            "alone",
        )
        for k in range(COUNT)
    ]
    with ThreadPoolExecutor() as pool:
        list(pool.map(work, tasks))
    alone = files(tmp_path / "alone")
    killed: list[int] = []
    added: list[Any] = []

    def trouble(outcome: fleet.Outcome) -> None:
        if not killed:
            # The process that has done this is at the next by now.
            os.kill(outcome.pid, signal.SIGKILL)
            killed.append(outcome.pid)
            added.append(cluster.add_node(num_cpus=1, memory=4 << 30, object_store_memory=100 << 20))

    out = tmp_path / "tables"
    report = fleet.estimate(folder, out, progress=trouble)
    assert statuses(report) == {"done": COUNT}
    pids = {outcome.pid for outcome in report.outcomes}
    assert killed and len(pids) >= 3, pids
    assert len({outcome.node for outcome in report.outcomes}) == 2
    assert_same(files(out), alone)
    cluster.remove_node(added[0])


def test_a_recording_that_is_lost_has_no_row_and_is_done_by_the_next_call(
    cluster: Cluster, tmp_path: Path
) -> None:
    folder, out = tmp_path / "recordings", tmp_path / "tables"
    write_parquet(footfall.simulate("trot", 120.0, seed=5), folder / "robot0" / "foot0.parquet")
    for k in range(1, 5):
        shutil.copy(folder / "robot0" / "foot0.parquet", folder / "robot0" / f"foot{k}.parquet")
    killed: list[int] = []

    def trouble(outcome: fleet.Outcome) -> None:
        if not killed:
            os.kill(outcome.pid, signal.SIGKILL)
            killed.append(outcome.pid)

    report = fleet.estimate(folder, out, retries=0, progress=trouble)
    [lost] = [outcome for outcome in report.outcomes if outcome.status == "lost"]
    assert lost.error and not lost.rows and report.count("done") == 4
    assert fleet.rows(out).num_rows == 4
    assert statuses(fleet.estimate(folder, out)) == {"done": 1, "up_to_date": 4}
    assert not [path for path in files(out) if path.endswith(".part")]


def test_short_recordings_survive_the_loss_of_their_worker(cluster: Cluster, tmp_path: Path) -> None:
    folder, out = tmp_path / "recordings", tmp_path / "tables"
    write_parquet(footfall.simulate("trot", 2.0, seed=5), folder / "robot0" / "0.parquet")
    for k in range(1, 60):
        shutil.copy(folder / "robot0" / "0.parquet", folder / "robot0" / f"{k}.parquet")
    seen: list[int] = []

    def trouble(outcome: fleet.Outcome) -> None:
        seen.append(outcome.pid)
        if len(seen) == 20:
            # Its process is at several recordings by now.
            os.kill(outcome.pid, signal.SIGKILL)

    report = fleet.estimate(folder, out, progress=trouble)
    assert statuses(report) == {"done": 60} and len(set(seen)) >= 2
    assert fleet.rows(out).num_rows == 60


def test_unwritable_destination_ends_all_tasks(cluster: Cluster, recordings: Path, tmp_path: Path) -> None:
    folder, out = tmp_path / "recordings", tmp_path / "tables"
    for k in range(20):
        target = folder / f"robot{k}" / "L.parquet"
        target.parent.mkdir(parents=True)
        shutil.copy(recordings / "robot0" / "L.parquet", target)
    # No folder of this name can be made.
    (out / "samples").mkdir(parents=True)
    (out / "samples" / "robot=robot3").write_bytes(b"")
    with pytest.raises(OSError, match=f"{out}, .*robot3/L.parquet: .*robot=robot3"):
        fleet.estimate(folder, out, retries=0)
    before = files(out)
    assert 0 < len(before) < 3 * 20
    time.sleep(3.0)
    assert files(out) == before and not [path for path in out.iterdir() if path.name.endswith(".part")]


def test_cluster_of_a_call_leaves_nothing(recordings: Path, tmp_path: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="r-", dir="/tmp") as folder:
        environment = {**os.environ, "RAY_TMPDIR": folder, "HOME": str(tmp_path), "RAY_AUTH_MODE": "disabled"}
        environment.pop("RAY_ADDRESS", None)
        code = (
            "import sys, footfall.fleet as fleet;"
            "report = fleet.estimate(sys.argv[1], sys.argv[2]); assert report.count('done') == 2, report;"
            "import ray; assert not ray.is_initialized()"
        )
        command = [sys.executable, "-c", code, str(recordings / "robot0"), str(tmp_path / "out")]
        subprocess.run(command, check=True, capture_output=True, env=environment)
        assert os.listdir(folder) == []


def test_a_recording_is_called_as_its_path_was_given_by_folder_or_by_pattern(
    recordings: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(recordings.parent)

    def names(given: str) -> set[tuple[str, str | None]]:
        found = find(given, "path", None, None, {})
        return {(source.identity(None)["name"], source.robot) for source in found}

    assert names("recordings/robot*/L.parquet") == {
        (f"recordings/robot{k}/L.parquet", f"robot{k}") for k in range(3)
    }
    assert names("recordings/robot0") == {
        (f"recordings/robot0/{foot}.parquet", "robot0") for foot in "LR"
    }
    assert names("recordings") >= names("recordings/robot*/L.parquet")
    assert names("recordings/robot0/L.parquet") == {("recordings/robot0/L.parquet", None)}
    assert name_of("s3://bucket/a/../b.mcap") == "bucket/b.mcap"


def test_a_task_needs_less_memory_than_ray_is_told(tmp_path: Path) -> None:
    write_parquet(footfall.simulate("trot", 600.0, seed=5), tmp_path / "robot0" / "long.parquet")
    code = (
        "import re, sys; import footfall.fleet._work as w, footfall.fleet as f;"
        "from footfall._settings import read_options, settings;"
        "w.work(w.Task(sys.argv[1], f.Source(sys.argv[1]).identity(None), read_options(),"
        " settings('default', None, None, None), {'window': None, 'strict': False, 'only_foot': None},"
        " sys.argv[2], {}, (), 'memory'));"
        "print(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read()).group(1))"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "robot0" / "long.parquet"), str(tmp_path / "out")]
    kilobytes = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert 1024 * int(kilobytes) < MEMORY


def test_without_the_extra_an_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ImportError, match=r"footfall.fleet needs ray.*pip install 'footfall\[fleet\]'"):
        fleet.estimate("recordings", "tables")


def test_tables_go_to_s3_and_come_from_there(
    cluster: Cluster, program: str, recordings: Path, tmp_path: Path
) -> None:
    with s3_server(tmp_path) as access:
        storage = fsspec.filesystem("s3", **access["s3"])
        storage.mkdir("recordings")
        for path in sorted(recordings.rglob("*")):
            if path.is_file():
                storage.put_file(str(path), f"recordings/{path.relative_to(recordings).as_posix()}")
        storage.mkdir("tables")
        url = "s3://tables/contact"
        report = fleet.estimate("s3://recordings", url, storage_options=access)
        assert statuses(report) == {"done": 6, "failed": 1}, report.outcomes
        folder = recordings.parent
        command = [program, "batch", "recordings", "--out", str(tmp_path / "program")]
        subprocess.run(command, check=False, capture_output=True, cwd=folder)
        expected = files(tmp_path / "program")
        storage.invalidate_cache()
        found = {path[len("tables/contact/") :]: storage.cat_file(path) for path in storage.find("tables")}
        assert {found.pop(ROWS)[:4], found.pop(NOTES)[:4]} == {b"PAR1"}
        assert_same(found, expected)
        again = fleet.estimate("s3://recordings", url, storage_options=access)
        assert statuses(again) == {"up_to_date": 6, "failed": 1}
        assert fleet.rows(url, storage_options=access).num_rows == 7
        pattern = "s3://recordings/robot0/*.parquet"
        one = fleet.estimate(pattern, tmp_path / "local", storage_options=access)
        assert statuses(one) == {"done": 2}


@contextlib.contextmanager
def s3_server(tmp_path: Path) -> Iterator[dict[str, dict[str, str]]]:
    """A server of S3 on this machine: what fsspec is to know of it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with open(tmp_path / "moto.log", "wb") as log:
        server = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        wait_for(port)
        address = f"http://127.0.0.1:{port}"
        yield {"s3": {"endpoint_url": address, "key": "key", "secret": "secret"}}
    finally:
        server.terminate()
        server.wait()


def wait_for(port: int) -> None:
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            return
        time.sleep(0.1)
    raise TimeoutError(f"nothing listens on port {port}")


def test_a_fleet_of_simulated_robots_shows_its_slips_and_the_sensors_that_drift(
    cluster: Cluster, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLE))
    report, robots = map(importlib.import_module, ("report", "robots"))
    second = cluster.add_node(num_cpus=1, memory=4 << 30, object_store_memory=100 << 20)
    truths = robots.simulate(tmp_path / "recordings", SECONDS)
    out = tmp_path / "tables"
    assert len(truths) == 200
    pattern = robots.PATH_PATTERN
    first = fleet.estimate(tmp_path / "recordings", out, path_pattern=pattern)
    assert statuses(first) == {"done": 200}
    cluster.remove_node(second)
    rows = fleet.rows(out).to_pylist()
    assert {row["day"] for row in rows} == {robots.DAY}

    drifting = {(drift.robot, drift.foot) for drift in fleet.drifting(rows)}
    assert drifting == {(truth.robot, truth.foot) for truth in truths if truth.drifts}
    assert drifting == set(robots.DRIFTING)

    found = {robot.name: robot for robot in fleet.robots(rows)}
    true: dict[str, list[Any]] = {}
    for truth in truths:
        true.setdefault(truth.robot, []).append(truth)
    shares = {name: sum(f.slips for f in feet) / sum(f.steps for f in feet) for name, feet in true.items()}
    ranked = [found[name].slips_per_thousand_steps for name in shares]
    correlation = rank_correlation(ranked, list(shares.values()))
    print(f"rank correlation {correlation:.3f}")
    assert correlation > 0.9
    assert sum(robot.steps for robot in found.values()) > 0.9 * sum(truth.steps for truth in truths)
    assert len({round(robot.acceleration_half_width, 3) for robot in found.values()}) > 20

    page = report.page(rows)
    assert all(f"{robot} {foot}" in page for robot, foot in robots.DRIFTING)
    assert "<svg" in page and "http://" not in page.replace("http://www.w3.org", "")


def rank_correlation(one: npt.ArrayLike, other: npt.ArrayLike) -> float:
    """Spearman's, in [-1, 1]: 1 where both rank alike; equal values share their rank."""

    def ranks(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
        _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
        last = np.cumsum(counts)
        return np.asarray((last - (counts - 1) / 2.0)[place], dtype=np.float64)

    return float(np.corrcoef(ranks(one), ranks(other))[0, 1])
