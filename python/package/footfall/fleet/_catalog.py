"""The rows of a destination in one file, and what sources and results were like when they were written.

Both files are copies: the tables of the folders count. A recording whose files differ from what is noted here is
looked at as if nothing was noted.
"""

from __future__ import annotations

import json
import posixpath
from collections import defaultdict
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from typing import Any
from urllib.parse import unquote

from .._settings import IdentityDict
from ._need import need
from ._sources import Source, real_of
from ._storage import PART, Storage

ROWS = "recordings.parquet"
"""The table ``recordings`` as one file."""

NOTES = ".sources.parquet"
"""What is noted of each recording."""

PARTITIONS = ("robot", "foot", "day")

READERS = 16
"""As many rows are read at a time."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Note:
    """What is noted of a recording."""

    key: str
    """The name of its files, without extension."""
    url: str
    """Its path or URL, the same for all spellings; empty where no call has seen it."""
    identity: str
    """What it is called, as JSON."""
    stamp: str
    """What changes with the recording, as :attr:`Source.stamp`; empty where that is not known."""
    settings: str
    """The version and the hash of the settings."""
    files: str
    """Its files at the destination, one in each line."""
    results: str
    """What changes with those that have its rows."""
    rows: str
    """Its rows as JSON."""


@dataclass
class _New:
    """What a call has learnt of a recording."""

    source: Source
    identity: IdentityDict
    rows: list[Row] = field(default_factory=list)


class Catalog:
    """What is known of the recordings of a destination."""

    def __init__(self, storage: Storage, settings: str) -> None:
        """Lists the destination; `settings` are the version and the hash of the settings of this call."""
        self._storage = storage
        self._settings = settings
        self._new: dict[str, _New] = {}
        listed = _listed(storage)
        self.files = _by_key(listed)
        """The files of each recording, by its key."""
        noted = _read_notes(storage)
        self._notes = {note.key: note for note in noted if _is_current(note, self.files, listed)}
        self._is_whole = len(self._notes) == len(noted) == len(self.files)
        self._names = {note.url: json.loads(note.identity)["name"] for note in noted if note.url}

    def name_of(self, real: str) -> str | None:
        """What a recording was called by an earlier call, with another spelling of its path."""
        return self._names.get(real)

    def unchanged(self, key: str, real: str, stamp: str | None, identity: IdentityDict) -> list[Row] | None:
        """The rows of a recording that is as it was, and whose results are there; else ``None``."""
        note = self._notes.get(key)
        if note is None or not note.stamp or note.stamp != stamp or note.url != real:
            return None
        if note.settings != self._settings or note.identity != _text(identity):
            return None
        rows: list[Row] = json.loads(note.rows)
        # One that could not be read is tried again.
        return rows if all(row["input_blake3"] for row in rows) else None

    def add(self, key: str, source: Source, identity: IdentityDict, rows: Iterable[Row]) -> None:
        """Takes rows of a recording that this call has written or found unchanged."""
        self._new.setdefault(key, _New(source, identity)).rows.extend(rows)

    def save(self) -> None:
        """Writes both files, where something has changed."""
        if self._is_whole and not self._new:
            return
        listed = _listed(self._storage)
        files = _by_key(listed)
        notes = {key: note for key, note in self._notes.items() if _is_current(note, files, listed)}
        for key, new in self._new.items():
            if key in files and all(row["feet"] == len(new.rows) for row in new.rows):
                notes[key] = Note(
                    key,
                    real_of(new.source.url),
                    _text(new.identity),
                    new.source.stamp or "",
                    self._settings,
                    *_state(files[key], listed),
                    json.dumps(new.rows),
                )
        others = [key for key in files if key not in notes]
        with ThreadPoolExecutor(READERS) as readers:
            read = readers.map(lambda key: _read_rows(self._storage, files[key]), others)
            for key, rows in zip(others, read):
                notes[key] = Note(key, "", "", "", "", *_state(files[key], listed), json.dumps(rows))
        if not notes:
            return
        rows = [row for note in notes.values() for row in json.loads(note.rows)]
        table = self._table(rows, listed)
        # Rows first: while their notes are those of before, none of them counts that has changed.
        self._write(table, ROWS)
        columns = [asdict(notes[key]) for key in sorted(notes)]
        self._write(need("pyarrow").Table.from_pylist(columns), NOTES)

    def _table(self, rows: list[Row], listed: Iterable[str]) -> Any:
        """The rows with the columns of the tables."""
        pyarrow, parquet = need("pyarrow"), need("pyarrow.parquet")
        one = next(below for below in listed if _is_row(below))
        with self._storage.filesystem.open(self._storage.path(one), "rb") as file:
            schema = parquet.read_schema(file)
        columns = [column.with_nullable(True) for column in schema]
        columns += [pyarrow.field(name, pyarrow.string()) for name in PARTITIONS]
        return sorted_rows(pyarrow.Table.from_pylist(rows, schema=pyarrow.schema(columns)))

    def _write(self, table: Any, name: str) -> None:
        with self._storage.staging("catalog") as folder:
            need("pyarrow.parquet").write_table(table, folder / name, compression="zstd")
            self._storage.put(folder / name, name)


def all_rows(storage: Storage) -> Any:
    """All rows of a destination as a table: from the one file where they are as it has them, else from their own.

    Raises
    ------
    FileNotFoundError
        There are none.
    """
    pyarrow = need("pyarrow")
    listed = storage.files("recordings")
    files = _by_key(listed)
    current = {
        note.key
        for note in _read_notes(storage)
        if note.key in files and _state(files[note.key], listed)[1] == note.results
    }
    several = []
    if current:
        with storage.filesystem.open(storage.path(ROWS), "rb") as file:
            table = need("pyarrow.parquet").read_table(file)
        is_current = need("pyarrow.compute").is_in(table["key"], pyarrow.array(sorted(current)))
        several.append(table.filter(is_current))
    others = [below for key in files if key not in current for below in files[key]]
    if others:
        several.append(tables(storage, others).to_table())
    if not several:
        raise FileNotFoundError(f"{storage.url} has no table recordings: nothing has been estimated there")
    return sorted_rows(pyarrow.concat_tables(several, promote_options="default"))


def tables(storage: Storage, files: Iterable[str]) -> Any:
    """Files of one table as a dataset of Arrow, with robot, foot and day as columns of text."""
    pyarrow, dataset = need("pyarrow"), need("pyarrow.dataset")
    files = list(files)
    partitions = pyarrow.schema([(name, pyarrow.string()) for name in PARTITIONS])
    return dataset.dataset(
        [storage.path(below) for below in files],
        filesystem=storage.filesystem,
        partitioning=dataset.partitioning(partitions, flavor="hive"),
        partition_base_dir=storage.path(files[0].partition("/")[0]),
    )


def sorted_rows(table: Any) -> Any:
    """The rows in the order in which they are given back and written."""
    return table.sort_by([(name, "ascending") for name in ("robot", "foot", "key")])


def _listed(storage: Storage) -> dict[str, str]:
    """The files of the tables, without those that processes have left which were killed: they are removed."""
    listed = storage.files()
    for below in list(listed):
        if below.endswith(PART) and posixpath.basename(below).startswith("."):
            storage.remove(below)
            del listed[below]
    return listed


def _read_notes(storage: Storage) -> list[Note]:
    """What earlier calls have noted; nothing where the file is missing, damaged or of another version."""
    pyarrow = need("pyarrow")
    try:
        fs = storage.filesystem
        if not fs.exists(storage.path(ROWS)):
            return []
        with fs.open(storage.path(NOTES), "rb") as file:
            table = need("pyarrow.parquet").read_table(file)
        return [Note(**columns) for columns in table.to_pylist()]
    except (OSError, TypeError, pyarrow.ArrowException):
        return []


def _read_rows(storage: Storage, files: Iterable[str]) -> list[Row]:
    """The rows of a recording from the files of its feet."""
    rows = []
    for below in filter(_is_row, files):
        with storage.filesystem.open(storage.path(below), "rb") as file:
            [row] = need("pyarrow.parquet").ParquetFile(file).read().to_pylist()
        parts = below.split("/")[1:-1]
        rows.append(row | {name: unquote(part.partition("=")[2]) for name, part in zip(PARTITIONS, parts)})
    return rows


def _state(files: Iterable[str], listed: Mapping[str, str]) -> tuple[str, str]:
    """The files of a recording, and what changes with those of its rows."""
    rows = sorted(f"{below} {listed[below]}" for below in files if _is_row(below))
    return "\n".join(sorted(files)), "\n".join(rows)


def _is_current(note: Note, files: Mapping[str, tuple[str, ...]], listed: Mapping[str, str]) -> bool:
    return note.key in files and _state(files[note.key], listed) == (note.files, note.results)


def _text(identity: IdentityDict) -> str:
    return json.dumps(identity, sort_keys=True)


def _is_row(below: str) -> bool:
    return below.startswith("recordings/") and below.endswith(".parquet")


def _by_key(listed: Iterable[str]) -> dict[str, tuple[str, ...]]:
    files: dict[str, list[str]] = defaultdict(list)
    for below in listed:
        name = posixpath.basename(below)
        if name.endswith(".parquet"):
            files[name.removesuffix(".parquet")].append(below)
    return {key: tuple(several) for key, several in files.items()}
