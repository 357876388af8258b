"""The demo's CAN log in every form that python-can writes.

usage: can_logs.py can.log folder
"""

import pathlib
import sys

import can

# python-can selects the form by the extension of the file, so each name serves as both.
FORMS = ["asc", "csv", "log", "blf", "trc"]


def copy(source, target):
    with can.LogReader(str(source)) as reader, can.Logger(str(target)) as writer:
        for message in reader:
            writer(message)


log, folder = sys.argv[1], pathlib.Path(sys.argv[2])
for form in FORMS:
    copy(log, folder / f"python_can.{form}")
# The conversion that footfall advises in its error about each form that it does not read.
for form in ["asc", "csv", "blf", "trc"]:
    copy(folder / f"python_can.{form}", folder / f"from_{form}.log")
