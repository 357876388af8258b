"""python-canopen as master, over slcan on a pseudo-terminal, with a foot at the other end.

usage: master.py TTY EDS
"""

import queue
import struct
import sys
import threading
import time

import canopen

FOOT = 0x11
MOVED = 0x22
SERIAL = 0xC0FFEE

ANSWER_LIMIT_S = 3.0

NOT_BY_STATE = 0x08000022
LOCKED = 0x08000021
WRONG_SIGNATURE = 0x08000020
TOO_HIGH = 0x06090031
TOO_LOW = 0x06090032
NOT_ALLOWED = 0x06090030
NO_SUBINDEX = 0x06090011
NO_OBJECT = 0x06020000
READ_ONLY = 0x06010002
WRITE_ONLY = 0x06010001
TOO_LONG = 0x06070012
TOO_SHORT = 0x06070013
INCOMPATIBLE = 0x06040043
BAD_COMMAND = 0x05040001


def refused(code, action):
    try:
        action()
    except canopen.SdoAbortedError as error:
        assert error.code == code, f"{error.code:08X} instead of {code:08X}"
    else:
        raise AssertionError(f"not refused with {code:08X}")


def write(node, index, sub, data):
    return lambda: node.sdo.download(index, sub, data)


def finds_the_node(network):
    network.scanner.search(limit=0x30)
    deadline = time.monotonic() + ANSWER_LIMIT_S
    while not network.scanner.nodes and time.monotonic() < deadline:
        time.sleep(0.05)
    # Time for a second node to answer, of which there is none.
    time.sleep(0.3)
    assert network.scanner.nodes == [FOOT], network.scanner.nodes


def sees_the_heartbeat(node):
    # The foot started by itself.
    assert node.nmt.wait_for_heartbeat(timeout=3) == "OPERATIONAL"


def reads_objects(node):
    assert node.sdo["Manufacturer device name"].raw == "footfall"
    assert "LSM6DSOX" in node.sdo["Manufacturer hardware version"].raw
    assert node.sdo["Identity object"]["Serial number"].raw == SERIAL
    assert node.sdo["Window"].raw == 50_000
    assert abs(node.sdo["Decision"]["Threshold"].raw - 0.5) < 1e-9
    # Everything that the EDS says can be read, can be read.
    count = 0
    for index in node.object_dictionary:
        entry = node.object_dictionary[index]
        variables = (
            [entry]
            if isinstance(entry, canopen.objectdictionary.ODVariable)
            else list(entry.values())
        )
        for variable in variables:
            sub = variable.subindex
            if variable.readable:
                data = node.sdo.upload(index, sub)
                size = len(variable) // 8
                assert len(data) == size or size == 0 or variable.data_type in (
                    canopen.objectdictionary.VISIBLE_STRING,
                ), f"{index:04X}:{sub} has {len(data)} bytes"
                count += 1
            else:
                refused(WRITE_ONLY, lambda: node.sdo.upload(index, sub))
    return count


def receives_pdos(node):
    node.tpdo.read()
    contact = node.tpdo[1]
    assert contact.cob_id == 0x180 + FOOT and contact.event_timer == 1
    assert contact.wait_for_reception(timeout=2) is not None
    assert abs(contact["Contact.Stable contact probability"].raw / 65535 - 0.75) < 1e-5
    assert contact["Contact.Tangential probability"].raw == 255
    assert contact["Contact.Vertical probability"].raw == 191
    # Valid, stable, stance.
    assert contact["Contact.Status"].raw == 0x19
    sequences = []
    for _ in range(50):
        assert contact.wait_for_reception(timeout=2) is not None
        sequences.append(contact["Contact.Sequence"].raw)
    steps = [(b - a) % 256 for a, b in zip(sequences, sequences[1:])]
    # The master may sleep over a frame, but they come in order.
    assert all(0 < step < 128 for step in steps), sequences
    acceleration = node.tpdo[4]
    assert acceleration.wait_for_reception(timeout=2) is not None
    assert acceleration["Linear acceleration.y"].raw == -150
    attitude = node.tpdo[3]
    assert attitude.wait_for_reception(timeout=2) is not None
    assert attitude["Attitude.w"].raw == 32767
    for number in range(1, 8):
        assert node.tpdo[number].wait_for_reception(timeout=3) is not None, number


