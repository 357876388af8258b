"""Files by fsspec: in bounded memory, and at the destination whole or not at all."""

from __future__ import annotations

import contextlib
import os
import posixpath
import shutil
import tempfile
import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ._need import need

CHUNK = 8 << 20
"""Bytes that are in memory of a file on its way."""

TABLES = ("samples", "events", "recordings")
"""The folders of tables, in the order in which they are written: the rows are last."""

PART = ".part"
"""What names of unfinished files and folders end in; they begin with a point."""

STAMPS = ("ETag", "etag", "md5Hash", "content_md5", "LastModified", "last_modified", "updated", "mtime", "created")
"""What file systems call the hash of a file and the times of its changes."""


StorageOptions = Mapping[str, Mapping[str, Any]]
"""By protocol, what fsspec is to know, such as ``{"s3": {"endpoint_url": ...}}``."""


def file_system(url: str, options: StorageOptions) -> tuple[Any, str]:
    """The file system of a path or URL, and the path there."""
    protocol = url.partition("://")[0] if "://" in url else "file"
    fs, path = need("fsspec").core.url_to_fs(url, **options.get(protocol, {}))
    return fs, str(path)


def is_local(fs: Any) -> bool:
    """Whether it is that of this machine."""
    return "file" in ((fs.protocol,) if isinstance(fs.protocol, str) else fs.protocol)


def stamp_of(about: Mapping[str, Any]) -> str | None:
    """What changes with a file: its length, and the hash and times that a listing has of it; ``None`` without
    any."""
    stamps = [str(about[name]) for name in STAMPS if about.get(name) is not None]
    return " ".join([str(about.get("size")), *stamps]) if stamps else None


class Storage:
    """A folder of tables, by its path or URL."""

    def __init__(self, url: str, options: StorageOptions) -> None:
        self.url = url
        """The path or URL that was given."""
        self._fs, root = file_system(url, options)
        self._root = root.rstrip("/")

    @property
    def is_local(self) -> bool:
        """Whether it is a folder of this machine's file systems."""
        return is_local(self._fs)

    @property
    def filesystem(self) -> Any:
        """The file system, as fsspec has it."""
        return self._fs

    def path(self, below: str) -> str:
        """The path of what is below the folder, in the file system."""
        return posixpath.join(self._root, below)

    def files(self, *tables: str) -> dict[str, str]:
        """The files of tables, by their paths below the folder; those of rows with what changes with them."""
        if self.is_local:
            return {
                path[len(self._root) + 1 :]: stamp
                for table in tables or TABLES
                for path, stamp in _scanned(self.path(table), table == "recordings")
            }
        self._fs.invalidate_cache()
        found: dict[str, str] = {}
        for table in tables or TABLES:
            with contextlib.suppress(FileNotFoundError):
                listed = self._fs.find(self.path(table), detail=True)
                for path, about in listed.items():
                    found[path[len(self._root) + 1 :]] = stamp_of(about) or ""
        return found

    @contextlib.contextmanager
    def staging(self, run: str) -> Iterator[Path]:
        """A folder for files on their way, from which a local destination takes them by renaming."""
        if not self.is_local:
            with tempfile.TemporaryDirectory(prefix="footfall-") as folder:
                yield Path(folder)
            return
        path = Path(self.path(f".{run}.{uuid.uuid4().hex}{PART}"))
        path.mkdir(parents=True)
        try:
            yield path
        finally:
            shutil.rmtree(path, ignore_errors=True)

    def put(self, staged: Path, below: str) -> None:
        """Takes a file of :meth:`staging`; readers see it whole or not at all."""
        path = self.path(below)
        if self.is_local:
            os.makedirs(os.path.dirname(path), exist_ok=True)
            os.replace(staged, path)
        else:
            # An object appears when its last part is there.
            self._fs.put_file(os.fspath(staged), path, chunksize=CHUNK)

    def get(self, below: str, local: Path) -> bool:
        """Takes a file, where it is there."""
        local.parent.mkdir(parents=True, exist_ok=True)
        try:
            if self.is_local:
                shutil.copyfile(self.path(below), local)
            else:
                copy(self._fs, self.path(below), local)
        except FileNotFoundError:
            return False
        return True

    def remove(self, below: str) -> None:
        """Removes a file, if it is there."""
        with contextlib.suppress(FileNotFoundError):
            self._fs.rm_file(self.path(below))

    def remove_unfinished(self, run: str = "") -> None:
        """Removes what workers that were lost have left, in all calls or in one. Storage of objects has nothing
        unfinished that can be seen."""
        if not self.is_local:
            return
        for entry in list(os.scandir(self._root)):
            if entry.name.startswith(f".{run}") and entry.name.endswith(PART):
                shutil.rmtree(entry.path, ignore_errors=True)


def _scanned(folder: str, is_stamped: bool) -> Iterator[tuple[str, str]]:
    """The files below a folder of this machine. fsspec asks five times as long for what is not wanted here."""
    try:
        entries = list(os.scandir(folder))
    except FileNotFoundError:
        return
    for entry in entries:
        if entry.is_dir():
            yield from _scanned(entry.path, is_stamped)
        elif is_stamped:
            about = entry.stat()
            yield entry.path, f"{about.st_size} {about.st_mtime_ns} {about.st_ctime_ns}"
        else:
            yield entry.path, ""


def copy(fs: Any, path: str, local: Path) -> None:
    """Copies a file to this machine, in pieces."""
    with fs.open(path, "rb", block_size=CHUNK, cache_type="readahead") as source:
        with open(local, "wb") as target:
            shutil.copyfileobj(source, target, CHUNK)


GONE = (404, 410)
"""Statuses of HTTP that say that nothing is there."""

REFUSED = (401, 403)
"""Those that no repetition changes."""


def info(fs: Any, path: str) -> dict[str, Any]:
    """Returns type, length and times of a path.

    Raises
    ------
    FileNotFoundError
        It is not there.
    OSError
        It may be there, but the answer is a refusal or a failure. The file system of HTTP calls these "not found", too.
    """
    try:
        about: dict[str, Any] = fs.info(path)
    except FileNotFoundError as error:
        status = getattr(error.__cause__, "status", None)
        if status in (None, *GONE):
            raise
        message = f"{path} answers with the status {status}"
        raise (PermissionError if status in REFUSED else OSError)(message) from error
    return about


def fetch(url: str, options: StorageOptions, folder: Callable[[], Path]) -> Path:
    """A recording as a file or folder of this machine: itself, or a copy below the folder that `folder` makes."""
    fs, path = file_system(url, options)
    path = path.rstrip("/")
    if is_local(fs):
        return Path(path)
    local = folder() / posixpath.basename(path)
    fs.invalidate_cache()
    if info(fs, path)["type"] == "file":
        copy(fs, path, local)
        return local
    files = fs.find(path)
    if files:
        local.mkdir(exist_ok=True)
    for file in files:
        copy(fs, file, local / posixpath.basename(file))
    return local
