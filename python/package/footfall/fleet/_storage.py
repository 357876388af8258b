"""Files by fsspec: in bounded memory, and at the destination whole or not at all."""

from __future__ import annotations

import contextlib
import os
import posixpath
import shutil
import uuid
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ._need import need

CHUNK = 8 << 20
"""Bytes that are in memory of a file on its way."""

TABLES = ("samples", "events", "recordings")
"""The folders of tables, in the order in which they are written: the rows are last."""

PART = ".part"
"""What names of unfinished files end in; they begin with a point."""


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


class Storage:
    """A folder of tables, by its path or URL."""

    def __init__(self, url: str, options: StorageOptions) -> None:
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

    def paths(self, table: str) -> list[str]:
        """The paths of all files of a table, in the file system."""
        self._fs.invalidate_cache()
        try:
            return list(self._fs.find(self.path(table)))
        except FileNotFoundError:
            return []

    def files(self) -> Iterator[str]:
        """The files of all tables, by their paths below the folder."""
        for table in TABLES:
            for path in self.paths(table):
                yield path[len(self._root) + 1 :]

    def put(self, local: Path, below: str, run: str) -> None:
        """Writes a file; readers see it whole or not at all."""
        path = posixpath.join(self._root, below)
        if not self.is_local:
            # An object appears when its last part is there.
            self._fs.put_file(os.fspath(local), path, chunksize=CHUNK)
            return
        os.makedirs(os.path.dirname(path), exist_ok=True)
        name = f".{os.path.basename(path)}.{run}.{uuid.uuid4().hex}{PART}"
        part = os.path.join(os.path.dirname(path), name)
        try:
            with open(local, "rb") as source, open(part, "wb") as target:
                shutil.copyfileobj(source, target, CHUNK)
            os.replace(part, path)
        finally:
            with contextlib.suppress(FileNotFoundError):
                os.remove(part)

    def get(self, below: str, local: Path) -> bool:
        """Takes a file, where it is there."""
        local.parent.mkdir(parents=True, exist_ok=True)
        try:
            copy(self._fs, posixpath.join(self._root, below), local)
        except FileNotFoundError:
            return False
        return True

    def remove(self, below: str) -> None:
        """Removes a file, if it is there."""
        with contextlib.suppress(FileNotFoundError):
            self._fs.rm_file(posixpath.join(self._root, below))


def copy(fs: Any, path: str, local: Path) -> None:
    """Copies a file to this machine, in pieces."""
    with fs.open(path, "rb", block_size=CHUNK, cache_type="readahead") as source:
        with open(local, "wb") as target:
            shutil.copyfileobj(source, target, CHUNK)


def fetch(url: str, options: StorageOptions, folder: Path) -> Path:
    """A recording as a file or folder of this machine: itself, or a copy below `folder`."""
    fs, path = file_system(url, options)
    path = path.rstrip("/")
    if is_local(fs):
        return Path(path)
    local = folder / posixpath.basename(path)
    if fs.isfile(path):
        copy(fs, path, local)
        return local
    files = fs.find(path)
    if files:
        local.mkdir()
    for file in files:
        copy(fs, file, local / posixpath.basename(file))
    return local
