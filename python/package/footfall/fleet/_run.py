"""Tasks of recordings, handed out a few at a time."""

from __future__ import annotations

import contextlib
import os
import socket
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

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
from .._words import with_arguments
from ._catalog import Catalog
from ._cluster import Cluster, LostError, Threads, Workers, connected
from ._lock import exclusive
from ._need import need
from ._report import Outcome, Report
from ._sources import Recordings, Source, find, real_of
from ._storage import Storage, StorageOptions
from ._work import UNREADABLE, Done, Task, work_all

MEMORY = 512 << 20
"""What a task may need, bytes: ``docs/fleet.md`` has what was measured."""

WAITING = 4
"""As many tasks are with Ray for each of its cores: enough that none waits for the next."""

FEWEST = 16
"""As many tasks are with Ray at least, so that a cluster that grows finds some."""

SHORT_BYTES = 1 << 20
"""Up to this length a recording shares its task with others, bytes."""

LARGEST_GROUP = 32
"""As many recordings share a task at most."""

GROUP_BYTES = 8 << 20
"""They are of this length at most together, bytes."""

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
    not_topic: str | Sequence[str] | None = None,
    frame: str | Sequence[str] | None = None,
    load_topic: str | Sequence[str] | None = None,
    map: str | Mapping[str, str] | None = None,
    units: str | None = None,
    scale: tuple[float, float] | None = None,
    decimal: str | None = None,
    time_unit: TimeUnit | None = None,
    times: Times | None = None,
    estimate_again: bool = False,
    strict: bool = False,
    robot: str | None = None,
    path_pattern: str | None = None,
    column: str = "path",
    storage_options: StorageOptions | None = None,
    memory: int = MEMORY,
    retries: int = 5,
    verify: Literal["listing", "contents"] = "listing",
    jobs: int | None = None,
    progress: Callable[[Outcome], None] | None = None,
) -> Report:
    """Estimates the recordings whose results are missing or of something else, on a Ray cluster.

    A recording has a task, one with several feet a task for each of them; short ones share one. The tables are
    those of ``footfall batch``: ``samples``, ``events`` and ``recordings``, by robot, foot and day, with the
    same bytes. What is done is not done again: the row of a recording is written last, and says the hash of
    its bytes, the version and the hash of the settings. Call it again after anything that went wrong.
    One call at a time works on a destination; a second one is refused.

    Ray is the one that is connected (``ray.init``), or that runs on this machine; else one is started, and shut
    down when the call ends. A call that finds nothing to do needs none.

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
    format, rate, topic, not_topic, frame, load_topic, map, units, scale, decimal, time_unit,
    times
        As of :func:`footfall.read`.
    estimate_again : bool
        As of :func:`footfall.estimate_file`.
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
        How often a task is started again where its worker or machine is lost, and how often storage is asked
        again, after 0.5 s, 1 s, 2 s and so on.
    verify : {"listing", "contents"}
        What shows that a recording has not changed: its length, times and ETag, as its file system lists
        them, or the hash of its bytes, for which all recordings are read.
    jobs : int, 1 or more, optional
        Threads of this process, in place of Ray.
    progress : callable, optional
        Is called with each outcome, as it comes.

    Returns
    -------
    Report
        What became of each recording. A recording that cannot be read or estimated has a row that says why.

    Raises
    ------
    ValueError
        An argument is out of its range; the message names it, its value and the range.
    TypeError
        `recordings` is of another type, such as a table of pandas.
    FileNotFoundError
        A folder or file of `recordings` is not there, or there is no recording in it.
    BlockingIOError
        Another call or program writes to the destination.
    OSError
        The destination cannot be written. Tasks that are left are cancelled.
    ImportError
        The extra is not installed.
    """
    if jobs is None:
        need("ray")
    elif jobs < 1:
        raise ValueError(f"jobs is {jobs}, but 1 or more is expected")
    begin = time.monotonic()
    given = settings(preset, config, gravity, rate, axes, format)
    options = read_options(
        format, rate, gravity, topic, frame, load_topic, map, units, time_unit, times, not_topic, scale, decimal,
        estimate_again,
    )
    batch: BatchDict = {"window": window, "strict": strict, "only_foot": None}
    # Invalid arguments are refused here, and not by a worker.
    settings_hash = _footfall.batch_settings_hash(options, given, batch)
    if verify not in ("listing", "contents"):
        raise ValueError(f"verify is {verify!r}, but 'listing' or 'contents' is expected")
    access = storage_options or {}
    destination = os.fspath(out)
    if "://" not in destination:
        destination = os.path.abspath(destination)
    storage = Storage(destination, access)
    run = uuid.uuid4().hex[:12]
    outcomes = []
    with contextlib.ExitStack() as stack:
        stack.enter_context(exclusive(storage, run))
        storage.remove_unfinished()
        catalog = Catalog(storage, f"{_footfall.__version__} {settings_hash}")

        def todo(source: Source) -> _Todo | Outcome:
            identity = source.identity(path_pattern)
            real = real_of(source.url)
            if source.name is None:
                identity["name"] = catalog.name_of(real) or identity["name"]
            key = _footfall.batch_key(identity["name"])
            rows = catalog.unchanged(key, real, source.stamp, identity) if verify == "listing" else None
            url = source.url if "://" in source.url else os.path.abspath(source.url)
            before = catalog.files.get(key, ())
            task = Task(url, identity, options, given, batch, destination, access, before, run, retries)
            if rows is None:
                return _Todo(key, source, task, is_alone=not 0 < source.size <= SHORT_BYTES)
            return _outcome(task, Done(None, tuple(rows), (), socket.gethostname(), os.getpid(), 0.0), None)

        def finish(kind: Any, error: BaseException | None, trace: Any) -> None:
            try:
                storage.remove_unfinished(run)
                catalog.save()
            except Exception:
                # An error of the call counts more than what follows from it.
                if error is None:
                    raise

        stack.push(finish)
        sources = find(recordings, column, robot, format, access, destination)

        def start(stack: contextlib.ExitStack) -> Workers:
            if jobs is not None:
                return Threads(jobs)
            return Cluster(stack.enter_context(connected()), memory, retries)

        call = _Call(catalog, (todo(source) for source in sources))
        for outcome in call.outcomes(stack, start):
            outcomes.append(outcome)
            if progress is not None:
                progress(outcome)
    return Report(tuple(outcomes), time.monotonic() - begin)


