"""Ports of pyserial that are lines in lock step: `lockstep://` and the path of a socket."""

from lock_step import Line


class Serial:
    def __init__(self, _port, timeout=None, **_settings):
        self.timeout = timeout
        self.write_timeout = None
        self.port = None

    def open(self):
        self.line = Line(self.port.removeprefix("lockstep://"))

    def close(self):
        self.line.close()

    @property
    def in_waiting(self):
        return len(self.line.received)

    def read(self, size=1):
        if not self.line.received:
            self.line.run(self.timeout)
        data = bytes(self.line.received[:size])
        del self.line.received[:size]
        return data

    def write(self, data):
        self.line.write(data)
        return len(data)

    def flush(self):
        pass

    def reset_input_buffer(self):
        self.line.received.clear()
