"""Sources and destinations of a fleet that fail, are in use, or are named in several ways; on threads, without Ray."""

from __future__ import annotations

import fcntl
import os
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import fsspec
import pyarrow.dataset as ds
import pyarrow.parquet as parquet
import pytest
from fsspec.implementations.memory import MemoryFileSystem

import footfall
from footfall import fleet
from footfall.fleet import _cluster, _lock, _retry
from footfall.fleet._catalog import NOTES, ROWS
from footfall.fleet._sources import find
from test_fleet import s3_server

COUNT = 6


class Faulty(MemoryFileSystem):  # type: ignore[misc]
    """Storage of objects some of which cannot be read or written."""

    protocol = "faulty"
    store: dict[str, Any] = {}
    pseudo_dirs = [""]
    errors: dict[str, list[Exception]] = {}
    """Errors of opening a path, in their order; the last one is repeated if it is a refusal."""
    reads: Counter[str] = Counter()
    writes: list[str] = []
    cachable = False

    @classmethod
    def _strip_protocol(cls, path: str) -> str:
        return str(super()._strip_protocol(path.replace("faulty://", "memory://")))

    def _open(self, path: str, mode: str = "rb", **options: Any) -> Any:
        if mode == "rb":
            self.reads[path] += 1
        else:
            self.writes.append(path)
        waiting = self.errors.get(path, [])
        if waiting:
            raise waiting.pop(0) if len(waiting) > 1 or not isinstance(waiting[0], PermissionError) else waiting[0]
        return super()._open(path, mode, **options)


