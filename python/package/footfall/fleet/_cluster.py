"""Who does the tasks: Ray, on the cluster that is connected or one that lives as long as a call, or threads."""

from __future__ import annotations

import concurrent.futures
import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from ._need import need
from ._work import Done, Task, work_all

LONGEST_FOLDER = 27
"""The sockets of Ray lie in its folder, and their paths have 107 bytes at most."""

CANCEL_S = 60.0
"""Time that tasks have to end after an error, s; after it their processes are killed."""

LOOK_S = 1.0
"""Period with which it is looked whether a cluster has grown, s."""


class LostError(Exception):
    """The process or machine that did a task is gone."""


class Workers(Protocol):
    """Does tasks, in the order in which they are handed out."""

    def cores(self) -> int:
        """As many tasks are done at the same time."""

    def submit(self, tasks: Sequence[Task], is_last_chance: bool) -> Any:
        """Hands tasks out together, and returns what stands for them; after a loss they are begun again only if
        there `is_last_chance`."""

    def ready(self, references: Sequence[Any]) -> Sequence[Any]:
        """What has been done of `references`, after a short wait for one."""

    def get(self, reference: Any) -> list[Done]:
        """What has come of tasks that are ready.

        Raises
        ------
        LostError
            Their worker was lost, again and again.
        OSError
            The destination cannot be written.
        """

    def cancel(self, references: Sequence[Any]) -> None:
        """Ends tasks, and returns when none of them can write any more."""


class Threads:
    """Threads of this process. The Rust part does the work, and releases the interpreter lock."""

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._pool = concurrent.futures.ThreadPoolExecutor(jobs)

    def cores(self) -> int:
        return self._jobs

    def submit(self, tasks: Sequence[Task], is_last_chance: bool) -> Any:
        return self._pool.submit(work_all, tasks)

    def ready(self, references: Sequence[Any]) -> Sequence[Any]:
        done, _ = concurrent.futures.wait(references, return_when=concurrent.futures.FIRST_COMPLETED)
        return list(done)

    def get(self, reference: Any) -> list[Done]:
        done: list[Done] = reference.result()
        return done

    def cancel(self, references: Sequence[Any]) -> None:
        self._pool.shutdown(cancel_futures=True)


class Cluster:
    """Workers of a Ray cluster."""

    def __init__(self, ray: Any, memory: int, retries: int) -> None:
        self._ray = ray
        self._begun_again = ray.remote(num_cpus=1, memory=memory, max_retries=retries)(work_all)
        self._tried_once = self._begun_again.options(max_retries=0)

    def cores(self) -> int:
        return int(self._ray.cluster_resources().get("CPU", 1))

    def submit(self, tasks: Sequence[Task], is_last_chance: bool) -> Any:
        return (self._begun_again if is_last_chance else self._tried_once).remote(tasks)

    def ready(self, references: Sequence[Any]) -> Sequence[Any]:
        ready, _ = self._ray.wait(list(references), num_returns=1, timeout=LOOK_S)
        return list(ready)

    def get(self, reference: Any) -> list[Done]:
        exceptions = self._ray.exceptions
        try:
            done: list[Done] = self._ray.get(reference)
        except exceptions.RayTaskError as error:
            raise (error.cause or error) from error
        except exceptions.RayError as error:
            lines = str(error).strip().splitlines()
            raise LostError(f"{type(error).__name__}: {lines[0] if lines else ''}") from error
        return done

    def cancel(self, references: Sequence[Any]) -> None:
        left = list(references)
        for is_forced in (False, True):
            if left:
                for reference in left:
                    self._ray.cancel(reference, force=is_forced)
                _, left = self._ray.wait(left, num_returns=len(left), timeout=CANCEL_S)


@contextlib.contextmanager
def connected() -> Iterator[Any]:
    """The module ``ray``, connected to a cluster.

    The order: the one that is connected; one that ``RAY_ADDRESS`` names or that runs on this machine; one that is
    started here, and shut down at the end together with its folder.
    """
    ray = need("ray")
    if ray.is_initialized():
        yield ray
        return
    try:
        ray.init(address="auto")
    except ConnectionError:
        if os.environ.get("RAY_ADDRESS"):
            raise
    else:
        try:
            yield ray
        finally:
            ray.shutdown()
        return
    folder = tempfile.mkdtemp(prefix="ray-", dir=_short_folder())
    try:
        ray.init(address="local", _temp_dir=folder, include_dashboard=False)
        yield ray
    finally:
        ray.shutdown()
        shutil.rmtree(folder, ignore_errors=True)


def _short_folder() -> str | None:
    for folder in (os.environ.get("RAY_TMPDIR"), tempfile.gettempdir(), "/tmp"):
        if folder and len(folder) <= LONGEST_FOLDER and os.path.isdir(folder):
            return folder
    return None
