"""Compares estimates in Parquet, as pandas reads them, with the table of the same estimates.

usage: estimates.py estimates.csv estimates.parquet

Prints how many rows are the same: all of them, or it fails.
"""

import sys

import numpy
import pandas

TEXTS = ["foot", "state", "flags"]


def main():
    table = pandas.read_csv(sys.argv[1], dtype=dict.fromkeys(TEXTS, str), keep_default_na=False)
    columns = pandas.read_parquet(sys.argv[2])
    assert list(columns.columns) == list(table.columns), list(columns.columns)
    for name in table.columns:
        found, expected = columns[name], table[name]
        if name in TEXTS:
            assert isinstance(found.dtype, pandas.CategoricalDtype), (name, found.dtype)
            assert (found.astype(str) == expected).all(), name
        elif name == "decision":
            assert found.dtype == numpy.uint8 and (found == expected).all(), name
        elif name == "t":
            # The table has six decimals, so a time may differ by half a microsecond.
            assert found.dtype == numpy.float64 and (found - expected).abs().max() < 5e-7, name
        else:
            assert found.dtype == numpy.float32, (name, found.dtype)
            assert (found == expected.astype(numpy.float32)).all(), name
    print(len(columns))


main()
