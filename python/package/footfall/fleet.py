"""Trees of recordings, on the cores of this machine or on a Ray cluster: ``pip install 'footfall[fleet]'``.

>>> import footfall.fleet
>>> rows = footfall.fleet.estimate("s3://robots/2026-11", "s3://robots-contact",
...                                pattern="{robot}/{day}/{foot}.mcap")  # doctest: +SKIP

:func:`estimate` gives each recording to :func:`footfall.estimate_file` in a task of Ray Data, and writes one row for
each foot. :data:`COLUMNS` describes the row. ``docs/guide/fleet.md`` describes the stored files and the time required.
"""

from __future__ import annotations

import contextlib
import datetime
import functools
import hashlib
import json
import os
import pickle
import posixpath
import re
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Union
from urllib.parse import quote

import numpy as np

from ._estimate import estimate_file
from ._footfall import FLAGS, STATES, __version__
from ._result import Result
from ._settings import config_text

try:
    import fsspec
    import pyarrow
    import pyarrow.compute
    import pyarrow.dataset
    import pyarrow.parquet
except ImportError as error:
    raise ImportError(f"footfall.fleet needs {error.name}: pip install 'footfall[fleet]'") from error

__all__ = ["COLUMNS", "estimate"]

Source = Union[str, "os.PathLike[str]"]
Row = dict[str, Any]

_TEXT, _COUNT, _NUMBER = pyarrow.string(), pyarrow.int64(), pyarrow.float64()
_TEXTS, _FLOAT = pyarrow.list_(_TEXT), pyarrow.float32()

COLUMNS: dict[str, tuple[Any, str]] = {
    "recording": (_TEXT, "Path or URL of the recording."),
    "robot": (_TEXT, "From the pattern; else the first folder below the source, or the name of the source."),
    "foot": (_TEXT, "The foot's name in the recording; else from the pattern, else the name of the file."),
    "day": (_TEXT, "From the pattern; else that of the first sample in UTC, if its clock has a date."),
    "status": (_TEXT, "`done`; `refused`: not understood; `failed`: not read; `lost`: its worker died each time."),
    "error": (_TEXT, "Why it is not done."),
    "key": (_TEXT, "Hash of all that the row depends on: size and time or ETag, settings, names, version."),
    "version": (_TEXT, "Version of footfall."),
    "samples_file": (_TEXT, "The estimates of all samples, below the destination; null without `samples`."),
    "start_s": (_NUMBER, "Time of the first sample on the recording's clock, s."),
    "samples": (_COUNT, "Number of samples."),
    "duration_s": (_NUMBER, "Time from the first sample to the last, s."),
    "sample_rate_hz": (_NUMBER, "Sample rate, Hz."),
    **{f"{state}_s": (_NUMBER, f"Time in the state `{state}`, s.") for state in STATES},
    "stable_s": (_NUMBER, "Time in which the decision is stable, s."),
    "steps": (_COUNT, "Touch-downs."),
    "slips": (_COUNT, "Slips that began."),
    "slip_distance_m": (_NUMBER, "Sum of the known distances of slips along the ground, m."),
    "unstable_stances": (_COUNT, "Stances in which the foot was loaded and never stable."),
    **{f"{flag}_samples": (_COUNT, f"Samples with the flag `{flag}`.") for flag in FLAGS},
    "edge_m_s2": (_FLOAT, "Acceleration below which the foot is still at the end, learnt, m/s²."),
    **{
        f"gyro_bias_{end}_{axis}_rad_s": (_FLOAT, f"Gyroscope bias about the foot's {axis[1]} {when}, rad/s.")
        for end, when in (("start", "at its first rest"), ("end", "at the end"))
        for axis in ("wx", "wy", "wz")
    },
    "findings": (_TEXTS, "Names of the findings: implausible values."),
    "notices": (_TEXTS, "A sentence on each finding, and on each thing that was left out or reinterpreted."),
}
"""Columns of a row: type of Arrow and meaning. Those from `start_s` on are null where `status` is not ``done``."""

