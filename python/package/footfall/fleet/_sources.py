"""Which recordings there are, and what they are called: as ``footfall batch`` has it, by URL."""

from __future__ import annotations

import os
import posixpath
import tempfile
from collections import defaultdict
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

WILDCARDS = "*?["

# What the names of a rosbag2's files end in.
OF_BAGS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")

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
    given = url.rpartition("://")[2]
    if any(wildcard in root for wildcard in WILDCARDS):
        files = fs.glob(root, detail=True)
        yield from _in_folders(fs, url, _fixed(given), _fixed(root), files, format)
        return
    root = root.rstrip("/")
    about = fs.info(root)
    if about["type"] == "file":
        yield Source(url, size=_size(about))
        return
    files = fs.find(root, detail=True)
    if _is_bag(path for path in files if posixpath.dirname(path) == root):
        yield Source(url, size=sum(map(_size, files.values())))
        return
    yield from _in_folders(fs, url, given, root, files, format)


def _fixed(pattern: str) -> str:
    """The folder that a pattern names before its first wildcard."""
    first = min(pattern.find(wildcard) for wildcard in WILDCARDS if wildcard in pattern)
    folder, slash, _ = pattern[:first].rpartition("/")
    return folder or slash


def _in_folders(
    fs: Any, url: str, given: str, root: str, files: dict[str, Any], format: str | None
) -> Iterator[Source]:
    """Files that are recordings, and folders of a rosbag2; `given` is what `root` was called."""
    protocol = url.partition("://")[0] if "://" in url else ""
    by_folder: dict[str, list[str]] = defaultdict(list)
    for path, about in files.items():
        below = path[len(root) :].lstrip("/")
        is_hidden = any(part.startswith(".") for part in below.split("/"))
        if about["type"] == "file" and not is_hidden:
            by_folder[posixpath.dirname(path)].append(path)
    for folder, paths in by_folder.items():
        if folder != root and _is_bag(paths):
            size = sum(_size(files[path]) for path in paths)
            yield _source(protocol, given, root, folder[len(root) :].lstrip("/"), size)
            continue
        for path in paths:
            if _is_recording(fs, path, format):
                below = path[len(root) :].lstrip("/")
                yield _source(protocol, given, root, below, _size(files[path]))


def _size(about: dict[str, Any]) -> int:
    return int(about.get("size") or 0)


def _source(protocol: str, given: str, root: str, below: str, size: int) -> Source:
    path = posixpath.join(given, below)
    first, slash, _ = below.partition("/")
    robot = first if slash else PurePosixPath(root).name or UNKNOWN
    return Source(f"{protocol}://{path}" if protocol else path, robot=robot, size=size)


def _is_bag(paths: Iterable[str]) -> bool:
    """Whether the files of a folder are a rosbag2."""
    names = [posixpath.basename(path).lower() for path in paths]
    return "metadata.yaml" in names and any(name.endswith(OF_BAGS) for name in names)


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
