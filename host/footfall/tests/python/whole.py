"""Numbers of messages that two readers find in each bag, 0 where a reader refuses it, as JSON.

usage: whole.py bag.mcap...
"""

import json
import sys
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader, AnyReaderError


def by_mcap(path):
    with open(path, "rb") as file:
        try:
            return sum(1 for _ in make_reader(file).iter_messages())
        except McapError:
            return 0


def by_rosbags(path):
    try:
        with AnyReader([Path(path)]) as reader:
            return sum(1 for _ in reader.messages())
    except AnyReaderError:
        return 0


print(json.dumps([[by_mcap(path), by_rosbags(path)] for path in sys.argv[1:]]))
