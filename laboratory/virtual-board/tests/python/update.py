"""python-canopen replaces the program of a foot, with the sequences of two masters that are not made for footfall.

Zephyr's `canopen_program.py` sends each request once, and clears as soon as the stop is answered. Lely's master
(`co_nmt_boot`) asks for the state first, compares the program's number before it starts it, and polls afterwards.
Neither exists as a package, so both sequences are written here from their sources.

Then the foot is updated over its serial line, on which the bootloader acts as an adapter.

The foot is in lock step, so timeouts are in its time.

usage: update.py SOCKET SOCKET_OF_SERIAL_LINE EDS IMAGE SECOND_IMAGE
"""

import sys

import lock_step  # noqa: F401, before the packages that take the time from it
import canopen

FOOT = 0x11
STOP, START, CLEAR, CONFIRM = 0, 1, 3, 0x80


def number(foot, index):
    return int.from_bytes(foot.sdo.upload(index, 1), "little")


def control(foot, command):
    foot.sdo.download(0x1F51, 1, bytes([command]))


def send(foot, image, by_block):
    with foot.sdo.open(0x1F50, 1, "wb", size=len(image), block_transfer=by_block) as data:
        data.write(image)


def by_zephyr(foot, image, by_block):
    foot.sdo.MAX_RETRIES = 1
    assert number(foot, 0x1F57) == 0, hex(number(foot, 0x1F57))
    foot.nmt.state = "PRE-OPERATIONAL"
    control(foot, STOP)
    control(foot, CLEAR)
    assert number(foot, 0x1F57) == 0, hex(number(foot, 0x1F57))
    send(foot, image, by_block)
    assert number(foot, 0x1F57) == 0, hex(number(foot, 0x1F57))
    number(foot, 0x1F56)
    control(foot, START)
    foot.nmt.wait_for_bootup(timeout=60)
    number(foot, 0x1F56)
    foot.nmt.state = "PRE-OPERATIONAL"
    control(foot, CONFIRM)


def by_lely(foot, image):
    foot.sdo.MAX_RETRIES = 4
    expected = int.from_bytes(image[44:48], "little")
    assert number(foot, 0x1F56) != expected
    assert number(foot, 0x1F51) == START
    control(foot, STOP)
    control(foot, CLEAR)
    send(foot, image, by_block=True)
    assert number(foot, 0x1F57) == 0
    assert number(foot, 0x1F56) == expected
    control(foot, START)
    while True:
        try:
            if number(foot, 0x1F51) == START:
                break
        except canopen.SdoCommunicationError:
            pass
    assert number(foot, 0x1F56) == expected


def connect(network, path, **rate):
    channel = f"lockstep://{path}"
    network.connect(interface="slcan", channel=channel, bitrate=1_000_000, sleep_after_open=0.1, **rate)


def over_its_serial_line(path, eds, image):
    """The bootloader is an adapter, too."""
    network = canopen.Network()
    connect(network, path, tty_baudrate=1_000_000)
    try:
        foot = network.add_node(FOOT, eds)
        foot.sdo.RESPONSE_TIMEOUT = 5.0
        foot.nmt.wait_for_heartbeat(timeout=5)
        assert foot.sdo.upload(0x1008, 0) == b"footfall bootloader"
        control(foot, CLEAR)
        send(foot, image, by_block=True)
        assert number(foot, 0x1F57) == 0
        control(foot, START)
    finally:
        network.disconnect()


def main(path, line, eds, file, second):
    image = open(file, "rb").read()
    network = canopen.Network()
    connect(network, path)
    try:
        foot = network.add_node(FOOT, eds)
        foot.sdo.RESPONSE_TIMEOUT = 5.0
        foot.nmt.wait_for_heartbeat(timeout=20)
        by_zephyr(foot, image, by_block=False)
        assert foot.sdo.upload(0x1008, 0) == b"footfall"
        assert number(foot, 0x1F56) == int.from_bytes(image[44:48], "little")
        # A damaged image is refused, and the foot goes on with its program.
        foot.nmt.state = "PRE-OPERATIONAL"
        control(foot, STOP)
        control(foot, CLEAR)
        damaged = bytearray(image)
        damaged[100] ^= 0xFF
        damaged[20] ^= 1
        try:
            send(foot, bytes(damaged), by_block=True)
        except canopen.SdoAbortedError:
            pass
        assert number(foot, 0x1F57) >> 16 == 6, hex(number(foot, 0x1F57))
        control(foot, START)
        foot.nmt.wait_for_bootup(timeout=20)
        assert number(foot, 0x1F56) == int.from_bytes(image[44:48], "little")
        foot.nmt.state = "PRE-OPERATIONAL"
        by_lely(foot, open(second, "rb").read())
        # The bootloader answers on the line on which it is asked.
        foot.nmt.state = "PRE-OPERATIONAL"
        control(foot, STOP)
        # One line at a time.
        network.disconnect()
        over_its_serial_line(line, eds, image)
        connect(network, path)
        foot.nmt.wait_for_bootup(timeout=20)
        assert number(foot, 0x1F56) == int.from_bytes(image[44:48], "little")
    finally:
        network.disconnect()


main(*sys.argv[1:])
