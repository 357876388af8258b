"""What a worker does: recordings, or one foot of a recording, from their source to the destination."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import _footfall
from .._settings import BatchDict, IdentityDict, ReadDict, SettingsDict
from ._need import need
from ._retry import patiently, sentence
from ._storage import TABLES, Storage, StorageOptions, fetch


@dataclass(frozen=True)
class Task:
    """What a worker is given."""

    url: str
    identity: IdentityDict
    options: ReadDict
    settings: SettingsDict
    batch: BatchDict
    out: str
    storage_options: StorageOptions
    before: tuple[str, ...]
    """The files of the recording that the destination has, below it."""
    run: str
    """Names the unfinished files of this call."""
    retries: int = 0
    """How often storage is asked again, with growing pauses."""
    foot: str | None = None
    """The one foot that is estimated, of a recording that has several; the others have tasks of their own."""


@dataclass(frozen=True)
class Done:
    """What a worker gives back."""

    reason: str | None
    """Why it was estimated; ``None`` where nothing had changed."""
    rows: tuple[dict[str, Any], ...]
    feet: tuple[str, ...]
    """Feet that want a task each; then nothing is written yet."""
    node: str
    pid: int
    seconds: float


UNREADABLE = "it cannot be read now"
"""Why a recording has a row although nothing was read of it."""


def work_all(tasks: Sequence[Task]) -> list[Done]:
    """Does short tasks one after the other."""
    return [work(task) for task in tasks]


def work(task: Task) -> Done:
    """Estimates a recording where its results are missing or of something else.

    Raises
    ------
    OSError
        The destination or the folder for temporary files cannot be written, which concerns every recording.
    """
    begin = time.monotonic()
    storage = Storage(task.out, task.storage_options)
    with contextlib.ExitStack() as stack:

        @functools.cache
        def folder() -> Path:
            # Folders cost more than all else about a short recording, so there is one only where it is needed.
            return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="footfall-")))

        try:
            reason, rows, feet = _estimated(task, storage, folder)
        except OSError as error:
            raise OSError(f"{storage.url}, {task.identity['name']}: {sentence(error)}") from error
    return Done(reason, tuple(rows), feet, _node(), os.getpid(), time.monotonic() - begin)


Worked = tuple["str | None", list[dict[str, Any]], tuple[str, ...]]


def _estimated(task: Task, storage: Storage, folder: Callable[[], Path]) -> Worked:
    try:
        fetched = patiently(lambda: fetch(task.url, task.storage_options, folder), task.retries)
        path = os.fspath(fetched)
    except FileNotFoundError:
        # The Rust part says in a row that it cannot be read.
        path = os.path.join(folder(), "missing")
    except Exception as error:
        # Whatever a file system raises about this source concerns no other.
        return _unreadable(task, storage, folder(), sentence(error))
    arguments = task.identity, task.options, task.settings
    reason = "foot"
    if task.foot is None:
        before = os.devnull
        if task.before:
            before = os.fspath(folder() / "before")
            patiently(lambda: _mirror(storage, task.before, Path(before)), task.retries)
        why, rows = _footfall.batch_plan(path, *arguments, task.batch, before)
        if why is None:
            return None, json.loads(rows), ()
        reason = why
        patiently(lambda: _remove(storage, task.before), task.retries)
        feet = _footfall.batch_feet(path, task.options, task.settings, task.batch)
        if len(feet) > 1:
            return reason, [], tuple(feet)
    batch: BatchDict = {**task.batch, "only_foot": task.foot}

    def estimate() -> str:
        if storage.is_local:
            return _footfall.batch_recording(path, *arguments, batch, storage.path(""))
        with storage.staging(task.run) as out:
            text = _footfall.batch_recording(path, *arguments, batch, os.fspath(out))
            _put(storage, out)
        return text

    return reason, json.loads(patiently(estimate, task.retries)), ()


def _unreadable(task: Task, storage: Storage, folder: Path, why: str) -> Worked:
    """A row that says why a recording cannot be read, as one of the program. Earlier results stay."""
    arguments = task.identity, task.options, task.settings
    batch: BatchDict = {**task.batch, "only_foot": task.foot}
    missing = os.path.join(folder, "missing")
    parquet, pyarrow = need("pyarrow.parquet"), need("pyarrow")

    with storage.staging(task.run) as out:
        rows = json.loads(_footfall.batch_recording(missing, *arguments, batch, os.fspath(out)))
        [file] = out.rglob("*.parquet")
        error = f"{task.identity['name']} cannot be read: {why}"
        rows[0]["error"] = error
        has_results = any(not below.startswith("recordings/") for below in task.before)
        if not has_results:
            table = parquet.ParquetFile(file).read()
            place = table.schema.get_field_index("error")
            table = table.set_column(place, table.schema.field(place), pyarrow.array([error]))
            parquet.write_table(table, file)
            patiently(lambda: _remove(storage, task.before), task.retries)
            patiently(lambda: _put(storage, out), task.retries)
    return UNREADABLE, rows, ()


def _put(storage: Storage, staged: Path) -> None:
    for table in TABLES:
        for file in sorted((staged / table).rglob("*.parquet")):
            storage.put(file, file.relative_to(staged).as_posix())


def _mirror(storage: Storage, files: tuple[str, ...], folder: Path) -> None:
    """The rows of a recording, and empty files in place of its tables: what the rule looks at."""
    for below in files:
        local = folder / below
        if below.startswith("recordings/"):
            storage.get(below, local)
        else:
            local.parent.mkdir(parents=True, exist_ok=True)
            local.touch()


def _remove(storage: Storage, files: tuple[str, ...]) -> None:
    """Removes earlier results: rows first, so that what is half removed does not pass for done."""
    for below in sorted(files, key=lambda below: not below.startswith("recordings/")):
        storage.remove(below)


def _node() -> str:
    """This machine: by Ray's id in a worker, else by its name."""
    ray = sys.modules.get("ray")
    if ray is None or not ray.is_initialized():
        return socket.gethostname()
    return str(ray.get_runtime_context().get_node_id())
