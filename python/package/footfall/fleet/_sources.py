"""Which recordings there are, and what they are called: as ``footfall batch`` has it, by URL."""

from __future__ import annotations

import os
import posixpath
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from typing import Any

from .. import _footfall
from .._settings import IdentityDict
from ._storage import StorageOptions, file_system, is_local

UNKNOWN = "unknown"

# As many first bytes show whether a file is a recording, if its name does not.
HEAD = 1 << 16

Recordings = Any
"""What :func:`footfall.fleet.estimate` takes: a path or URL, several of them, or a ``ray.data.Dataset``."""


@dataclass(frozen=True)
class Source:
    """A recording, and what is known about it before it is read."""

    url: str
    """The file, or the folder of a rosbag2: a path, or a URL that fsspec knows."""
    robot: str | None = None
    """The robot. Where it is not given: the first folder below a folder that was given; else unknown."""
    foot: str | None = None
    """The foot, where the recording has one only and does not name it; else the name without extension."""
    day: str | None = None
    """The day as ``YYYY-MM-DD``, where the recording's clock has none."""
    name: str | None = None
    """What it is called in tables; else its path as it is given, without protocol and root."""
    size: int = 0
    """Its length in bytes where it is known, to begin with long ones."""

    def identity(self, path_pattern: str | None) -> IdentityDict:
        """What the Rust part takes: where the path is as `path_pattern` has it, that wins."""
        name = self.name if self.name is not None else name_of(self.url)
        identity: IdentityDict = {
            "name": name,
            "robot": UNKNOWN if self.robot is None else self.robot,
            "foot": self.foot,
            "day": self.day,
        }
        return identity if path_pattern is None else _footfall.batch_identity(identity, path_pattern)


def name_of(url: str) -> str:
    """A path without what says from where: no protocol, root, ``.`` and ``..``."""
    parts: list[str] = []
    for part in url.rpartition("://")[2].replace(os.sep, "/").split("/"):
        if part == "..":
            del parts[-1:]
        elif part not in ("", "."):
            parts.append(part)
    return "/".join(parts)


def find(
    recordings: Recordings,
    column: str,
    robot: str | None,
    format: str | None,
    options: StorageOptions,
) -> Iterator[Source]:
    """All recordings; those of folders by length, the longest first."""
    if hasattr(recordings, "iter_rows"):
        yield from _of_dataset(recordings, column, robot)
        return
    if isinstance(recordings, (str, os.PathLike, Source)):
        recordings = [recordings]
    several: list[Source] = []
    for recording in _strings(recordings):
        if isinstance(recording, Source):
            several.append(recording)
        else:
            several.extend(_below(recording, options, format))
    names = set()
    for source in sorted(several, key=lambda source: (-source.size, source.url)):
        if robot is not None:
            source = replace(source, robot=robot)
        name = source.name or name_of(source.url)
        if name not in names:
            names.add(name)
            yield source


def _strings(recordings: Iterable[Any]) -> Iterator[str | Source]:
    for recording in recordings:
        yield recording if isinstance(recording, Source) else os.fspath(recording)


def _of_dataset(dataset: Any, column: str, robot: str | None) -> Iterator[Source]:
    for row in dataset.iter_rows():
        if column not in row:
            known = ", ".join(row)
            raise ValueError(f"column is {column!r}, but the dataset has {known}")
        known_robot = row.get("robot") if robot is None else robot
        yield Source(str(row[column]), robot=known_robot, foot=row.get("foot"), day=row.get("day"))


def _below(url: str, options: StorageOptions, format: str | None) -> Iterator[Source]:
    """The recordings in a folder, those of a pattern, or the one of this name."""
    fs, root = file_system(url, options)
    root = root.rstrip("/")
    if any(wildcard in root for wildcard in "*?["):
        fixed = root[: min(root.find(w) for w in "*?[" if w in root)].rpartition("/")[0]
        found = {path: about for path, about in fs.glob(root, detail=True).items()}
        yield from _grouped(fs, url, fixed, fixed, found, format)
        return
    about = fs.info(root)
    if about["type"] == "file":
        yield Source(url, size=int(about.get("size") or 0))
        return
    files = fs.find(root, detail=True)
    if _is_bag(files, root):
        size = sum(int(about.get("size") or 0) for about in files.values())
        yield Source(url, size=size)
        return
    yield from _grouped(fs, url, root, root, files, format)


def _grouped(
    fs: Any, url: str, root: str, parent: str, files: dict[str, Any], format: str | None
) -> Iterator[Source]:
    """Files that are recordings, and folders of a rosbag2."""
    protocol = url.rpartition("://")[0]
    given = url.rpartition("://")[2]
    given = given if not any(w in given for w in "*?[") else parent
    bags: dict[str, int] = {}
    folders = {posixpath.dirname(path) for path in files}
    for folder in folders:
        if _is_bag(files, folder):
            bags[folder] = 0
    for path, about in files.items():
        below = path[len(root) :].lstrip("/")
        if about["type"] != "file" or any(part.startswith(".") for part in below.split("/")):
            continue
        folder = posixpath.dirname(path)
        if folder in bags:
            bags[folder] += int(about.get("size") or 0)
        elif _is_recording(fs, path, format):
            size = int(about.get("size") or 0)
            yield _source(protocol, given, root, below, size)
    for folder, size in bags.items():
        yield _source(protocol, given, root, folder[len(root) :].lstrip("/"), size)


def _source(protocol: str, given: str, root: str, below: str, size: int) -> Source:
    path = posixpath.join(given, below)
    first, slash, _ = below.partition("/")
    robot = first if slash else PurePosixPath(root).name or UNKNOWN
    return Source(f"{protocol}://{path}" if protocol else path, robot=robot, size=size)


def _is_bag(files: dict[str, Any], folder: str) -> bool:
    names = [path for path in files if posixpath.dirname(path) == folder]
    has_data = any(name.lower().endswith((".mcap", ".db3", ".mcap.zstd", ".db3.zstd")) for name in names)
    return f"{folder}/metadata.yaml" in names and has_data


def _is_recording(fs: Any, path: str, format: str | None) -> bool:
    if is_local(fs):
        return _footfall.is_recording(path, format)
    # The name shows it of most; of others the first bytes do.
    with tempfile.TemporaryDirectory(prefix="footfall-") as folder:
        head = os.path.join(folder, posixpath.basename(path))
        with open(head, "wb") as file:
            if not _footfall.is_recording(head, format):
                file.write(fs.cat_file(path, end=HEAD))
        return _footfall.is_recording(head, format)
