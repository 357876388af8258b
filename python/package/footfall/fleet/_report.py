"""What became of the recordings."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass
from typing import Any

from ._need import need
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
    that it has no row and is tried anew by the next call."""
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
    dataset = need("pyarrow.dataset")
    pyarrow = need("pyarrow")
    storage = Storage(os.fspath(out), storage_options or {})
    partitions = pyarrow.schema(
        [(name, pyarrow.string()) for name in ("robot", "foot", "day")]
    )
    files = [file for file in storage.paths("recordings") if file.endswith(".parquet")]
    if not files:
        raise FileNotFoundError(f"{out} has no table recordings: nothing has been estimated there")
    table = dataset.dataset(
        files,
        filesystem=storage.filesystem,
        partitioning=dataset.partitioning(partitions, flavor="hive"),
        partition_base_dir=storage.path("recordings"),
    )
    return table.to_table().sort_by([("robot", "ascending"), ("foot", "ascending"), ("key", "ascending")])
