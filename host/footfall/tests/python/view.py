"""A client of `footfall view`, from third-party libraries.

usage: view.py compare PROGRAM SOURCE REC.mcap
       view.py slow PROGRAM SOURCE
       view.py crowd PROGRAM SOURCE

`compare` subscribes to every announced channel, and decodes the messages with the announced definitions. They must
equal the messages that `footfall record` has written of the same source, in order, up to the last message of each
topic. Then `compare` checks that it would detect a missing message and a changed value. It prints the number of
messages of each topic.

`slow` subscribes and reads nothing, while another client receives more messages than the server queues for a client.

`crowd` does the same with two hundred clients, some of which the server refuses, and bounds the memory of the server.
"""

import contextlib
import copy
import dataclasses
import faulthandler
import functools
import json
import math
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections import defaultdict

import numpy
from mcap_ros2.reader import read_ros2_messages
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.sync.client import connect

PROTOCOL = "foxglove.sdk.v1"
MESSAGE_DATA = 1
ENDED = "has ended"
# Messages that the server queues for a client.
QUEUE = 1 << 16
# Interval at which a client that receives nothing checks whether the source has ended.
LOOK_S = 0.5
# Least time from the first contact of each foot to the end, s on the clock of the feet.
LEAST_S = 2.0
# Clients of a crowd, the most that the server takes, and the memory that the server may use, MiB: 4 MiB for each of them,
# and the program itself.
CROWD = 200
MOST_CLIENTS = 16
MOST_MIB = 4 * MOST_CLIENTS + 96
# Ending of the topics that have a message each millisecond.
OFTEN = "/contact"
# Time after which the script counts as hung, s. It then ends, and prints the line at which it hangs.
HANGS_S = 600.0


@contextlib.contextmanager
def served(program, source):
    """Runs `footfall view` within the context, because it does not end by itself."""
    command = [program, "view", source, "--port", "0"]
    # The program must not inherit this script's standard output. Its reader would wait until the program has ended,
    # too.
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield Server(process)
        finally:
            process.kill()


class Server:
    """A running `footfall view`, and its error output."""

    def __init__(self, process):
        self.process = process
        first = self.process.stderr.readline()
        self.url = re.search(r"ws://127\.0\.0\.1:[1-9]\d*$", first.strip()).group()
        app = self.process.stderr.readline()
        assert "https://app.foxglove.dev?ds=foxglove-websocket&ds.url=ws%3A%2F%2F127" in app, app
        assert self.url in self.process.stderr.readline()
        self.said = []
        self.changed = threading.Condition()
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()

    def listen(self):
        for line in self.process.stderr:
            with self.changed:
                self.said.append(line)
                self.changed.notify_all()

    def has_said(self, text):
        return any(text in line for line in list(self.said))

    def wait_for(self, text):
        with self.changed:
            self.changed.wait_for(lambda: self.has_said(text))

    def stop(self):
        """Ends the server, and returns all of its error output."""
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait()
        self.listener.join()
        assert code == 0, (code, self.said)
        return self.said


def subscribe(client, channels, subscriptions):
    """Subscribes to channels; adds them to the subscriptions by number."""
    new = []
    for channel in channels:
        number = len(subscriptions) + 1
        subscriptions[number] = channel
        new.append({"id": number, "channelId": channel["id"]})
    client.send(json.dumps({"op": "subscribe", "subscriptions": new}))


def connected(url, max_queue, origin=None):
    # Pings are off, because with them a client that is slow, or runs on a busy machine, would count as gone.
    return connect(
        url,
        subprotocols=[PROTOCOL],
        compression=None,
        max_queue=max_queue,
        ping_interval=None,
        origin=origin,
    )


def last_of(entries):
    """Time of the last messages of a topic, and their number."""
    last_ns = entries[-1][0]
    return last_ns, sum(log_ns == last_ns for log_ns, _ in entries)


def is_late(messages, expected):
    """Returns whether the client was connected so late that it has missed most messages of a foot."""
    often = [topic for topic in expected if topic.endswith(OFTEN)]
    latest = {topic: expected[topic][-1][0] - LEAST_S * 1e9 for topic in often}
    return any(not messages[topic] or messages[topic][0][0] > latest[topic] for topic in often)


