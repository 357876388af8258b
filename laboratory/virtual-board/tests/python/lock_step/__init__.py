"""Boards in lock step for python-can and python-canopen: all waits are in the boards' time.

Import this package before python-can and python-canopen, because it patches `time` so that both wait in the boards'
time. A channel is `lockstep://` followed by the path of a socket; `src/product/serve/lock_step.rs` describes the
protocol. There is no receiving thread, so a call that waits for a message receives it itself. Only one line can be
open at a time.
"""

import queue
import socket
import struct
import threading
import time
import types

# Beginning of the boards' time, s since 1970: 2021.
EPOCH = 1_609_459_200


class Line:
    """A socket, and the boards' time in its newest answer."""

    current = None
    micros = 0

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.received = bytearray()
        Line.current = self
        self.run(0)

    def request(self, kind, number, data=b""):
        self.socket.sendall(struct.pack("<cI", kind, number) + data)
        Line.micros, length = struct.unpack("<QI", self.exactly(12))
        self.received += self.exactly(length)

    def exactly(self, length):
        data = bytearray()
        while len(data) < length:
            piece = self.socket.recv(length - len(data))
            if not piece:
                raise ConnectionError("the boards have closed the line")
            data += piece
        return bytes(data)

    def run(self, seconds):
        """Lets time pass until there is output, at most for this time."""
        self.request(b"R", max(0, int(seconds * 1e6)))

    def write(self, data):
        self.request(b"W", len(data), data)

    def close(self):
        self.socket.close()
        Line.current = None


def now(*_):
    """Returns the time of the boards. Arguments are ignored, because pyserial calls this function as a method."""
    return EPOCH + Line.micros * 1e-6


def sleep(seconds):
    end = now() + seconds
    while now() < end:
        Line.current.run(end - now() + 1e-6)


time.time = time.monotonic = now
time.sleep = sleep

import can  # noqa: E402
import canopen  # noqa: E402
import serial  # noqa: E402

serial.protocol_handler_packages.append("lock_step")


class Pump:
    """A `can.Notifier` without a thread."""

    current = None

    def __init__(self, bus, listeners, _cycle):
        self.bus = bus
        self.listeners = list(listeners)
        self.exception = None
        Pump.current = self

    def add_listener(self, listener):
        self.listeners.append(listener)

    def stop(self, _timeout=0):
        Pump.current = None

    @staticmethod
    def receive_until(end, is_there):
        """Receives until a condition holds or this time is reached; returns whether the condition holds."""
        while not is_there() and now() < end:
            message = Pump.current.bus.recv(end - now())
            if message is not None:
                for listener in Pump.current.listeners:
                    listener.on_message_received(message)
        return is_there()


class Condition(threading.Condition):
    is_notified = False

    def wait(self, timeout):
        self.is_notified = False
        return Pump.receive_until(now() + timeout, lambda: self.is_notified)

    def notify_all(self):
        self.is_notified = True


class Queue(queue.Queue):
    def get(self, block=True, timeout=None):
        Pump.receive_until(now() + timeout, lambda: not self.empty())
        return super().get(block=False)


can.Notifier = Pump
for module in (canopen.nmt, canopen.pdo.base, canopen.emcy):
    module.threading = types.SimpleNamespace(Condition=Condition)
for module in (canopen.sdo.client, canopen.lss):
    module.queue = types.SimpleNamespace(Queue=Queue, Empty=queue.Empty)