@pytest.fixture
def storage(monkeypatch: pytest.MonkeyPatch) -> Iterator[Faulty]:
    """Empty storage, which `faulty://` names, and pauses that take no time."""
    fsspec.register_implementation("faulty", Faulty, clobber=True)
    for name, empty in {"store": {}, "pseudo_dirs": [""], "errors": {}, "reads": Counter(), "writes": []}.items():
        monkeypatch.setattr(Faulty, name, empty)
    monkeypatch.setattr(_retry, "FIRST_PAUSE_S", 0.0)
    monkeypatch.setattr(_lock, "SETTLE_S", 0.1)
    yield Faulty()


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Two seconds of a walk, as Parquet."""
    path = tmp_path_factory.mktemp("one") / "walk.parquet"
    parquet.write_table(footfall.simulate("walk", 2.0, seed=1).to_arrow(), path)
    return path.read_bytes()


@pytest.fixture
def recordings(tmp_path: Path, recording: bytes) -> Path:
    """A robot with several recordings."""
    folder = tmp_path / "recordings"
    (folder / "spot").mkdir(parents=True)
    for k in range(COUNT):
        (folder / "spot" / f"{k}.parquet").write_bytes(recording)
    return folder


def statuses(report: fleet.Report) -> dict[str, str]:
    return {outcome.recording.rpartition("/")[2]: outcome.status for outcome in report.outcomes}


def test_unreadable_source_is_a_row_with_its_reason(storage: Faulty, recording: bytes, tmp_path: Path) -> None:
    for name in ("archived", "flaky", "good"):
        storage.pipe_file(f"/in/spot/{name}.parquet", recording)
    refused = PermissionError("the operation is not valid for the object's storage class")
    Faulty.errors = {
        "/in/spot/archived.parquet": [refused],
        "/in/spot/flaky.parquet": [OSError("500"), OSError("503")],
    }
    out = tmp_path / "out"
    report = fleet.estimate("faulty://in", out, jobs=1)
    assert statuses(report) == {"archived.parquet": "failed", "flaky.parquet": "done", "good.parquet": "done"}
    error = "in/spot/archived.parquet cannot be read: the operation is not valid for the object's storage class"
    assert error in [row["error"] for row in fleet.rows(out).to_pylist()]
    assert Faulty.reads["/in/spot/archived.parquet"] == 1
    # It is tried again by the next call, and by nothing else.
    Faulty.errors = {}
    Faulty.reads.clear()
    assert set(statuses(fleet.estimate("faulty://in", out, jobs=1)).values()) == {"done", "up_to_date"}
    assert list(Faulty.reads) == ["/in/spot/archived.parquet"]
    assert set(fleet.rows(out)["status"].to_pylist()) == {"done"}


class Answers(BaseHTTPRequestHandler):
    """A server of one recording at every path, with other statuses first."""

    recording = b""
    statuses: dict[str, list[int]] = {}
    """Statuses of a path in their order; the last one is repeated if it is a refusal."""
    gets: Counter[str] = Counter()

    def do_HEAD(self) -> None:
        self.answer(b"")

    def do_GET(self) -> None:
        self.gets[self.path] += 1
        self.answer(self.recording)

    def answer(self, body: bytes) -> None:
        waiting = self.statuses.get(self.path, [])
        status = 200
        if waiting:
            is_for_good = len(waiting) == 1 and waiting[0] == 403
            status = waiting[0] if is_for_good or self.command == "HEAD" else waiting.pop(0)
        self.send_response(status)
        self.send_header("Content-Length", str(len(self.recording) if status == 200 else 0))
        self.end_headers()
        self.wfile.write(body if status == 200 else b"")

    def log_message(self, format: str, *args: Any) -> None:
        pass


@pytest.fixture
def server(recording: bytes, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The address of a server of HTTP on this machine, and pauses that take no time."""
    pytest.importorskip("aiohttp")
    monkeypatch.setattr(Answers, "recording", recording)
    monkeypatch.setattr(Answers, "gets", Counter())
    monkeypatch.setattr(_retry, "FIRST_PAUSE_S", 0.0)
    listening = ThreadingHTTPServer(("127.0.0.1", 0), Answers)
    thread = threading.Thread(target=listening.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{listening.server_port}"
    listening.shutdown()
    thread.join()
    listening.server_close()


def test_refusals_of_a_server_do_not_end_the_run(
    server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = {"forbidden": [403], "broken": [500] * 100, "busy": [500, 503], "good": []}
    monkeypatch.setattr(Answers, "statuses", {f"/spot/{name}.parquet": list(of) for name, of in answers.items()})
    sources = [f"{server}/spot/{name}.parquet" for name in answers]
    out = tmp_path / "out"
    report = fleet.estimate(sources, out, robot="spot", jobs=1)
    expected = {"forbidden": "failed", "broken": "failed", "busy": "done", "good": "done"}
    assert statuses(report) == {f"{name}.parquet": status for name, status in expected.items()}
    errors = {row["recording"].rpartition("/")[2]: row["error"] for row in fleet.rows(out).to_pylist()}
    for name, status in (("forbidden", "403"), ("broken", "500")):
        error = errors[f"{name}.parquet"]
        assert f"{name}.parquet cannot be read: " in error and status in error, error
    assert errors["busy.parquet"] is errors["good.parquet"] is None
    asked = {name: Answers.gets[f"/spot/{name}.parquet"] for name in answers}
    assert asked["forbidden"] <= 2 and asked["broken"] > 2 and asked["busy"] == 3 and asked["good"] == 1, asked
    # What has passed is done by the next call.
    monkeypatch.setattr(Answers, "statuses", {})
    assert fleet.estimate(sources, out, robot="spot", jobs=1).count("failed") == 0


def test_archived_object_of_s3_is_a_row(recording: bytes, tmp_path: Path) -> None:
    with s3_server(tmp_path) as access:
        storage = fsspec.filesystem("s3", **access["s3"])
        for bucket in ("recordings", "tables"):
            storage.mkdir(bucket)
        storage.pipe_file("recordings/spot/new.parquet", recording)
        storage.pipe_file("recordings/spot/old.parquet", recording, StorageClass="GLACIER")
        for first in (True, False):
            report = fleet.estimate("s3://recordings", "s3://tables/contact", storage_options=access, jobs=1)
            expected = "done" if first else "up_to_date"
            assert statuses(report) == {"new.parquet": expected, "old.parquet": "failed"}
        [error] = [outcome.error for outcome in report.outcomes if outcome.error]
        assert "old.parquet cannot be read: " in error and "storage class" in error
        # The condition under which the lock is created is known to this storage.
        storage.pipe_file("tables/contact/.lock", b"a process\n")
        assert not _lock._created(storage, "tables/contact/.lock", b"other")


def test_results_stay_while_their_source_is_unreadable(storage: Faulty, recording: bytes, tmp_path: Path) -> None:
    storage.pipe_file("/in/spot/one.parquet", recording)
    out = tmp_path / "out"
    fleet.estimate("faulty://in", out, jobs=1)
    Faulty.errors = {"/in/spot/one.parquet": [PermissionError("archived")]}
    report = fleet.estimate("faulty://in", out, jobs=1, verify="contents")
    assert statuses(report) == {"one.parquet": "failed"}
    assert fleet.rows(out)["status"].to_pylist() == ["done"]


def test_recording_that_could_not_be_read_is_tried_again(recordings: Path, tmp_path: Path) -> None:
    path, out = recordings / "spot" / "late.parquet", tmp_path / "out"
    source = fleet.Source(str(path), stamp="the same")
    assert fleet.estimate(source, out, jobs=1).count("failed") == 1
    (recordings / "spot" / "0.parquet").rename(path)
    assert fleet.estimate(source, out, jobs=1).count("done") == 1


def test_unwritable_destination_ends_the_run(storage: Faulty, recordings: Path) -> None:
    denied = PermissionError("access denied")
    table = "/out/samples/robot=spot"
    fleet.estimate(recordings, "faulty://out", jobs=1)
    for path in storage.find(table):
        Faulty.errors[path] = [denied]
    storage.rm(table, recursive=True)
    Faulty.writes.clear()
    with pytest.raises(OSError, match="faulty://out, .*spot/.*: access denied"):
        fleet.estimate(recordings, "faulty://out", jobs=1)
    # The next one may have begun before the error was seen; none begins after it.
    for _ in range(2):
        assert len([path for path in Faulty.writes if path.startswith(table)]) <= 2
        time.sleep(1.0)


def test_recording_of_two_spellings_has_one_row(recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    one, out = "recordings/spot/1.parquet", tmp_path / "out"
    assert len(fleet.estimate([one, tmp_path / one], out, jobs=1).outcomes) == 1
    assert fleet.estimate(tmp_path / one, out, jobs=1).count("up_to_date") == 1
    assert fleet.rows(out)["recording"].to_pylist() == [one]
    other = fleet.Source(str(recordings / "spot" / "2.parquet"), name=one)
    with pytest.raises(ValueError, match=f"would both be called '{one}'"):
        fleet.estimate([one, other], out, jobs=1)


def test_folder_with_brackets_is_no_pattern(recordings: Path) -> None:
    folder = recordings.rename(recordings.parent / "run[1]")
    assert len(list(find(str(folder), "path", None, None, {}))) == COUNT
    assert len(list(find(f"{folder.parent}/run*/spot/[12].parquet", "path", None, None, {}))) == 2


def test_results_below_the_source_are_no_recordings(recordings: Path) -> None:
    for _ in range(2):
        assert len(fleet.estimate(recordings, recordings / "results", jobs=1).outcomes) == COUNT


def test_missing_and_mistaken_sources_are_errors(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    out = tmp_path / "out"
    (tmp_path / "empty").mkdir()
    sources: list[Any] = [tmp_path / "empty", f"{tmp_path}/*.csv", []]
    for nothing in sources:
        with pytest.raises(FileNotFoundError, match="there is no recording in"):
            fleet.estimate(nothing, out, jobs=1)
    with pytest.raises(TypeError, match="recordings is a pandas.DataFrame, but a path, a URL"):
        fleet.estimate(pandas.DataFrame({"path": ["a.csv"]}), out, jobs=1)
    with pytest.raises(TypeError, match="recordings has a int, but a path"):
        fleet.estimate([1], out, jobs=1)
    with pytest.raises(ValueError, match="jobs is 0, but 1 or more"):
        fleet.estimate(tmp_path, out, jobs=0)
    with pytest.raises(ValueError, match="verify is 'hash', but 'listing' or 'contents'"):
        fleet.estimate(tmp_path, out, jobs=1, verify="hash")  # type: ignore[arg-type]


def test_locked_folder_refuses_calls_and_the_program(program: str, recordings: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    refused: list[str] = []

    def other(outcome: fleet.Outcome) -> None:
        if not refused:
            command = [program, "batch", str(recordings), "--out", str(out)]
            refused.append(subprocess.run(command, capture_output=True, text=True).stderr)

    fleet.estimate(recordings, out, jobs=1, progress=other)
    assert "another process writes there" in refused[0]
    holder = os.open(out, os.O_RDONLY)
    fcntl.flock(holder, fcntl.LOCK_EX)
    with pytest.raises(BlockingIOError, match=f"{out} is in use: another process writes there"):
        fleet.estimate(recordings, out, jobs=1)
    os.close(holder)
    assert fleet.estimate(recordings, out, jobs=1).count("up_to_date") == COUNT


def test_living_lock_refuses_and_stale_lock_is_taken_over(
    storage: Faulty, recordings: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_lock, "RENEW_S", 0.1)
    monkeypatch.setattr(_lock, "STALE_S", 1.0)
    refused: list[str] = []

    def other(outcome: fleet.Outcome) -> None:
        if not refused:
            with pytest.raises(BlockingIOError) as raised:
                fleet.estimate(recordings, "faulty://out", jobs=1)
            refused.append(str(raised.value))

    fleet.estimate(recordings, "faulty://out", jobs=1, progress=other)
    assert f"faulty://out is in use: process {os.getpid()} on" in refused[0]
    assert not storage.exists("/out/.lock")
    storage.pipe_file("/out/.lock", b"process 1 on a machine that is off\nrun 7\n")
    assert fleet.estimate(recordings, "faulty://out", jobs=1).count("up_to_date") == COUNT
    assert not storage.exists("/out/.lock")


def test_unchanged_recording_is_known_by_its_listing(recordings: Path, recording: bytes, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fleet.estimate(recordings, out, jobs=1)
    noted = (out / NOTES).read_bytes()
    calls: list[int] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_cluster.Threads, "submit", lambda *_: calls.append(1))
        again = fleet.estimate(recordings, out, jobs=1)
    assert again.count("up_to_date") == COUNT and not calls
    assert (out / NOTES).read_bytes() == noted
    assert [outcome.rows[0]["steps"] for outcome in again.outcomes] == fleet.rows(out)["steps"].to_pylist()

    one, two, three = (recordings / "spot" / f"{k}.parquet" for k in range(3))
    one.write_bytes(recording)
    about = two.stat()
    two.write_bytes(recording[:-1] + bytes([recording[-1] ^ 1]))
    os.utime(two, ns=(about.st_atime_ns, about.st_mtime_ns))
    [lost] = (out / "events").rglob("*2.parquet-*.parquet")
    lost.unlink()
    reasons = {o.recording.rpartition("/")[2]: o.reason for o in fleet.estimate(recordings, out, jobs=1).outcomes}
    assert reasons == {
        "0.parquet": None,
        "1.parquet": "the recording has changed",
        "2.parquet": "the results are not complete",
        "3.parquet": None,
        "4.parquet": None,
        "5.parquet": None,
    }
    everything = fleet.estimate(recordings, out, jobs=1, verify="contents")
    assert everything.count("up_to_date") == COUNT - 1 and everything.count("failed") == 1


def test_interrupted_call_is_continued(recordings: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    seen: list[fleet.Outcome] = []

    def interrupt(outcome: fleet.Outcome) -> None:
        seen.append(outcome)
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fleet.estimate(recordings, out, jobs=1, progress=interrupt)
    # Results are whole or missing, and the one file has their rows, too.
    assert 2 <= fleet.rows(out).num_rows == parquet.read_table(out / ROWS).num_rows
    assert not [path for path in out.rglob("*") if path.name.endswith(".part")]
    again = fleet.estimate(recordings, out, jobs=1)
    assert again.count("up_to_date") >= 2 and again.count("done") + again.count("up_to_date") == COUNT


def test_rows_are_those_of_the_tables(program: str, recordings: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    (recordings / "spot" / "bad.parquet").write_bytes(b"PAR1")
    fleet.estimate(recordings, out, jobs=2)
    assert_rows_of_tables(out)
    # Another program changes results; the one file is behind then, and the tables count.
    command = [program, "batch", str(recordings), "--out", str(out), "--preset", "paper"]
    subprocess.run(command, check=False, capture_output=True)
    assert set(fleet.rows(out)["preset"].to_pylist()) == {"paper", None}
    assert_rows_of_tables(out)
    (out / NOTES).write_bytes(b"PAR1 damaged")
    assert_rows_of_tables(out)
    fleet.estimate(recordings / "spot" / "0.parquet", out, robot="spot", preset="paper", jobs=1)
    assert parquet.read_table(out / ROWS).num_rows == COUNT + 1
    for name in (ROWS, NOTES):
        (out / name).unlink()
    assert_rows_of_tables(out)


def assert_rows_of_tables(out: Path) -> None:
    """Compares the rows with the files of the table."""
    order = [(name, "ascending") for name in ("robot", "foot", "key")]
    tables = ds.dataset(out / "recordings", partitioning=ds.partitioning(fleet_partitions(), flavor="hive"))
    expected = tables.to_table().sort_by(order)
    found = fleet.rows(out)
    assert found.column_names == expected.column_names
    assert found.to_pylist() == expected.to_pylist()


def fleet_partitions() -> Any:
    import pyarrow

    return pyarrow.schema([(name, pyarrow.string()) for name in ("robot", "foot", "day")])


def test_runs_into_two_folders_have_the_same_bytes(recordings: Path, tmp_path: Path) -> None:
    tables = []
    for jobs in (1, 2):
        out = tmp_path / f"out{jobs}"
        fleet.estimate(recordings, out, jobs=jobs)
        tables.append({
            path.relative_to(out): path.read_bytes()
            for path in out.rglob("*.parquet") if path.name != NOTES
        })
    assert tables[0] == tables[1] and len(tables[0]) == 3 * COUNT + 1


def test_short_recordings_share_tasks(recording: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "many"
    folder.mkdir()
    for k in range(40):
        (folder / f"{k}.parquet").write_bytes(recording)
    sizes: list[int] = []
    submit = _cluster.Threads.submit

    def watched(self: Any, tasks: Any, is_last_chance: bool) -> Any:
        sizes.append(len(tasks))
        return submit(self, tasks, is_last_chance)

    monkeypatch.setattr(_cluster.Threads, "submit", watched)
    assert fleet.estimate(folder, tmp_path / "out", jobs=1).count("done") == 40
    assert sum(sizes) == 40 and sizes[0] == 1 and max(sizes) > 3