def refuses_configuration_when_operational(node):
    refused(NOT_BY_STATE, write(node, 0x2010, 0, struct.pack("<I", 20_000)))
    assert node.sdo["Window"].raw == 50_000


def writes_parameters(node):
    node.nmt.state = "PRE-OPERATIONAL"
    # The first heartbeat may be one from before.
    states = [node.nmt.wait_for_heartbeat(timeout=3) for _ in range(2)]
    assert states[-1] == "PRE-OPERATIONAL", states
    node.sdo["Window"].raw = 20_000
    assert node.sdo["Window"].raw == 20_000
    node.sdo["Half-width"]["ax"].raw = 0.625
    assert node.sdo["Half-width"]["ax"].raw == 0.625
    # In segments too.
    node.sdo.download(0x2010, 0, struct.pack("<I", 30_000), force_segment=True)
    assert node.sdo["Window"].raw == 30_000


def refuses_bad_writes(node):
    refused(TOO_HIGH, write(node, 0x2010, 0, struct.pack("<I", 300_000)))
    refused(TOO_LOW, write(node, 0x2010, 0, struct.pack("<I", 999)))
    refused(TOO_HIGH, write(node, 0x2014, 1, struct.pack("<f", 1.0)))
    refused(NOT_ALLOWED, write(node, 0x2014, 1, struct.pack("<f", float("nan"))))
    refused(NOT_ALLOWED, write(node, 0x2002, 0, struct.pack("<H", 333)))
    refused(INCOMPATIBLE, write(node, 0x2015, 5, struct.pack("<f", 100.0)))
    refused(TOO_LONG, write(node, 0x2000, 0, b"\1\0"))
    refused(TOO_SHORT, write(node, 0x2010, 0, b"\1\0"))
    refused(TOO_LONG, write(node, 0x2010, 0, bytes(9)))
    refused(READ_ONLY, write(node, 0x1018, 1, bytes(4)))
    refused(READ_ONLY, write(node, 0x1A00, 1, bytes(4)))
    refused(NO_OBJECT, write(node, 0x3000, 0, b"\0"))
    refused(NO_SUBINDEX, write(node, 0x2011, 7, bytes(4)))
    refused(NO_OBJECT, lambda: node.sdo.upload(0x3000, 0))
    refused(NO_SUBINDEX, lambda: node.sdo.upload(0x2011, 7))
    refused(BAD_COMMAND, lambda: node.sdo.open(0x1008, 0, "rb", block_transfer=True))
    # Nothing of it was taken.
    assert node.sdo["Window"].raw == 30_000
    node.sdo["Configuration lock"].raw = 1
    refused(LOCKED, write(node, 0x2010, 0, struct.pack("<I", 20_000)))
    node.sdo["Configuration lock"].raw = 0


def stores_and_restores(network, node):
    for index in (0x1010, 0x1011):
        refused(WRONG_SIGNATURE, write(node, index, 1, b"nope"))
    node.store()
    node.sdo["Window"].raw = 40_000
    resets_communication(node)
    assert node.sdo["Window"].raw == 30_000, "what was stored, not what was written later"
    node.restore()
    assert node.sdo["Window"].raw == 30_000, "until the reset"
    resets_communication(node)
    assert node.sdo["Window"].raw == 50_000
    node.nmt.state = "OPERATIONAL"


def resets_communication(node, rebooted=None):
    """Resets `node`, which may come up under another id as `rebooted`."""
    booted = threading.Event()
    # Not `wait_for_bootup`, which does not see a message that comes before it waits.
    (rebooted or node).nmt.add_heartbeat_callback(
        lambda state: booted.set() if state == 0 else None
    )
    node.nmt.state = "RESET COMMUNICATION"
    assert booted.wait(timeout=3), "no boot-up message"
    # A node that a master resets waits for its configuration.
    assert (rebooted or node).sdo["Producer heartbeat time"].raw == 500
    (rebooted or node).sdo["Producer heartbeat time"].raw = 500


