"""Sheets of Excel, which pandas reads: the Rust part gets them as a table."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory


@contextmanager
def as_table(path: str | os.PathLike[str]) -> Iterator[str]:
    """Path of a file that the Rust part reads: a CSV of the first sheet of an ``.xlsx``, else the file itself.

    Errors name the sheet.

    Raises
    ------
    ImportError
        pandas or openpyxl is missing; the message says how to install them.
    """
    if Path(path).suffix.lower() != ".xlsx":
        yield os.fspath(path)
        return
    try:
        import pandas
    except ImportError as error:
        raise ImportError(f"{path} is an Excel file: pip install pandas openpyxl, or save the sheet as CSV") from error
    with TemporaryDirectory() as folder:
        table = Path(folder, Path(path).stem + ".csv")
        pandas.read_excel(path, engine="openpyxl").to_csv(table, index=False)
        try:
            yield str(table)
        except ValueError as error:
            raise type(error)(str(error).replace(str(table), os.fspath(path))) from None
