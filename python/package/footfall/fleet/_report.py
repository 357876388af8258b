"""What became of the recordings."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote

from ._catalog import all_rows, tables
from ._storage import Storage, StorageOptions


@dataclass(frozen=True)
class Outcome:
    """What became of a recording, or of one foot of it."""

    recording: str
    """What it is called."""
    foot: str | None
    """The foot, where it had a task of its own."""
    status: str
    """``done``, ``failed`` (a row says why), ``up_to_date``, or ``lost``: workers died of it again and again, so
    it has no row, and the next call tries again."""
    reason: str | None
    """Why it was estimated, as ``footfall batch`` says it; ``None`` where nothing had changed."""
    error: str | None
    """Why it has failed or was lost."""
    rows: tuple[dict[str, Any], ...]
    """The rows of its feet, as in the table ``recordings``."""
    node: str
    """The machine that did it, by Ray's id."""
    pid: int
    """The process that did it."""
    seconds: float
    """How long that took, s, transfers included."""


@dataclass(frozen=True)
class Report:
    """What became of all recordings, in the order in which they were done."""

    outcomes: tuple[Outcome, ...]
    seconds: float
    """From the call to its end, s."""

    def count(self, status: str) -> int:
        """The number of outcomes with a status."""
        return Counter(outcome.status for outcome in self.outcomes)[status]

    @property
    def samples(self) -> int:
        """Samples that were estimated in this call."""
        estimated = (row for outcome in self.outcomes if outcome.reason for row in outcome.rows)
        return sum(row.get("samples") or 0 for row in estimated)

    def __repr__(self) -> str:
        counts = Counter(outcome.status for outcome in self.outcomes)
        listed = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
        return f"<footfall.fleet.Report: {listed or 'no recording'}; {self.seconds:.1f} s>"


def rows(out: str | os.PathLike[str], *, storage_options: StorageOptions | None = None) -> Any:
    """What all recordings come to: the table ``recordings`` of a destination, as a ``pyarrow.Table``.

    Robot, foot and day are columns of text like all others. `storage_options` are those of
    :func:`footfall.fleet.estimate`.

    Raises
    ------
    FileNotFoundError
        There are no results at `out`.
    """
    return all_rows(Storage(os.fspath(out), storage_options or {}))


def samples(
    out: str | os.PathLike[str],
    columns: Sequence[str] | None = None,
    *,
    robot: str | None = None,
    foot: str | None = None,
    day: str | None = None,
    storage_options: StorageOptions | None = None,
) -> Any:
    """The estimates of recordings: the table ``samples`` of a destination, as a ``pyarrow.Table``.

    Parameters
    ----------
    out : path or URL
        The destination.
    columns : several str, optional
        The columns that are read, such as ``["recording", "t", "p_stable"]``; ``robot``, ``foot`` and ``day`` are
        columns, too. All where they are not given: 61 bytes a sample on disk, and more in memory.
    robot, foot, day : str, optional
        Whose recordings are read; of others no file is opened.
    storage_options : mapping, optional
        As of :func:`footfall.fleet.estimate`.

    Raises
    ------
    FileNotFoundError
        There are no such results at `out`.
    ValueError
        There is no such column; the message lists all.
    """
    storage = Storage(os.fspath(out), storage_options or {})
    wanted = {"robot": robot, "foot": foot, "day": day}
    files = [below for below in storage.files("samples") if _is_of(below, wanted)]
    if not files:
        listed = ", ".join(f"{name} {value}" for name, value in wanted.items() if value is not None)
        raise FileNotFoundError(f"{storage.url} has no table samples{' of ' if listed else ''}{listed}")
    dataset = tables(storage, files)
    for column in columns or ():
        if column not in dataset.schema.names:
            raise ValueError(f"columns has {column!r}, but one of {', '.join(dataset.schema.names)} is expected")
    return dataset.to_table(columns=None if columns is None else list(columns))


def _is_of(below: str, wanted: dict[str, str | None]) -> bool:
    parts = dict(part.split("=", 1) for part in below.split("/")[1:-1])
    return below.endswith(".parquet") and all(
        value is None or unquote(parts.get(name, "")) == value for name, value in wanted.items()
    )
