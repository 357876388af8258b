"""Tasks of recordings, handed to Ray a few at a time."""

from __future__ import annotations

import os
import posixpath
import time
import uuid
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from .._settings import (
    BatchDict,
    Config,
    Gravity,
    Preset,
    Times,
    TimeUnit,
    read_options,
    settings,
)
from .. import _footfall
from ._need import need
from ._report import Outcome, Report
from ._sources import Recordings, Source, find
from ._storage import PART, Storage, StorageOptions
from ._work import Done, Task, work

MEMORY = 512 << 20
"""What a task may need, bytes: ``docs/fleet.md`` has what was measured."""

WAITING = 4
"""As many tasks are with Ray for each of its cores: enough that none waits for the next."""

FEWEST = 16
"""As many tasks are with Ray at least, so that a cluster that grows finds some."""


def estimate(
    recordings: Recordings,
    out: str | os.PathLike[str],
    *,
    preset: Preset = "default",
    config: Config | None = None,
    format: str | None = None,
    rate: float | None = None,
    gravity: Gravity | None = None,
    axes: str | None = None,
    window: str | None = None,
    topic: str | Sequence[str] | None = None,
    frame: str | Sequence[str] | None = None,
    load_topic: str | Sequence[str] | None = None,
    map: str | Mapping[str, str] | None = None,
    units: str | None = None,
    time_unit: TimeUnit | None = None,
    times: Times | None = None,
    strict: bool = False,
    robot: str | None = None,
    path_pattern: str | None = None,
    column: str = "path",
    storage_options: StorageOptions | None = None,
    memory: int = MEMORY,
    retries: int = 5,
    progress: Callable[[Outcome], None] | None = None,
) -> Report:
    """Estimates the recordings whose results are missing or of something else, on a Ray cluster.

    A recording has a task, one with several feet a task for each of them. The tables are those of
    ``footfall batch``: ``samples``, ``events`` and ``recordings``, by robot, foot and day, with the same
    bytes. What is done is not done again: the row of a recording is written last, and says the hash of
    its bytes, the version and the hash of the settings. Call it again after anything that went wrong.
    One call at a time works on a destination.

    Ray is the one that is connected (``ray.init``), or is started on this machine.

    Parameters
    ----------
    recordings : path, URL, Source, several of them, or ray.data.Dataset
        A recording, a folder of recordings, or a pattern such as ``"s3://robots/*/2026-11-21/*.mcap"``.
        Local paths are those of the workers. A dataset has them in `column`, and may have the columns
        ``robot``, ``foot`` and ``day``; it is read as a stream.
    out : path or URL
        The folder of the tables. A local one is on a file system that all workers share.
    preset, config, gravity, axes
        As of :func:`footfall.estimate`.
    format, rate, topic, frame, load_topic, map, units, time_unit, times
        As of :func:`footfall.read`.
    window : str, optional
        Length of the window with half-widths, such as ``"50ms"``.
    strict : bool
        Whether a recording that is not plausible counts as failed.
    robot : str, optional
        The robot of all recordings; else that of the source, else the first folder below what was given.
    path_pattern : str, optional
        What the paths of recordings say, such as ``"{robot}/{day}/{foot}.mcap"``, as of ``footfall batch``.
    column : str
        The column of a dataset that has the paths.
    storage_options : mapping, optional
        By protocol, what fsspec is to know of it, such as ``{"s3": {"endpoint_url": "https://..."}}``; the
        usual variables and files of the protocol are read all the same.
    memory : int, bytes
        What a task may need: Ray starts no more of them on a machine than fit.
    retries : int, 0 or more
        How often a task is started again where its worker or machine is lost, or storage fails.
    progress : callable, optional
        Is called with each outcome, as it comes.

    Returns
    -------
    Report
        What became of each recording. A recording that cannot be estimated has a row that says why.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    FileNotFoundError
        A folder or file of `recordings` is not there.
    OSError
        The destination cannot be written.
    ImportError
        The extra is not installed.
    """
    ray = need("ray")
    begin = time.monotonic()
    given = settings(preset, config, gravity, rate, axes, format)
    options = read_options(format, rate, gravity, topic, frame, load_topic, map, units, time_unit, times)
    batch: BatchDict = {"window": window, "strict": strict, "only_foot": None}
    # What is wrong with an argument is said here, and not by a worker.
    _footfall.batch_settings_hash(options, given, batch)
    access = storage_options or {}
    destination = os.fspath(out)
    if "://" not in destination:
        destination = os.path.abspath(destination)
    storage = Storage(destination, access)
    run = uuid.uuid4().hex[:12]
    before = _before(storage)
    if not ray.is_initialized():
        ray.init()
    
    def task(source: Source) -> Task:
        identity = source.identity(path_pattern)
        url = source.url if "://" in source.url else os.path.abspath(source.url)
        known = before.get(_footfall.batch_key(identity["name"]), ())
        return Task(url, identity, options, given, batch, destination, access, known, run)

    tasks = (task(source) for source in find(recordings, column, robot, format, access))
    remote = ray.remote(num_cpus=1, memory=memory, max_retries=retries, retry_exceptions=[OSError])(work)
    outcomes = []
    for outcome in _outcomes(ray, remote, tasks):
        outcomes.append(outcome)
        if progress is not None:
            progress(outcome)
    _remove_unfinished(storage, run)
    return Report(tuple(outcomes), time.monotonic() - begin)