@dataclass(frozen=True)
class _Todo:
    """A recording that needs a worker, or one foot of it."""

    key: str
    source: Source
    task: Task
    is_alone: bool
    """Whether it has a task for itself."""
    reason: str | None = None
    """Why it is estimated, where an earlier task has found that out."""


class _Call:
    """The tasks of one call."""

    def __init__(self, catalog: Catalog, todo: Iterator[_Todo | Outcome]) -> None:
        self._catalog = catalog
        self._todo = todo
        self._handed_out = 0
        self._ready: list[Outcome] = []
        # Feet of a recording that was looked at, and recordings whose worker was lost with others, come first.
        self._first: list[_Todo] = []

    def outcomes(
        self, stack: contextlib.ExitStack, start: Callable[[contextlib.ExitStack], Workers]
    ) -> Iterator[Outcome]:
        """Hands tasks to workers, no more than they have use for, and takes what comes back.

        Workers are started for the first task. At the end of `stack` no task is left.
        """
        first = self._next()
        yield from self._taken()
        if first is None:
            return
        self._first.append(first)
        workers = start(stack)
        waiting: dict[Any, list[_Todo]] = {}
        stack.callback(lambda: workers.cancel(list(waiting)))
        while True:
            cores = workers.cores()
            while len(waiting) < max(FEWEST, WAITING * cores):
                # Short recordings go together, more and more of them, so that a small fleet is spread all the same.
                group = self._group(1 + self._handed_out // (8 * cores))
                if not group:
                    break
                # A worker that is lost with several costs one attempt: each of them is then tried alone.
                reference = workers.submit([todo.task for todo in group], is_last_chance=len(group) == 1)
                waiting[reference] = group
            yield from self._taken()
            if not waiting:
                return
            for reference in workers.ready(list(waiting)):
                yield from self._come_back(workers, reference, waiting.pop(reference))

    def _taken(self) -> Iterator[Outcome]:
        ready, self._ready = self._ready, []
        yield from ready

    def _group(self, most: int) -> list[_Todo]:
        """The next recordings of a task: one, or up to `most` of the short ones."""
        group: list[_Todo] = []
        size = 0
        while (todo := self._next()) is not None:
            if group and (todo.is_alone or size + todo.source.size > GROUP_BYTES):
                self._first.append(todo)
                break
            group.append(todo)
            size += todo.source.size
            if todo.is_alone or len(group) >= min(most, LARGEST_GROUP):
                break
        self._handed_out += len(group)
        return group

    def _next(self) -> _Todo | None:
        if self._first:
            return self._first.pop()
        for todo in self._todo:
            if isinstance(todo, _Todo):
                return todo
            self._ready.append(todo)
        return None

    def _come_back(self, workers: Workers, reference: Any, group: list[_Todo]) -> Iterator[Outcome]:
        try:
            several = workers.get(reference)
        except LostError as error:
            if len(group) > 1:
                self._first.extend(replace(todo, is_alone=True) for todo in group)
            else:
                yield _lost(group[0].task, str(error))
            return
        for todo, done in zip(group, several):
            if done.feet:
                self._first.extend(
                    replace(todo, task=replace(todo.task, foot=foot), reason=done.reason, is_alone=True)
                    for foot in done.feet
                )
                continue
            if done.reason != UNREADABLE:
                self._catalog.add(todo.key, todo.source, todo.task.identity, done.rows)
            yield _outcome(todo.task, done, todo.reason or done.reason)


def _outcome(task: Task, done: Done, reason: str | None) -> Outcome:
    errors = [with_arguments(str(row["error"])) for row in done.rows if row["status"] == "failed"]
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


def _lost(task: Task, error: str) -> Outcome:
    return Outcome(
        recording=task.identity["name"],
        foot=task.foot,
        status="lost",
        reason="lost",
        error=error,
        rows=(),
        node="",
        pid=0,
        seconds=0.0,
    )
