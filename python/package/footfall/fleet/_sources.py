"""Which recordings there are, and what they are called: as ``footfall batch`` has it, by URL."""

from __future__ import annotations

import hashlib
import os
import posixpath
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from typing import Any

from .. import _footfall
from .._settings import IdentityDict
from ._storage import StorageOptions, file_system, info, is_local, stamp_of

UNKNOWN = "unknown"

# As many first bytes show whether a file is a recording, if its name does not.
HEAD = 1 << 16

WILDCARDS = "*?["

# Endings of the names of a rosbag2's files.
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
    stamp: str | None = None
    """Its length, times and ETag as its file system lists them, where they are known: while they are the same, it
    counts as unchanged."""

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


def real_of(url: str) -> str:
    """The one path or URL of a recording, however it was spelled."""
    return url.rstrip("/") if "://" in url else os.path.realpath(url)


def find(
    recordings: Recordings,
    column: str,
    robot: str | None,
    format: str | None,
    options: StorageOptions,
    out: str | None = None,
) -> Iterator[Source]:
    """All recordings, each once; those of folders by length, the longest first. What is below `out` is left out.

    Raises
    ------
    FileNotFoundError
        There are none.
    TypeError
        `recordings` is of another type.
    ValueError
        Two recordings have one name.
    """
    found: Iterable[Source]
    if _is_dataset(recordings):
        found = _each_once(_of_dataset(recordings, column, robot, options))
    else:
        if isinstance(recordings, (str, os.PathLike, Source)):
            recordings = [recordings]
        several = [
            source
            for recording in _strings(recordings)
            for source in (
                [_described(recording, options)]
                if isinstance(recording, Source)
                else _below(recording, options, format, out)
            )
        ]
        # Of several spellings of a recording the one that was given first counts.
        found = sorted(_each_once(several), key=lambda source: (-source.size, source.url))
    is_empty = True
    for source in found:
        is_empty = False
        yield source if robot is None else replace(source, robot=robot)
    if is_empty:
        raise FileNotFoundError(f"recordings: there is no recording in {recordings!r}")


def _each_once(sources: Iterable[Source]) -> Iterator[Source]:
    unnamed: set[str] = set()
    names: dict[str, str] = {}
    for source in sources:
        real = real_of(source.url)
        name = source.name or name_of(source.url)
        if names.setdefault(name, real) != real:
            raise ValueError(
                f"recordings: {names[name]} and {real} would both be called {name!r};"
                " give one of them as Source(url, name=...)"
            )
        if source.name is None and real in unnamed:
            continue
        unnamed.add(real)
        yield source


TAKEN = "a path, a URL, a footfall.fleet.Source, several of them, or a ray.data.Dataset"


def _is_dataset(recordings: Any) -> bool:
    """Whether it is a dataset of Ray.

    Raises
    ------
    TypeError
        It is a table of another library.
    """
    kind = type(recordings)
    library = kind.__module__.partition(".")[0]
    if library == "ray" and hasattr(recordings, "iter_rows"):
        return True
    if library in ("pandas", "polars", "pyarrow") and hasattr(recordings, "columns"):
        raise TypeError(
            f"recordings is a {library}.{kind.__name__}, but {TAKEN} is expected: give the column of it that has"
            " the paths, or a ray.data.Dataset that is made of it"
        )
    return False


def _strings(recordings: Iterable[Any]) -> Iterator[str | Source]:
    try:
        several = iter(recordings)
    except TypeError as error:
        raise TypeError(f"recordings is a {type(recordings).__name__}, but {TAKEN} is expected") from error
    for recording in several:
        if not isinstance(recording, (str, os.PathLike, Source)):
            raise TypeError(f"recordings has a {type(recording).__name__}, but {TAKEN} is expected")
        yield recording if isinstance(recording, Source) else os.fspath(recording)


def _of_dataset(dataset: Any, column: str, robot: str | None, options: StorageOptions) -> Iterator[Source]:
    for row in dataset.iter_rows():
        if column not in row:
            known = ", ".join(row)
            raise ValueError(f"column is {column!r}, but the dataset has {known}")
        known_robot = row.get("robot") if robot is None else robot
        source = Source(str(row[column]), robot=known_robot, foot=row.get("foot"), day=row.get("day"))
        yield _described(source, options)


def _described(source: Source, options: StorageOptions) -> Source:
    """The recording with its length and times, where they cost no request."""
    if source.stamp is not None or "://" in source.url:
        return source
    fs, path = file_system(source.url, options)
    try:
        about = fs.info(path)
    except OSError:
        return source
    if about["type"] == "file":
        return replace(source, size=_size(about), stamp=stamp_of(about))
    return replace(source, stamp=_stamp_of_all(fs.find(path, detail=True)))


