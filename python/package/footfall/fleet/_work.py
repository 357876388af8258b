"""One task: a recording, or one foot of it, from its source to the destination."""

from __future__ import annotations

import json
import os
import socket
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import _footfall
from .._settings import BatchDict, IdentityDict, ReadDict, SettingsDict
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


def work(task: Task) -> Done:
    """Estimates a recording where its results are missing or of something else."""
    begin = time.monotonic()

    def done(
        reason: str | None, rows: list[dict[str, Any]], feet: tuple[str, ...] = ()
    ) -> Done:
        seconds = time.monotonic() - begin
        return Done(reason, tuple(rows), feet, _node(), os.getpid(), seconds)

    storage = Storage(task.out, task.storage_options)
    with tempfile.TemporaryDirectory(prefix="footfall-") as folder:
        try:
            path = os.fspath(fetch(task.url, task.storage_options, Path(folder)))
        except FileNotFoundError:
            # The Rust part says in a row that it cannot be read.
            path = os.path.join(folder, "missing")
        reason = "foot"
        arguments = task.identity, task.options, task.settings
        if task.foot is None:
            before = Path(folder) / "before"
            _mirror(storage, task.before, before)
            planned = _footfall.batch_plan(
                path, *arguments, task.batch, os.fspath(before)
            )
            if planned[0] is None:
                return done(None, json.loads(planned[1]))
            reason = planned[0]
            _remove(storage, task.before)
            feet = _footfall.batch_feet(path, task.options, task.settings, task.batch)
            if len(feet) > 1:
                return done(reason, [], tuple(feet))
        out = Path(folder) / "out"
        batch: BatchDict = {**task.batch, "only_foot": task.foot}
        text = _footfall.batch_recording(path, *arguments, batch, os.fspath(out))
        for table in TABLES:
            for file in sorted((out / table).rglob("*.parquet")):
                storage.put(file, file.relative_to(out).as_posix(), task.run)
        return done(reason, json.loads(text))


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
