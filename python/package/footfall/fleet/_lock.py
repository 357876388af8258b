"""Exclusive use of a destination.

A local folder is locked as ``footfall batch`` locks it; the lock ends with the process. Object storage has no
locks: an object is created there, and written again and again while the call lives.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import socket
import threading
import time
from collections.abc import Iterator
from typing import Any

from ._storage import Storage

LOCK = ".lock"
"""Name of the object."""

RENEW_S = 10.0
"""Period with which a living call writes the object, s."""

STALE_S = 35.0
"""An object that has not changed for this long was left by a call that was killed, s."""


SETTLE_S = 1.0
"""Time after which each of two calls that take over sees which of them was last, s."""


@contextlib.contextmanager
def exclusive(storage: Storage, run: str) -> Iterator[None]:
    """Locks a destination.

    Raises
    ------
    BlockingIOError
        Another call or program writes there.
    """
    locked = _locked_folder(storage) if storage.is_local else _locked_object(storage, run)
    with locked:
        yield


def _refused(storage: Storage, holder: str) -> BlockingIOError:
    return BlockingIOError(f"{storage.url} is in use: {holder} writes there; wait until it is done")


@contextlib.contextmanager
def _locked_folder(storage: Storage) -> Iterator[None]:
    root = storage.path("")
    os.makedirs(root, exist_ok=True)
    try:
        import fcntl
    except ImportError:
        # Windows has no such lock; the program runs unlocked there, too.
        yield
        return
    folder = os.open(root, os.O_RDONLY)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise _refused(storage, "another process") from error
        except OSError:
            # Some network drives have none; the run goes on unlocked, as that of the program.
            pass
        yield
    finally:
        os.close(folder)


@contextlib.contextmanager
def _locked_object(storage: Storage, run: str) -> Iterator[None]:
    fs, path = storage.filesystem, storage.path(LOCK)
    since = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime())
    holder = f"process {os.getpid()} on {socket.gethostname()}, since {since}"
    contents = (f"{holder}\n{run} {count}\n".encode() for count in itertools.count())
    if not _created(fs, path, next(contents)):
        _wait_until_stale(storage, fs, path)
        fs.pipe_file(path, next(contents))
        # Of two calls that take over, the one that has written last goes on.
        time.sleep(SETTLE_S)
        _check_own(storage, fs, path, run)
    ended = threading.Event()

    def renew() -> None:
        while not ended.wait(RENEW_S):
            with contextlib.suppress(Exception):
                fs.pipe_file(path, next(contents))

    thread = threading.Thread(target=renew, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        with contextlib.suppress(Exception):
            fs.rm_file(path)


def _created(fs: Any, path: str, contents: bytes) -> bool:
    """Whether the object was not there and could be created; not every storage can do that in one step."""
    if _contents(fs, path):
        return False
    try:
        fs.pipe_file(path, contents, mode="create")
    except Exception:
        return False
    return True


def _contents(fs: Any, path: str) -> bytes:
    fs.invalidate_cache()
    try:
        return bytes(fs.cat_file(path))
    except FileNotFoundError:
        return b""


def _wait_until_stale(storage: Storage, fs: Any, path: str) -> None:
    """Returns when the holder of the lock has ended, or has not written for a while."""
    before = _contents(fs, path)
    end = time.monotonic() + STALE_S
    while before and time.monotonic() < end:
        time.sleep(min(1.0, STALE_S / 10.0))
        now = _contents(fs, path)
        if now and now != before:
            raise _refused(storage, now.decode(errors="replace").partition("\n")[0])
        before = now


def _check_own(storage: Storage, fs: Any, path: str, run: str) -> None:
    now = _contents(fs, path).decode(errors="replace")
    if run not in now:
        raise _refused(storage, now.partition("\n")[0] or "another call")
