"""The code of README.md prints what the page shows."""

from __future__ import annotations

import doctest
from pathlib import Path

import numpy as np
import pytest

import footfall

PAGE = Path(__file__).parents[1] / "README.md"


def test_page_shows_the_output_of_its_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk = footfall.simulate("walk", seconds=20.0)
    rows = np.column_stack([walk.t, walk.acc, walk.gyr])
    header = "t,ax,ay,az,wx,wy,wz"
    np.savetxt(tmp_path / "walk.csv", rows, delimiter=",", header=header, comments="")
    monkeypatch.chdir(tmp_path)
    failed, attempted = doctest.testfile(
        str(PAGE), module_relative=False, optionflags=doctest.ELLIPSIS
    )
    assert failed == 0
    assert attempted > 10