def _stamp_of_all(files: Mapping[str, Any]) -> str | None:
    """What changes with the files of a bag."""
    stamps = {posixpath.basename(path): stamp_of(about) for path, about in files.items()}
    if None in stamps.values():
        return None
    return hashlib.blake2b(repr(sorted(stamps.items())).encode(), digest_size=16).hexdigest()


def _below(url: str, options: StorageOptions, format: str | None, out: str | None) -> Iterator[Source]:
    """The recordings in a folder, those of a pattern, or the one of this name."""
    fs, root = file_system(url, options)
    fs.invalidate_cache()
    given = url.rpartition("://")[2]
    root = root.rstrip("/")
    left_out = None
    if out is not None:
        destination, path = file_system(out, options)
        left_out = path.rstrip("/") + "/" if destination.protocol == fs.protocol else None
    # Names may have brackets: what is there is no pattern.
    if any(wildcard in root for wildcard in WILDCARDS) and not fs.exists(root):
        files = fs.glob(root, detail=True)
        yield from _in_folders(fs, url, _fixed(given), _fixed(root), files, format, left_out)
        return
    try:
        about = info(fs, root)
    except FileNotFoundError:
        raise
    except Exception:
        # One object of storage that refuses concerns no other; a folder that cannot be listed has no rows.
        if is_local(fs) or not posixpath.splitext(root)[1]:
            raise
        yield Source(url)
        return
    if about["type"] == "file":
        yield Source(url, size=_size(about), stamp=stamp_of(about))
        return
    files = fs.find(root, detail=True)
    if _is_bag(path for path in files if posixpath.dirname(path) == root):
        yield Source(url, size=sum(map(_size, files.values())), stamp=_stamp_of_all(files))
        return
    yield from _in_folders(fs, url, given, root, files, format, left_out)


def _fixed(pattern: str) -> str:
    """The folder that a pattern names before its first wildcard."""
    first = min(pattern.find(wildcard) for wildcard in WILDCARDS if wildcard in pattern)
    folder, slash, _ = pattern[:first].rpartition("/")
    return folder or slash


def _in_folders(
    fs: Any,
    url: str,
    given: str,
    root: str,
    files: dict[str, Any],
    format: str | None,
    left_out: str | None,
) -> Iterator[Source]:
    """Files that are recordings, and folders of a rosbag2; `given` is what `root` was called."""
    protocol = url.partition("://")[0] if "://" in url else ""
    by_folder: dict[str, list[str]] = defaultdict(list)
    for path, about in files.items():
        below = path[len(root) :].lstrip("/")
        is_hidden = any(part.startswith(".") for part in below.split("/"))
        is_result = left_out is not None and path.startswith(left_out)
        if about["type"] == "file" and not is_hidden and not is_result:
            by_folder[posixpath.dirname(path)].append(path)
    for folder, paths in by_folder.items():
        if folder != root and _is_bag(paths):
            bag = {path: files[path] for path in paths}
            below, size = folder[len(root) :].lstrip("/"), sum(map(_size, bag.values()))
            yield _source(protocol, given, root, below, size, _stamp_of_all(bag))
            continue
        for path in paths:
            if _is_recording(fs, path, format):
                below = path[len(root) :].lstrip("/")
                yield _source(protocol, given, root, below, _size(files[path]), stamp_of(files[path]))


def _size(about: dict[str, Any]) -> int:
    return int(about.get("size") or 0)


def _source(protocol: str, given: str, root: str, below: str, size: int, stamp: str | None) -> Source:
    path = posixpath.join(given, below)
    first, slash, _ = below.partition("/")
    robot = first if slash else PurePosixPath(root).name or UNKNOWN
    return Source(f"{protocol}://{path}" if protocol else path, robot=robot, size=size, stamp=stamp)


def _is_bag(paths: Iterable[str]) -> bool:
    """Whether the files of a folder are a rosbag2."""
    names = [posixpath.basename(path).lower() for path in paths]
    return "metadata.yaml" in names and any(name.endswith(OF_BAGS) for name in names)


def _is_recording(fs: Any, path: str, format: str | None) -> bool:
    """Whether the name of a file or else its first bytes show that it is a recording. One that cannot be read is
    taken for one: then a row says why it cannot."""
    if is_local(fs):
        try:
            return _footfall.is_recording(path, format)
        except OSError:
            return True
    with tempfile.TemporaryDirectory(prefix="footfall-") as folder:
        head = os.path.join(folder, posixpath.basename(path))
        with open(head, "wb") as file:
            if not _footfall.is_recording(head, format):
                try:
                    file.write(fs.cat_file(path, end=HEAD))
                except Exception:
                    return True
        return _footfall.is_recording(head, format)
