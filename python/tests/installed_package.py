"""Checks of the package as pip installed it without features; a program, since its file is no test of pytest."""

from importlib.metadata import files
from pathlib import Path
from tempfile import TemporaryDirectory

import footfall


def main() -> None:
    # The error about a format that needs a feature names the feature, and how to build it.
    with TemporaryDirectory() as folder:
        bag = Path(folder, "walk.mcap")
        bag.write_bytes(b"\x89MCAP0\r\n")
        try:
            footfall.read(str(bag))
        except ImportError as error:
            assert "build-args='--features " in str(error), error
        else:
            raise SystemExit("a bag was read without the feature for bags")

    licences = {file.name for file in files("footfall") or ()}
    assert {"LICENSE-APACHE", "LICENSE-MIT"} <= licences, licences


main()
