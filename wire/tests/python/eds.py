"""footfall.eds as python-canopen reads it, against the dictionary that the foot has.

usage: eds.py EDS OBJECTS, with OBJECTS as written by tests/python.rs
"""

import configparser
import csv
import struct
import sys

import canopen
from canopen.objectdictionary import ODVariable

NODE_ID = 0x22


REAL32 = canopen.objectdictionary.REAL32


def number(text, data_type):
    return float(text) if data_type == REAL32 else int(text)


def as_written(text):
    """The REAL32 of which an EDS gives the bits."""
    return struct.unpack("<f", struct.pack("<I", int(text, 0)))[0]


def same(a, b, data_type):
    if data_type == REAL32:
        return struct.pack("<f", a) == struct.pack("<f", b)
    return a == b


def main(eds, objects):
    od = canopen.import_od(eds, NODE_ID)
    raw = configparser.RawConfigParser()
    raw.optionxform = str
    raw.read(eds)
    seen = set()
    with open(objects, newline="", encoding="utf-8") as table:
        for row in csv.DictReader(table, delimiter="\t"):
            index, sub = int(row["index"]), int(row["subindex"])
            seen.add((index, sub))
            where = f"{index:04X}:{sub}"
            found = od[index]
            if isinstance(found, ODVariable):
                section, variable = f"{index:04X}", found
            else:
                section, variable = f"{index:04X}sub{sub:X}", found[sub]
            assert variable.name == row["name"], where
            data_type = int(row["type"])
            assert variable.data_type == data_type, where
            assert variable.access_type == row["access"], (where, variable.access_type)
            assert variable.pdo_mappable == (row["mappable"] == "1"), where
            if row["role"] == "cob_id":
                default = int(row["default"]) + NODE_ID
            elif row["default_is_text"] == "1":
                default = row["default"]
            else:
                default = number(row["default"], data_type)
            found_default = variable.default
            if data_type == REAL32:
                # python-canopen keeps the text of a default, and does not convert bit patterns to values.
                assert found_default in (None, default), (where, found_default)
                found_default = as_written(variable.default_raw)
            assert same(found_default, default, data_type), (where, found_default)
            for bound, option, attribute in (
                ("low", "LowLimit", "min"),
                ("high", "HighLimit", "max"),
            ):
                limit = number(row[bound], data_type) if row[bound] else None
                if bound == "low" and limit is not None and default < limit:
                    # A command whose default cannot be written.
                    assert row["access"] == "wo", where
                    limit = None
                found_limit = getattr(variable, attribute)
                if data_type == REAL32:
                    # python-canopen's limits are integers, so it must not see these.
                    assert found_limit is None, (where, option, found_limit)
                    option = option.lower()
                    if raw.has_option(section, option):
                        found_limit = as_written(raw.get(section, option))
                assert (found_limit is None) == (limit is None), (where, option)
                assert limit is None or same(found_limit, limit, data_type), (
                    where,
                    option,
                    found_limit,
                    limit,
                )
    # The EDS has nothing that the foot does not have.
    for index in od:
        entry = od[index]
        subs = [0] if isinstance(entry, ODVariable) else list(entry)
        for sub in subs:
            count = sub == 0 and not isinstance(entry, ODVariable)
            assert (index, sub) in seen or count, f"{index:04X}:{sub}"
    info = od.device_information
    assert info.product_name == "footfall"
    assert info.LSS_supported and info.nr_of_TXPDO == 7 and info.nr_of_RXPDO == 1
    assert info.allowed_baudrates == {125_000, 250_000, 500_000, 1_000_000}
    print(f"{len(seen)} objects agree")


if __name__ == "__main__":
    main(*sys.argv[1:])
