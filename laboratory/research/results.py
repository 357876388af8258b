"""Results of measurements: `laboratory/results/NAME.json`, as docs/design/results.md describes them.

The crate `results` does the same for measurements in Rust, and shows all of them in the documents.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Result:
    """A measurement that has just been made. Its figures are rounded, and their keys have units."""

    name: str
    """Name of its file, without `.json`."""
    what: str
    """What is measured, in a sentence."""
    command: str
    """How to measure it again."""
    values: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[Mapping[str, Any]] = ()
    machine: str | None = None
    """`machine()`, where figures depend on it."""

    @property
    def path(self) -> Path:
        return ROOT / f"laboratory/results/{self.name}.json"

    def differences(self) -> list[str]:
        """Returns the differences from the stored figures, in words."""
        stored = json.loads(self.path.read_text(encoding="utf-8")) if self.path.exists() else {}
        was = {"values": stored.get("values", {}), "rows": stored.get("rows", [])}
        return list(_differences(f"laboratory/results/{self.name}.json", was, {"values": self.values, "rows": [*self.rows]}))

    def text(self, commit: str, date: str) -> str:
        """Content of the file: a line for each value and each row."""
        head = {"what": self.what, "command": self.command, "commit": commit, "date": date}
        if self.machine is not None:
            head["machine"] = self.machine
        parts = [f"{_json(key)}: {_json(text)}" for key, text in head.items()]
        values = [f"{_json(key)}: {_json(value)}" for key, value in self.values.items()]
        for key, (begin, end), lines in (("values", "{}", values), ("rows", "[]", [_json(row) for row in self.rows])):
            if lines:
                parts.append(f'"{key}": {begin}\n    ' + ",\n    ".join(lines) + f"\n  {end}")
        return "{\n  " + ",\n  ".join(parts) + "\n}\n"


def write(results: Iterable[Result]) -> None:
    """Writes the files of results that have changed, and shows the results in the documents."""
    commit = _output("git", "rev-parse", "--short=8", "HEAD")
    if _output("git", "status", "--porcelain", "--", ".", ":!laboratory/results", ":!*.md", ":!*.svg"):
        commit += " and changes"
    date = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    for result in results:
        if result.differences():
            result.path.write_text(result.text(commit, date), encoding="utf-8")
    subprocess.run(["cargo", "laboratory", "results"], cwd=ROOT, check=True)


def machine() -> str:
    """Processor and number of cores."""
    try:
        info = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        info = ""
    name = re.search(r"model name\s*:\s*(.+)", info)
    processor = name.group(1) if name else platform.processor() or platform.machine()
    return f"{processor}, {os.cpu_count()} cores"


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _output(*command: str) -> str:
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def _differences(place: str, was: Any, measured: Any) -> Iterable[str]:
    if isinstance(was, Mapping) and isinstance(measured, Mapping) and was.keys() == measured.keys():
        for key in measured:
            yield from _differences(f"{place}.{key}", was[key], measured[key])
    elif isinstance(was, list) and isinstance(measured, list) and len(was) == len(measured):
        for k, (before, now) in enumerate(zip(was, measured)):
            # A row is named by the text that it begins with.
            first = next(iter(now.values()), None) if isinstance(now, Mapping) else None
            yield from _differences(f"{place}[{first if isinstance(first, str) else k}]", before, now)
    elif was != measured:
        yield f"{place} is {measured}, not {was}"
