"""Fixtures of the tests: the program, and recordings of all kinds."""

from __future__ import annotations

import csv
import os
import subprocess
from pathlib import Path

import pytest

import footfall

DATASETS = Path(os.environ.get("FOOTFALL_DATASETS", Path(__file__).parents[3] / "shared/datasets"))


def is_everything_required() -> bool:
    """Whether a missing recording or program is a failure."""
    return os.environ.get("FOOTFALL_REQUIRE_EVERYTHING") == "1"


@pytest.fixture(scope="session")
def program() -> str:
    """The program `footfall`, built from the same sources."""
    path = os.environ.get("FOOTFALL_PROGRAM")
    if path is None:
        missing = "FOOTFALL_PROGRAM does not name the program"
        assert not is_everything_required(), missing
        pytest.skip(missing)
    return path


@pytest.fixture(scope="session")
def walk() -> footfall.Recording:
    """Twenty seconds of a simulated walk."""
    return footfall.simulate("walk", 20.0, seed=3)


def rows(program: str, *arguments: str, cwd: Path) -> list[dict[str, str]]:
    """The table that a replay of the program writes."""
    command = [program, "replay", *arguments, "--output", "estimates.csv", "--overwrite"]
    subprocess.run(command, cwd=cwd, check=True, capture_output=True)
    with open(cwd / "estimates.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def published() -> list[tuple[str, Path]]:
    """The recordings published with the method, with their formats."""
    recordings: list[tuple[str, Path]] = []
    for pattern, format in (("ATLAS*.csv", "pce-atlas"), ("GO1*.csv", "pce-go1")):
        found = sorted((DATASETS / "pce").rglob(pattern))
        assert found or not is_everything_required(), f"{pattern} is missing in {DATASETS / 'pce'}"
        recordings += [(format, path) for path in found]
    return recordings
