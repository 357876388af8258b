"""python-can, cantools and python-canopen with the ELF that is flashed, behind an slcan adapter in lock step.

usage: board.py SOCKET EDS DBC LOG, with LOG to be written as `candump -l` does
"""

import collections
import struct
import sys
import time

import lock_step  # noqa: F401, before the packages that take the time from it
import can
import canopen
import cantools

FOOT = 0x11
CONTACT = 0x180 + FOOT
BIT_RATE = 1_000_000

CONTACTS = 3000

NOT_BY_STATE = 0x08000022


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
    # It is valid once up is found, within the first second, but for landings beyond the sensor's range.
    invalid = [
        index
        for index, contact in enumerate(decoded)
        if contact["Valid"] != 1 and contact["Saturated"] != 1
    ]
    assert invalid == list(range(len(invalid))) and len(invalid) < 1000, len(invalid)
    high = sum(contact["StableContactProbability"] > 0.9 for contact in decoded)
    assert CONTACTS // 10 < high, f"{high} of {CONTACTS} are stable"
    # Every 20 ms, 100 ms, 1 s and 10 ms, of 1 ms.
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


def is_its_master(path, eds):
    network = canopen.Network()
    network.connect(**adapter(path))
    try:
        node = network.add_node(FOOT, eds)
        node.sdo.RESPONSE_TIMEOUT = 3.0
        assert node.nmt.wait_for_heartbeat(timeout=10) == "OPERATIONAL"
        assert node.sdo["Manufacturer device name"].raw == "footfall"
        assert node.sdo["Identity object"]["Serial number"].raw != 0
        try:
            node.sdo["Window"].raw = 20_000
        except canopen.SdoAbortedError as error:
            assert error.code == NOT_BY_STATE, error
        else:
            raise AssertionError("settings are taken in operational state")
        node.nmt.state = "PRE-OPERATIONAL"
        states = [node.nmt.wait_for_heartbeat(timeout=10) for _ in range(2)]
        assert states[-1] == "PRE-OPERATIONAL", states
        window = node.sdo["Window"].raw
        node.sdo["Window"].raw = 20_000
        assert node.sdo["Window"].raw == 20_000
        node.sdo["Window"].raw = window
        node.nmt.state = "OPERATIONAL"
        node.tpdo.read()
        contact = node.tpdo[1]
        assert contact.cob_id == CONTACT and contact.event_timer == 1
        sequences = []
        for _ in range(20):
            assert contact.wait_for_reception(timeout=5) is not None
            sequences.append(contact["Contact.Sequence"].raw)
        steps = [(b - a) % 256 for a, b in zip(sequences, sequences[1:])]
        assert set(steps) == {1}, sequences
    finally:
        network.disconnect()


def main():
    path, eds, dbc, log = sys.argv[1:]
    receives_what_is_due(path, dbc, log)
    is_its_master(path, eds)
    print("python-can, cantools and python-canopen agree with the board")


main()
