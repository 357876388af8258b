"""python-canopen as master of a foot that stands: the ELF that is flashed, behind an slcan adapter in lock step.

usage: master.py SOCKET EDS
"""

import faulthandler
import struct
import sys

import lock_step  # before the packages that take the time from it
import canopen

FOOT = 0x11
MOVED = 0x22

# Timeout of one response, s. It only ends a hang, and is no requirement on the foot.
ANSWER_LIMIT_S = 120.0
# Time after which the script counts as hung, s. It then ends, and prints the line at which it hangs.
HANGS_S = 600.0

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

# States in heartbeats.
BOOT_UP = 0
PRE_OPERATIONAL = 127


def refused(code, action):
    try:
        action()
    except canopen.SdoAbortedError as error:
        assert error.code == code, f"{error.code:08X} instead of {code:08X}"
    else:
        raise AssertionError(f"not refused with {code:08X}")


def write(node, index, sub, data):
    return lambda: node.sdo.download(index, sub, data)


class Received:
    """Messages of a node from now on, in order, because the waits of python-canopen miss messages that come earlier."""

    def __init__(self, add_callback, value=lambda message: message):
        self.messages = lock_step.Queue()
        add_callback(lambda message: self.messages.put(value(message)))

    def next(self):
        return self.messages.get(timeout=ANSWER_LIMIT_S)

    def wait_for(self, expected):
        while self.next() != expected:
            pass


def contacts(node):
    """Sequence numbers of the contacts of a node, one for each millisecond of its clock."""
    contact = node.tpdo[1]
    return Received(contact.add_callback, lambda _: contact["Contact.Sequence"].raw)


def finds_the_node(network, eds):
    answered = lock_step.Queue()
    network.subscribe(0x580 + FOOT, lambda *_: answered.put(True))
    network.scanner.search(limit=0x30)
    assert answered.get(timeout=ANSWER_LIMIT_S)
    node = canopen.RemoteNode(FOOT, eds)
    network.add_node(node)
    # Nodes answer in order, so any other node has answered the search before this response arrives.
    assert node.sdo["Identity object"]["Serial number"].raw != 0
    assert network.scanner.nodes == [FOOT], network.scanner.nodes
    return node


def sees_the_heartbeat(node):
    # The foot started by itself.
    assert node.nmt.wait_for_heartbeat(timeout=ANSWER_LIMIT_S) == "OPERATIONAL"


def reads_objects(node):
    assert node.sdo["Manufacturer device name"].raw == "footfall"
    assert "LSM6DSOX" in node.sdo["Manufacturer hardware version"].raw
    assert node.sdo["Window"].raw == 50_000
    assert abs(node.sdo["Decision"]["Threshold"].raw - 0.5) < 1e-9
    # Every object that can be read according to the EDS is read.
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
    received = contacts(node)
    sequences = [received.next() for _ in range(50)]
    steps = {(b - a) % 256 for a, b in zip(sequences, sequences[1:])}
    assert steps == {1}, sequences
    assert contact["Contact.Stable contact probability"].raw > 60_000
    assert contact["Contact.Tangential probability"].raw > 230
    assert contact["Contact.Vertical probability"].raw > 230
    for number in range(1, 8):
        message = node.tpdo[number]
        assert message.wait_for_reception(timeout=ANSWER_LIMIT_S) is not None, number
    assert abs(node.tpdo[4]["Linear acceleration.y"].raw) < 50
    assert abs(node.tpdo[3]["Attitude.w"].raw) > 30_000


def refuses_configuration_when_operational(node):
    refused(NOT_BY_STATE, write(node, 0x2010, 0, struct.pack("<I", 20_000)))
    assert node.sdo["Window"].raw == 50_000


def stops_sending(node):
    states = Received(node.nmt.add_heartbeat_callback)
    node.nmt.state = "PRE-OPERATIONAL"
    # The first heartbeats may have been sent before the change.
    states.wait_for(PRE_OPERATIONAL)


def writes_parameters(node):
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
    states = Received((rebooted or node).nmt.add_heartbeat_callback)
    node.nmt.state = "RESET COMMUNICATION"
    states.wait_for(BOOT_UP)
    # A node that a master resets waits for its configuration.
    assert (rebooted or node).sdo["Producer heartbeat time"].raw == 500
    (rebooted or node).sdo["Producer heartbeat time"].raw = 500


def sees_emergencies(network, node):
    # Sends a load of two bytes instead of four, and then a complete one.
    emergencies = Received(node.emcy.add_callback)
    network.send_message(0x200 + FOOT, b"\1\2")
    emergency = emergencies.next()
    assert (emergency.code, emergency.register) == (0x8210, 0x11), emergency
    assert emergency.data == bytes([19, 2, 0, 0, 0]), emergency.data
    assert node.sdo["Error register"].raw == 0x11
    assert node.sdo["Pre-defined error field"][1].raw & 0xFFFF == 0x8210
    network.send_message(0x200 + FOOT, struct.pack("<f", 120.0))
    emergency = emergencies.next()
    assert (emergency.code, emergency.register) == (0, 0), emergency
    # A load is valid for 0.1 s. A busy host may read it later, so the host sends it again.
    while node.sdo["Load"].raw != 120.0:
        network.send_message(0x200 + FOOT, struct.pack("<f", 120.0))


def follows_sync(network, node):
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo["TPDO7 communication parameter"]["Transmission type"].raw = 1
    # Messages sent before the response have come.
    health = node.tpdo[7]
    received = Received(health.add_callback)
    milliseconds = contacts(node)
    node.nmt.state = "OPERATIONAL"
    for _ in range(300):
        milliseconds.next()
    assert received.messages.empty(), "not without a SYNC"
    times = []
    for _ in range(3):
        network.sync.transmit(len(times) + 1)
        received.next()
        assert health["Health.SYNC of the clock"].raw == len(times) + 1
        times.append(health["Health.Clock"].raw)
        # The clock of this foot has steps of 1 ms.
        while not milliseconds.messages.empty():
            milliseconds.next()
        for _ in range(2):
            milliseconds.next()
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
    contacts(moved).next()


def main(path, eds):
    faulthandler.dump_traceback_later(HANGS_S, exit=True)
    # The defaults of python-canopen, 0.3 and 0.5 s, are too short on a busy host.
    canopen.sdo.SdoClient.RESPONSE_TIMEOUT = ANSWER_LIMIT_S
    canopen.lss.LssMaster.RESPONSE_TIMEOUT = ANSWER_LIMIT_S
    network = canopen.Network()
    channel = f"lockstep://{path}"
    network.connect(
        interface="slcan", channel=channel, bitrate=1_000_000, sleep_after_open=0.1
    )
    try:
        node = finds_the_node(network, eds)
        sees_the_heartbeat(node)
        receives_pdos(node)
        refuses_configuration_when_operational(node)
        stops_sending(node)
        count = reads_objects(node)
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
