"""python-can and cantools with the ELF that is flashed, behind an slcan adapter in lock step.

usage: board.py SOCKET DBC LOG, with LOG to be written as `candump -l` does
"""

import collections
import struct
import sys
import time

import lock_step  # noqa: F401, before the packages that take the time from it
import can
import cantools

FOOT = 0x11
CONTACT = 0x180 + FOOT
BIT_RATE = 1_000_000

CONTACTS = 3000


def adapter(path):
    return dict(interface="slcan", channel=f"lockstep://{path}", bitrate=BIT_RATE, sleep_after_open=0.1)


def receives_what_is_due(path, dbc, log):
    database = cantools.database.load_file(dbc)
    frames = collections.defaultdict(list)
    with can.Bus(**adapter(path)) as bus, can.CanutilsLogWriter(log) as writer:
        deadline = time.monotonic() + 60
        while len(frames[CONTACT]) < CONTACTS:
            assert time.monotonic() < deadline, {hex(id): len(all) for id, all in frames.items()}
            frame = bus.recv(timeout=5)
            assert frame is not None, "silence"
            frames[frame.arbitration_id].append(bytes(frame.data))
            writer.on_message_received(frame)
    decoded = [
        database.decode_message(CONTACT, data, decode_choices=False) for data in frames[CONTACT]
    ]
    sequence = [contact["Sequence"] for contact in decoded]
    steps = {(b - a) % 256 for a, b in zip(sequence, sequence[1:])}
    assert steps == {1}, f"gaps: {steps}"
    # A contact is valid once up is known, within the first second, except for landings beyond the sensor's range.
    invalid = [
        index
        for index, contact in enumerate(decoded)
        if contact["Valid"] != 1 and contact["Saturated"] != 1
    ]
    assert invalid == list(range(len(invalid))) and len(invalid) < 1000, len(invalid)
    high = sum(contact["StableContactProbability"] > 0.9 for contact in decoded)
    assert CONTACTS // 10 < high, f"{high} of {CONTACTS} are stable"
    # Periods of 20 ms, 100 ms and 1 s, in contacts of 1 ms.
    for function, every in ((0x380, 20), (0x480, 20), (0x300, 20), (0x500, 100), (0x400, 1000)):
        count = len(frames[function + FOOT])
        assert abs(count - CONTACTS // every) <= 1, f"{function:#x}: {count}"
        for data in frames[function + FOOT]:
            database.decode_message(function + FOOT, data)
    # The robot's control: numbered SYNCs and the load of the foot, N.
    syncs = [data[0] for data in frames[0x080]]
    assert abs(len(syncs) - CONTACTS // 10) <= 3, len(syncs)
    assert all(b == a % 240 + 1 for a, b in zip(syncs, syncs[1:])), syncs[:300]
    loads = [struct.unpack("<f", data)[0] for data in frames[0x200 + FOOT]]
    assert max(loads) > 20 and len(loads) >= len(syncs) - 1, (max(loads), len(loads))


def main():
    path, dbc, log = sys.argv[1:]
    receives_what_is_due(path, dbc, log)
    print("python-can and cantools agree with the board")


main()