SCHEMA = pyarrow.schema([(name, kind) for name, (kind, _) in COLUMNS.items()])
"""The columns as a schema of Arrow."""

TASKS = 64
"""Number of recordings up to which each has a task of its own."""

GROUP = 16
"""With more recordings, the maximum number of short ones that share a task."""

GROUP_BYTES = 8 << 20
"""Maximum size of the recordings of a shared task together, bytes."""

RETRIES = 3
"""How often Ray starts a task again whose worker or machine is lost."""

ROWS = "recordings.parquet"
"""File with all rows, at a destination."""

NEW = "recordings.new"
"""Folder with the rows of a call that has not ended, at a destination."""

SAMPLES = "samples"
"""Folder with estimates sample by sample, at a destination."""

_RECORDING = re.compile(r"\.(csv|tsv|parquet|mcap|db3|bag)(\.(gz|zst|zstd))?$", re.IGNORECASE)
_BAG = re.compile(r"\.(mcap|db3|bag)(\.(gz|zst|zstd))?$", re.IGNORECASE)
_OF_BAGS, _OF_TABLES = ("topic", "not_topic", "frame", "load_topic", "rename"), ("time_unit",)
_STAMPS = ("ETag", "etag", "md5Hash", "content_md5", "mtime", "LastModified", "last_modified", "updated")


def estimate(
    source: Source | Sequence[Source],
    destination: Source,
    *,
    pattern: str | None = None,
    samples: bool = False,
    memory: int | None = None,
    **options: Any,
) -> pyarrow.Table:
    """Estimates the recordings of a tree whose rows are missing or out of date.

    The estimates run on the connected Ray (``ray.init``). Without a connection, Ray connects to an instance on this
    machine, or starts one. A call without recordings to estimate needs no Ray. Only one call at a time may work on a
    destination.

    Parameters
    ----------
    source : path or URL, or several of them
        A folder of recordings, or a recording, in any file system of fsspec. Local paths are paths on the workers.
    destination : path or URL
        A folder, on a file system that all workers share.
    pattern : str, optional
        Pattern of the paths of recordings below `source`, such as ``"{robot}/{day}/*_{foot}.csv"``. ``*`` matches any
        text in a part, ``**`` any number of parts. By default recordings are recognised by their extension.
    samples : bool
        Whether to write the estimates of all samples as well, with the columns of :meth:`footfall.Result.to_arrow`.
    memory : int, bytes, optional
        Memory that a task may need. Ray starts only as many tasks on a machine as fit.
    **options
        Further arguments of :func:`footfall.estimate_file`, such as `preset`, `config`, `units` or `topic`. Those
        about topics apply only to bags, and `time_unit` only to tables.

    Returns
    -------
    pyarrow.Table
        One row with :data:`COLUMNS` for each foot of each recording that was found, estimated now or before.
        ``recordings.parquet`` at the destination has the rows of all calls.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it.
    FileNotFoundError
        There is no recording.
    OSError
        The destination cannot be written.
    """
    options["config"] = config_text(options.get("config"))
    # Arguments are checked before the file is opened; this path does not exist.
    with contextlib.suppress(OSError):
        estimate_file(os.path.join(os.devnull, "none"), **options, foot=None)
    fs, root = fsspec.core.url_to_fs(os.fspath(destination))
    settings = [__version__, samples, options]
    sources = [source] if isinstance(source, (str, os.PathLike)) else source
    found = [each for one in sources for each in _find(os.fspath(one), pattern, settings, (fs, root))]
    recordings = list({recording.name: recording for recording in found}.values())
    known = _collect(fs, root)
    kept = {
        (name, key)
        for name, key, status in zip(*(known[column].to_pylist() for column in ("recording", "key", "status")))
        if status in ("done", "refused")
    }
    todo = [recording for recording in recordings if (recording.name, recording.key) not in kept]
    if todo:
        fs.makedirs(f"{root}/{NEW}", exist_ok=True)
        # An unwritable destination is an error before any recording is estimated.
        fs.pipe_file(f"{root}/{NEW}/begun", b"")
        lost = _run(todo, _Call(fs, root, samples, options), memory)
        known = _collect(fs, root, lost)
    names = pyarrow.array([recording.name for recording in recordings], _TEXT)
    return known.filter(pyarrow.compute.is_in(known["recording"], names))


