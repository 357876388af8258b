"""footfall.eds as Lely's tools read it, which ros2_canopen runs: dcfchk, and dcfgen with the bus.yml
of README.md. Neither may print anything.

usage: lely.py EDS OBJECTS README, with OBJECTS as written by tests/python.rs
"""

import csv
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import dcf
import yaml

NODE_ID = 0x11
MASTER = 1
REAL32 = 0x08
SYNC_OVERFLOW = 0x1019
# Range allowed by CiA 301, other than 0 for SYNCs without a number.
SYNC_OVERFLOW_RANGE = (2, 240)


def silent(folder, tool, *arguments):
    """Runs a tool that neither fails nor warns."""
    # Beside the interpreter of the virtual environment.
    command = [Path(sys.executable).parent / tool, *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0 and not done.stderr, f"{tool}: {done.stderr}"
    return done.stdout


def value_of(text, data_type):
    """A number of the table as dcf-tools hold it."""
    if data_type == REAL32:
        return struct.unpack("<f", struct.pack("<f", float(text)))[0]
    return int(text)


def reads_the_values(eds, objects):
    device = dcf.Device.from_dcf(str(eds), {"NODEID": NODE_ID})
    count = 0
    with open(objects, newline="", encoding="utf-8") as table:
        for row in csv.DictReader(table, delimiter="\t"):
            if row["default_is_text"] == "1":
                continue
            where = f"{row['index']}:{row['subindex']}"
            entry = device[int(row["index"])][int(row["subindex"])]
            data_type = int(row["type"])
            default = value_of(row["default"], data_type)
            expected = default + (NODE_ID if row["role"] == "cob_id" else 0)
            assert entry.parse_value() == expected, (where, entry.parse_value())
            assert entry.access_type.name == row["access"], where
            for bound, attribute in (("low", "low_limit"), ("high", "high_limit")):
                limit = value_of(row[bound], data_type) if row[bound] else None
                if bound == "low" and limit is not None and default < limit:
                    limit = None
                found = getattr(entry, attribute, None)
                found = found and found.parse()
                assert found == limit, (where, attribute, found, limit)
            count += 1
    assert sorted(device.tpdo) == list(range(1, 8)) and sorted(device.rpdo) == [1]
    return count


def configures_a_bus(folder, eds, bus):
    settings = yaml.safe_load(bus)
    (folder / "bus.yml").write_text(bus, encoding="utf-8")
    shutil.copy(eds, folder)
    silent(folder, "dcfgen", "-rS", "bus.yml")
    silent(folder, "dcfchk", "-n", MASTER, "master.dcf")
    master = dcf.Device.from_dcf(str(folder / "master.dcf"), {"NODEID": MASTER})
    overflow = master[SYNC_OVERFLOW][0].parse_value()
    assert overflow == settings["master"]["sync_overflow"], overflow
    low, high = SYNC_OVERFLOW_RANGE
    assert low <= overflow <= high, "the SYNCs have no numbers"
    # The master receives the PDOs that the foot sends.
    assert len(master.rpdo) == 7 and len(master.tpdo) == 1
    # The master also writes the values of bus.yml.
    name, foot = next(item for item in settings.items() if item[0] != "master")
    writes = b"".join(
        struct.pack("<HBLL", sdo["index"], sdo["sub_index"], 4, sdo["value"])
        for sdo in foot["sdo"]
    )
    expected = struct.pack("<L", len(foot["sdo"])) + writes
    assert (folder / f"{name}.bin").read_bytes() == expected


def main(eds, objects, readme):
    eds = Path(eds).resolve()
    with tempfile.TemporaryDirectory() as folder:
        silent(folder, "dcfchk", "-n", NODE_ID, eds)
        count = reads_the_values(eds, objects)
        bus = re.search(
            r"```yaml\n(.*?)```", Path(readme).read_text(encoding="utf-8"), re.DOTALL
        )
        configures_a_bus(Path(folder), eds, bus.group(1))
    print(f"{count} numbers agree, and nothing is said of them")


if __name__ == "__main__":
    main(*sys.argv[1:])