def _before(storage: Storage) -> dict[str, tuple[str, ...]]:
    """The files of each recording that the destination has, by their key; unfinished ones are removed."""
    files: dict[str, list[str]] = defaultdict(list)
    for below in storage.files():
        name = posixpath.basename(below)
        if name.startswith(".") and name.endswith(PART):
            storage.remove(below)
        elif name.endswith(".parquet"):
            files[name.removesuffix(".parquet")].append(below)
    return {key: tuple(several) for key, several in files.items()}


def _remove_unfinished(storage: Storage, run: str) -> None:
    """Removes what workers that were lost in this call have left."""
    if storage.is_local:
        for below in list(storage.files()):
            if below.endswith(PART) and f".{run}." in below:
                storage.remove(below)


def _outcomes(ray: Any, remote: Any, tasks: Iterator[Task]) -> Iterator[Outcome]:
    """Hands tasks to Ray, no more than it has use for, and takes what comes back."""
    # Feet of a recording that was looked at come before the next recording.
    feet: list[tuple[Task, str | None]] = []
    waiting: dict[Any, tuple[Task, str | None]] = {}
    is_left = True
    while is_left or feet or waiting:
        cores = int(ray.cluster_resources().get("CPU", 1))
        while (is_left or feet) and len(waiting) < max(FEWEST, WAITING * cores):
            if feet:
                task, reason = feet.pop()
            else:
                following = next(tasks, None)
                if following is None:
                    is_left = False
                    break
                task, reason = following, None
            waiting[remote.remote(task)] = (task, reason)
        if not waiting:
            continue
        # Now and then it is looked whether the cluster has grown.
        ready, _ = ray.wait(list(waiting), num_returns=1, timeout=1.0)
        for reference in ready:
            task, reason = waiting.pop(reference)
            try:
                done: Done = ray.get(reference)
            except ray.exceptions.RayTaskError as error:
                # A destination that cannot be written stands in the way of all recordings.
                raise error.as_instanceof_cause() from error
            except ray.exceptions.RayError as error:
                yield _lost(task, error)
                continue
            if done.feet:
                feet.extend((replace(task, foot=foot), done.reason) for foot in done.feet)
            else:
                yield _outcome(task, done, reason or done.reason)


def _outcome(task: Task, done: Done, reason: str | None) -> Outcome:
    errors = [str(row["error"]) for row in done.rows if row["status"] == "failed"]
    status = "failed" if errors else "done" if reason else "up_to_date"
    return Outcome(
        recording=task.identity["name"],
        foot=task.foot,
        status=status,
        reason=reason,
        error=errors[0] if errors else None,
        rows=done.rows,
        node=done.node,
        pid=done.pid,
        seconds=done.seconds,
    )


def _lost(task: Task, error: BaseException) -> Outcome:
    sentence = str(error).strip().splitlines()
    return Outcome(
        recording=task.identity["name"],
        foot=task.foot,
        status="lost",
        reason="lost",
        error=f"{type(error).__name__}: {sentence[0] if sentence else ''}",
        rows=(),
        node="",
        pid=0,
        seconds=0.0,
    )