@dataclass(frozen=True)
class _Recording:
    """A recording of a tree."""

    fs: Any
    path: str
    name: str
    size: int
    robot: str
    foot: str | None
    day: str | None
    key: str
    is_bag: bool


@dataclass(frozen=True)
class _Call:
    """Arguments of a call that workers need."""

    fs: Any
    root: str
    samples: bool
    options: dict[str, Any]


def _is_local(fs: Any) -> bool:
    return "file" in ((fs.protocol,) if isinstance(fs.protocol, str) else fs.protocol)


def _pattern(text: str) -> re.Pattern[str]:
    """The expression that paths below a source match as a whole."""
    meanings = {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*"}
    meanings |= {f"{{{name}}}": f"(?P<{name}>[^/]+?)" for name in ("robot", "foot", "day")}
    parts = re.split(r"(\*\*/|\*\*|\*|\{.*?\})", text)
    for part in parts:
        if part.startswith("{") and part not in meanings:
            raise ValueError(f"pattern has {part}, but only {{robot}}, {{foot}} and {{day}} are allowed in braces")
    try:
        return re.compile("".join(meanings.get(part, re.escape(part)) for part in parts))
    except re.error as error:
        raise ValueError(f"pattern {text!r}: {error}") from None


def _find(source: str, pattern: str | None, settings: Any, destination: tuple[Any, str]) -> Iterator[_Recording]:
    """The recordings of a source; a folder of a rosbag2 is one."""
    expression = None if pattern is None else _pattern(pattern)
    fs, root = fsspec.core.url_to_fs(source)
    root = root.rstrip("/")
    fs.invalidate_cache()
    listed = fs.find(root, detail=True)
    if list(listed) == [root]:
        listed, root = {root: fs.info(root)}, posixpath.dirname(root)
    bags = {posixpath.dirname(path) for path in listed if posixpath.basename(path) == "metadata.yaml"}
    bags &= {posixpath.dirname(path) for path in listed if _BAG.search(path)}
    files: dict[str, list[str]] = {}
    for path in listed:
        if destination[0] != fs or not path.startswith(f"{destination[1]}/"):
            folder = posixpath.dirname(path)
            files.setdefault(folder if folder in bags else path, []).append(path)
    is_empty = True
    for path, parts in sorted(files.items()):
        below = path[len(root) :].lstrip("/") or posixpath.basename(path)
        match = expression.fullmatch(below) if expression else None
        is_recording = match if expression else path in bags or _RECORDING.search(path)
        if not is_recording or any(part.startswith(".") for part in below.split("/")):
            continue
        is_empty = False
        said = match.groupdict() if match else {}
        first = below.split("/")[0] if "/" in below else posixpath.basename(root)
        names = said.get("robot") or first, said.get("foot"), said.get("day")
        stamps = [[part, listed[part]["size"], *_stamps(listed[part])] for part in parts]
        depends = json.dumps([settings, names, stamps], sort_keys=True, default=str)
        key = hashlib.sha256(depends.encode()).hexdigest()
        name = path if _is_local(fs) else fs.unstrip_protocol(path)
        size = sum(listed[part]["size"] or 0 for part in parts)
        yield _Recording(fs, path, name, size, *names, key, path in bags or bool(_BAG.search(path)))
    if is_empty:
        raise FileNotFoundError(f"there is no recording in {source}{' of the pattern' if pattern else ''}")


def _stamps(about: Row) -> list[str]:
    """Values in a listing that change with a file. Without them a file counts as changed each time."""
    stamps = [str(about[name]) for name in _STAMPS if about.get(name) is not None]
    return stamps or [str(datetime.datetime.now())]


def _run(recordings: list[_Recording], call: _Call, memory: int | None) -> list[Row]:
    """Estimates all recordings. Returns rows for lost recordings, each of which failed in a task of its own."""
    import ray.data

    for most in (min(GROUP, len(recordings) // TASKS), 1):
        groups: list[list[_Recording]] = []
        for recording in recordings:
            group = groups[-1] if groups else []
            if not 0 < len(group) < most or sum(each.size for each in [*group, recording]) > GROUP_BYTES:
                groups.append([])
            groups[-1].append(recording)
        items = [{"group": pickle.dumps(group)} for group in groups]
        dataset = ray.data.from_items(items, override_num_blocks=len(items))
        # A task that fails repeatedly loses its own recordings, but does not fail the call.
        dataset.context.max_errored_blocks = -1
        # Both steps get the same options, because Ray then runs them in one task.
        remote = {"max_retries": RETRIES} | ({} if memory is None else {"memory": memory})
        work = functools.partial(_work, call=call)
        with warnings.catch_warnings():
            # Ray deprecates arguments of tasks here. pyproject.toml allows no version without them.
            warnings.simplefilter("ignore", DeprecationWarning)
            rows = dataset.map_batches(work, batch_size=None, batch_format="pyarrow", **remote)
        rows.write_parquet(f"{call.root}/{NEW}", filesystem=call.fs, ray_remote_args=remote)
        done = set(_read_new(call.fs, call.root)["recording"].to_pylist())
        recordings = [recording for recording in recordings if recording.name not in done]
        if not recordings:
            break
    why = f"its worker died, or could not write below {call.root}: the log of Ray has the reason"
    return [_row_of(recording, "lost", why) for recording in recordings]


def _work(block: pyarrow.Table, call: _Call) -> pyarrow.Table:
    """Estimates the recordings of a task, one after the other."""
    groups = map(pickle.loads, block["group"].to_pylist())
    rows = [row for group in groups for recording in group for row in _estimated(recording, call)]
    return pyarrow.Table.from_pylist(rows, schema=SCHEMA)


def _estimated(recording: _Recording, call: _Call) -> list[Row]:
    """The rows of a recording."""
    other = _OF_TABLES if recording.is_bag else _OF_BAGS
    options = {name: value for name, value in call.options.items() if name not in other}
    path = recording.path
    is_read = False
    try:
        with _local(recording) as path:
            is_read = True
            results = estimate_file(path, **options, foot=recording.foot)
        return [_done(recording, result, call) for result in results]
    except Exception as error:
        # An error that a file system raises about this recording does not stop the others.
        status = "refused" if is_read and isinstance(error, ValueError) else "failed"
        why = str(error).replace(path, recording.name) or type(error).__name__
        return [_row_of(recording, status, why)]


@contextlib.contextmanager
def _local(recording: _Recording) -> Iterator[str]:
    """The recording as a file or folder of this machine."""
    if _is_local(recording.fs):
        yield recording.path
        return
    with tempfile.TemporaryDirectory(prefix="footfall-") as folder:
        path = os.path.join(folder, posixpath.basename(recording.path))
        recording.fs.get(recording.path, path, recursive=True)
        yield path


def _row_of(recording: _Recording, status: str, error: str | None = None) -> Row:
    """Row of a recording before its estimate."""
    foot = recording.foot or _RECORDING.sub("", posixpath.basename(recording.path))
    row = dict(recording=recording.name, robot=recording.robot, foot=foot, day=recording.day, key=recording.key)
    return row | {"status": status, "error": error, "version": __version__}


def _done(recording: _Recording, result: Result, call: _Call) -> Row:
    """The row of a foot. If estimates of each sample were requested, they are written first."""
    row = _row_of(recording, "done")
    row["foot"] = result.foot or row["foot"]
    start = float(result.t[0])
    if row["day"] is None and 1.0e9 <= start < 4.1e9:
        row["day"] = datetime.datetime.fromtimestamp(start, datetime.timezone.utc).date().isoformat()
    if call.samples:
        name = hashlib.sha256(recording.name.encode()).hexdigest()[:16]
        row["samples_file"] = f"{SAMPLES}/{name}-{quote(row['foot'], safe='')}.parquet"
        table = result.to_arrow()
        for place, column in enumerate(("recording", "robot", "foot")):
            named = pyarrow.DictionaryArray.from_arrays(np.zeros(len(result), np.int32), [row[column]])
            table = table.add_column(place, column, named)
        _write(call.fs, table, f"{call.root}/{row['samples_file']}")
    events = result.events()
    kinds = Counter(event.kind for event in events)
    states = np.bincount(result.state, minlength=len(STATES)) / result.rate
    row |= {
        "start_s": start,
        "samples": len(result),
        "duration_s": float(result.t[-1]) - start,
        "sample_rate_hz": result.rate,
        "stable_s": int(result.decision.sum()) / result.rate,
        "steps": kinds["touch_down"],
        "slips": kinds["slip_start"],
        "slip_distance_m": sum(event.distance or 0.0 for event in events if event.kind == "slip_start"),
        "unstable_stances": kinds["unstable_start"],
        "edge_m_s2": result.edge,
        "findings": [finding.name for finding in result.findings],
        "notices": [*(finding.message for finding in result.findings), *result.notices],
    }
    row |= {f"{state}_s": float(time) for state, time in zip(STATES, states)}
    row |= {f"{flag}_samples": int(result.has_flag(flag).sum()) for flag in FLAGS}
    if result.first_gyro_bias.size:
        for end, bias in (("start", result.first_gyro_bias), ("end", result.gyro_bias[-1])):
            row |= {f"gyro_bias_{end}_{axis}_rad_s": float(value) for axis, value in zip(("wx", "wy", "wz"), bias)}
    return row


def _write(fs: Any, table: pyarrow.Table, path: str) -> None:
    """Writes a table that readers see whole or not at all: an object appears with its last byte."""
    folder, name = posixpath.split(path)
    fs.makedirs(folder, exist_ok=True)
    part = f"{folder}/.{name}.part" if _is_local(fs) else path
    with fs.open(part, "wb") as file:
        pyarrow.parquet.write_table(table, file, compression="zstd")
    if part != path:
        os.replace(part, path)


def _read(fs: Any, path: str) -> pyarrow.Table:
    """The rows in a file, or in the files of a folder; columns that another version lacks are null."""
    fs.invalidate_cache()
    if not fs.exists(path):
        return SCHEMA.empty_table()
    # A worker that was killed may have left half a file.
    files = pyarrow.dataset.dataset(path, SCHEMA, format="parquet", filesystem=fs, exclude_invalid_files=True)
    return files.to_table()


def _read_new(fs: Any, root: str) -> pyarrow.Table:
    """The rows that workers have written since the last completed call, without duplicates."""
    table = _read(fs, f"{root}/{NEW}")
    feet = zip(table["recording"].to_pylist(), table["foot"].to_pylist())
    places = {foot: place for place, foot in enumerate(feet)}.values()
    return table.take(pyarrow.array(places, pyarrow.int64()))


def _collect(fs: Any, root: str, lost: Sequence[Row] = ()) -> pyarrow.Table:
    """Returns all rows. New rows, and rows of `lost` recordings, replace earlier ones in the file."""
    rows = _read(fs, f"{root}/{ROWS}")
    new = pyarrow.concat_tables([_read_new(fs, root), pyarrow.Table.from_pylist(list(lost), schema=SCHEMA)])
    if new.num_rows:
        is_old = pyarrow.compute.invert(pyarrow.compute.is_in(rows["recording"], new["recording"].combine_chunks()))
        rows = pyarrow.concat_tables([rows.filter(is_old), new])
        rows = rows.sort_by([(name, "ascending") for name in ("robot", "recording", "foot")])
        _write(fs, rows, f"{root}/{ROWS}")
        fs.rm(f"{root}/{NEW}", recursive=True)
    return rows