def collect(server, expected):
    """Collects the messages of all channels in order of arrival. Returns times and bytes by topic, and the channels
    by topic; None if the client was connected too late."""
    subscriptions, messages = {}, defaultdict(list)
    last = {topic: last_of(entries) for topic, entries in expected.items()}
    open_ends = dict(last)
    with connected(server.url, max_queue=None) as client:
        assert client.subprotocol == PROTOCOL
        info = json.loads(client.recv())
        assert info["op"] == "serverInfo" and info["name"].startswith("footfall "), info
        while open_ends:
            try:
                message = client.recv(timeout=LOOK_S)
            except TimeoutError:
                if server.has_said(ENDED) and is_late(messages, expected):
                    return None
                continue
            if isinstance(message, str):
                message = json.loads(message)
                assert message["op"] == "advertise", message
                subscribe(client, message["channels"], subscriptions)
                continue
            kind, number, log_ns = struct.unpack_from("<BIQ", message)
            assert kind == MESSAGE_DATA, kind
            topic = subscriptions[number]["topic"]
            messages[topic].append((log_ns, message[13:]))
            if topic not in open_ends:
                assert topic in last, topic
            elif log_ns == last[topic][0]:
                last_ns, count = open_ends.pop(topic)
                if count > 1:
                    open_ends[topic] = last_ns, count - 1
    server.wait_for(ENDED)
    server.stop()
    if is_late(messages, expected):
        return None
    return messages, {channel["topic"]: channel for channel in subscriptions.values()}


@functools.cache
def fields_of(kind):
    """Names of the fields of a message class of any library; None for any other class."""
    if dataclasses.is_dataclass(kind):
        # Names in upper case are constants, which are no part of a message.
        names = [field.name for field in dataclasses.fields(kind)]
        return [name for name in names if name != "__msgtype__" and not name.isupper()]
    return getattr(kind, "__slots__", None)


def plain(value):
    """A message of any library as dictionaries, lists and numbers."""
    kind = type(value)
    if kind in (bool, float, int, str):
        return value
    if isinstance(value, numpy.ndarray):
        return value.tolist()
    if kind in (list, tuple):
        # A list of numbers alone, such as a covariance, is copied at once.
        return list(value) if set(map(type, value)) == {float} else [plain(part) for part in value]
    if isinstance(value, numpy.generic):
        return value.item()
    if isinstance(value, bytes):
        return value[0]
    return {name: plain(getattr(value, name)) for name in fields_of(kind)}


def same(one, other):
    # Messages are equal, unless a number in them is NaN.
    if one == other:
        return True
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    return isinstance(one, float) and math.isnan(one) and math.isnan(other)


def decoded(messages, channels):
    """Decodes messages only by the definitions that came with their channels."""
    store = get_typestore(Stores.EMPTY)
    for channel in channels.values():
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg"), channel
        types = get_types_from_msg(channel["schema"], channel["schemaName"])
        store.register({name: fields for name, fields in types.items() if name not in store.types})
    return {
        topic: [
            (log_ns, plain(store.deserialize_cdr(data, channels[topic]["schemaName"])))
            for log_ns, data in entries
        ]
        for topic, entries in messages.items()
    }


def recorded(path):
    messages = defaultdict(list)
    # The messages of each topic come in the order of the file.
    for message in read_ros2_messages(path, log_time_order=False):
        entry = (message.log_time_ns, plain(message.ros_msg))
        messages[message.channel.topic].append(entry)
    return messages


def compare(received, expected):
    """Checks that no message of a topic is missing after the first one that was received."""
    assert received.keys() == expected.keys(), (sorted(received), sorted(expected))
    for topic, entries in received.items():
        all_of_it = expected[topic]
        first = len(all_of_it) - len(entries)
        assert first >= 0, f"{topic}: {len(entries)} messages, {len(all_of_it)} are recorded"
        for number, (one, other) in enumerate(zip(entries, all_of_it[first:])):
            assert one[0] == other[0], f"{topic}, message {number}: at {one[0]}, not at {other[0]}"
            assert same(one[1], other[1]), f"{topic}, message {number}: {one[1]}, not {other[1]}"


def would_be_seen(change, received, expected):
    changed = copy.copy(received)
    change(changed)
    try:
        compare(changed, expected)
    except AssertionError:
        return
    raise SystemExit(f"not seen: {change.__doc__}")


def one_is_missing(messages):
    """a message that is missing"""
    topic = "/footfall/FR/contact"
    middle = len(messages[topic]) // 2
    messages[topic] = messages[topic][:middle] + messages[topic][middle + 1 :]


