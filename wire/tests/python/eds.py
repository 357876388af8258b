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


def number(text, data_type):
    return float(text) if data_type == canopen.objectdictionary.REAL32 else int(text)


def same(a, b, data_type):
    if data_type == canopen.objectdictionary.REAL32:
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
            assert same(variable.default, default, data_type) if not isinstance(
                default, str
            ) else variable.default == default, (where, variable.default, default)
            for bound, option, attribute in (
                ("low", "LowLimit", "min"),
                ("high", "HighLimit", "max"),
            ):
                if not row[bound]:
                    assert not raw.has_option(section, option), (where, option)
                    continue
                expected = number(row[bound], data_type)
                if data_type == canopen.objectdictionary.REAL32:
                    # python-canopen reads limits of integers only.
                    read = float(raw.get(section, option))
                else:
                    read = getattr(variable, attribute)
                assert same(read, expected, data_type), (where, option, read, expected)
    # And nothing that the foot does not have.
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