def sees_emergencies(network, node):
    # A load of two bytes instead of four, and then a whole one.
    # Not `emcy.wait`, which does not see a message that comes before it waits.
    emergencies = queue.Queue()
    node.emcy.add_callback(emergencies.put)
    network.send_message(0x200 + FOOT, b"\1\2")
    emergency = emergencies.get(timeout=2)
    assert (emergency.code, emergency.register) == (0x8210, 0x11), emergency
    assert emergency.data == bytes([19, 2, 0, 0, 0]), emergency.data
    assert node.sdo["Error register"].raw == 0x11
    assert node.sdo["Pre-defined error field"][1].raw & 0xFFFF == 0x8210
    network.send_message(0x200 + FOOT, struct.pack("<f", 120.0))
    emergency = emergencies.get(timeout=2)
    assert (emergency.code, emergency.register) == (0, 0), emergency
    # The foot believes a load for 0.1 s. A busy host may ask later than that, so it sends again.
    deadline = time.monotonic() + ANSWER_LIMIT_S
    while (load := node.sdo["Load"].raw) != 120.0 and time.monotonic() < deadline:
        network.send_message(0x200 + FOOT, struct.pack("<f", 120.0))
    assert load == 120.0, load


def follows_sync(network, node):
    node.nmt.state = "PRE-OPERATIONAL"
    time.sleep(0.05)
    node.sdo["TPDO7 communication parameter"]["Transmission type"].raw = 1
    node.nmt.state = "OPERATIONAL"
    time.sleep(0.3)
    # Not `wait_for_reception`, which does not see a message that comes before it waits.
    received = queue.Queue()
    health = node.tpdo[7]
    health.add_callback(received.put)
    time.sleep(0.3)
    assert received.empty(), "not without a SYNC"
    times = []
    for _ in range(3):
        network.sync.transmit(len(times) + 1)
        received.get(timeout=ANSWER_LIMIT_S)
        assert health["Health.SYNC of the clock"].raw == len(times) + 1
        times.append(health["Health.Clock"].raw)
        time.sleep(0.05)
    assert times[0] < times[1] < times[2], times


def is_given_another_id(network, node):
    lss = network.lss
    identity = [node.sdo["Identity object"][sub].raw for sub in (1, 2, 3, 4)]
    assert lss.send_switch_state_selective(*identity)
    assert lss.inquire_node_id() == FOOT
    lss.configure_node_id(MOVED)
    lss.store_configuration()
    lss.send_switch_state_global(lss.WAITING_STATE)
    moved = canopen.RemoteNode(MOVED, node.object_dictionary)
    network.add_node(moved)
    resets_communication(node, moved)
    assert moved.sdo["Node id"].raw == MOVED
    moved.nmt.state = "OPERATIONAL"
    moved.tpdo.read()
    assert moved.tpdo[1].cob_id == 0x180 + MOVED
    assert moved.tpdo[1].wait_for_reception(timeout=2) is not None


def main(tty, eds):
    # A busy host is no fault of the foot: by default python-canopen waits 0.3 and 0.5 s for an answer.
    canopen.sdo.SdoClient.RESPONSE_TIMEOUT = ANSWER_LIMIT_S
    canopen.lss.LssMaster.RESPONSE_TIMEOUT = ANSWER_LIMIT_S
    network = canopen.Network()
    network.connect(
        interface="slcan", channel=tty, bitrate=1_000_000, sleep_after_open=0.0
    )
    try:
        finds_the_node(network)
        node = canopen.RemoteNode(FOOT, eds)
        network.add_node(node)
        sees_the_heartbeat(node)
        count = reads_objects(node)
        receives_pdos(node)
        refuses_configuration_when_operational(node)
        writes_parameters(node)
        refuses_bad_writes(node)
        stores_and_restores(network, node)
        node.tpdo.read()
        sees_emergencies(network, node)
        follows_sync(network, node)
        is_given_another_id(network, node)
    finally:
        network.disconnect()
    print(f"all of it, with {count} objects read")


if __name__ == "__main__":
    main(*sys.argv[1:])