def the_last_is_missing(messages):
    """a last message that is missing"""
    messages["/footfall/RL/load"] = messages["/footfall/RL/load"][:-1]


def one_differs(messages):
    """a value that is another"""
    topic = "/footfall/RR/imu"
    middle = len(messages[topic]) // 2
    log_ns, message = messages[topic][middle]
    message = copy.deepcopy(message)
    message["angular_velocity"]["z"] += 1e-9
    messages[topic] = messages[topic][:middle] + [(log_ns, message)] + messages[topic][middle + 1 :]


def main_compare(program, source, recording):
    expected, collected = recorded(recording), None
    while collected is None:
        with served(program, source) as server:
            collected = collect(server, expected)
    messages, channels = collected
    received = decoded(messages, channels)
    compare(received, expected)
    for change in (one_is_missing, the_last_is_missing, one_differs):
        would_be_seen(change, received, expected)
    print(json.dumps({topic: len(entries) for topic, entries in received.items()}))


def subscribe_to_a_foot(client):
    """Subscribes to all channels up to one with a message each millisecond."""
    subscriptions = {}
    while not any(channel["topic"].endswith(OFTEN) for channel in subscriptions.values()):
        message = client.recv()
        if isinstance(message, str) and json.loads(message)["op"] == "advertise":
            subscribe(client, json.loads(message)["channels"], subscriptions)


def main_slow(program, source):
    with served(program, source) as server, connected(server.url, max_queue=1) as client:
        subscribe_to_a_foot(client)
        with connected(server.url, max_queue=None) as other:
            subscribe_to_a_foot(other)
            received = 0
            while received < 2 * QUEUE:
                received += not isinstance(other.recv(), str)
        server.stop()


def memory_mib(process):
    """Largest resident memory of a process so far."""
    with open(f"/proc/{process.pid}/status", encoding="utf-8") as file:
        [line] = [line for line in file if line.startswith("VmHWM:")]
    return int(line.split()[1]) / 1024


def slow_client(url):
    """A connection of a client that will read nothing but the answer to its handshake; None if it is refused.

    It is a bare socket, because a library would read in the background.
    """
    host, port = url.removeprefix("ws://").split(":")
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.connect((host, int(port)))
    request = [
        "GET / HTTP/1.1", f"Host: {host}:{port}", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", f"Sec-WebSocket-Protocol: {PROTOCOL}", "", "",
    ]
    try:
        client.sendall("\r\n".join(request).encode())
        if client.recv(12) == b"HTTP/1.1 101":
            return client
    except ConnectionError:
        # The server has closed the connection before it got the request.
        pass
    client.close()
    return None


def text_frame(text):
    """A short message of a client, with the mask 0."""
    data = text.encode()
    return struct.pack(">BBHI", 0x81, 0x80 | 126, len(data), 0) + data


def main_crowd(program, source):
    with served(program, source) as server, contextlib.ExitStack() as crowd:
        reader = crowd.enter_context(connected(server.url, max_queue=None))
        # The channels of all feet.
        topics = {}
        while sum(topic.endswith(OFTEN) for topic in topics) < 4:
            for channel in json.loads(reader.recv()).get("channels", []):
                topics[channel["topic"]] = channel["id"]
        clients = [client for client in (slow_client(server.url) for _ in range(CROWD)) if client]
        assert len(clients) == MOST_CLIENTS - 1, len(clients)
        everything = [{"id": number, "channelId": number} for number in topics.values()]
        for client in clients:
            crowd.enter_context(client)
            client.sendall(text_frame(json.dumps({"op": "subscribe", "subscriptions": everything})))
        [often] = [number for topic, number in topics.items() if topic == f"/footfall/FL{OFTEN}"]
        reader.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": often, "channelId": often}]}))
        received = 0
        while received < QUEUE // 2:
            received += not isinstance(reader.recv(), str)
        used = memory_mib(server.process)
        assert used < MOST_MIB, used
        said = server.stop()
        assert sum("further ones are refused" in line for line in said) == 1, said
        print(f"{len(clients) + 1} clients, {CROWD - len(clients)} refused, {used:.0f} MiB")


if __name__ == "__main__":
    faulthandler.dump_traceback_later(HANGS_S, exit=True)
    {"compare": main_compare, "slow": main_slow, "crowd": main_crowd}[sys.argv[1]](*sys.argv[2:])
