"""A client of `footfall view`, from the libraries of others.

usage: view.py compare PROGRAM SOURCE REC.mcap
       view.py slow PROGRAM SOURCE
       view.py old PROGRAM SOURCE

`compare` subscribes to every channel that is announced, decodes what comes with the definitions that are
announced, and compares all of it with what `footfall record` has written of the same source: equal, in order,
and from the first message of each topic to its last. Then it makes sure that it would have seen a message that
is missing, or has another value. Prints how many messages each topic had.

`slow` subscribes to everything and takes nothing, until the server says so.

`old` offers the subprotocol of older viewers alone, and is refused with a sentence that names the one needed.
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
import struct
import subprocess
import sys
import time
from collections import defaultdict

import numpy
from mcap_ros2.reader import read_ros2_messages
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

PROTOCOL = "foxglove.sdk.v1"
MESSAGE_DATA = 1
ENDED = "has ended"
OLD_PROTOCOL = "foxglove.websocket.v1"
SLOW = "takes less than is sent: its oldest messages are dropped"
# Nothing for as long, and the source has ended: that was all.
QUIET_S = 2.0
# A script that takes longer hangs, and ends with the place where it does.
HANGS_S = 600.0


@contextlib.contextmanager
def served(program, source):
    """`footfall view` for as long as this lasts: it does not end by itself."""
    command = [program, "view", source, "--port", "0"]
    # Without this script's standard output: whoever reads that waits for all who hold it.
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield Server(process)
        finally:
            process.kill()


class Server:
    """`footfall view`, and what it says."""

    def __init__(self, process):
        self.process = process
        first = self.process.stderr.readline()
        self.url = re.search(r"ws://127\.0\.0\.1:[1-9]\d*$", first.strip()).group()
        app = self.process.stderr.readline()
        assert "https://app.foxglove.dev?ds=foxglove-websocket&ds.url=ws%3A%2F%2F127" in app, app
        assert self.url in self.process.stderr.readline()

    def wait_for(self, text):
        for line in self.process.stderr:
            if text in line:
                return
        raise AssertionError(f"the server has not said {text!r}")

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        rest = self.process.stderr.read()
        code = self.process.wait(timeout=30)
        assert code == 0, (code, rest)
        return rest


def subscribe(client, channels, subscriptions):
    """Subscribes to channels; adds them to the subscriptions by number."""
    new = []
    for channel in channels:
        number = len(subscriptions) + 1
        subscriptions[number] = channel
        new.append({"id": number, "channelId": channel["id"]})
    client.send(json.dumps({"op": "subscribe", "subscriptions": new}))


def connected(server, max_queue, protocol=PROTOCOL):
    # No pings: a client that is slow, or on a busy machine, is not gone.
    return connect(
        server.url,
        subprotocols=[protocol],
        compression=None,
        max_queue=max_queue,
        ping_interval=None,
    )


def collect(server):
    """All messages of all channels, as they come: times and bytes by topic; the channels by topic."""
    subscriptions, messages = {}, defaultdict(list)
    with connected(server, max_queue=None) as client:
        assert client.subprotocol == PROTOCOL
        info = json.loads(client.recv())
        assert info["op"] == "serverInfo" and info["name"].startswith("footfall "), info
        has_ended = False
        while True:
            try:
                message = client.recv(timeout=QUIET_S)
            except TimeoutError:
                if has_ended:
                    break
                # This machine may be busy: the end is said when it has come.
                server.wait_for(ENDED)
                has_ended = True
                continue
            if isinstance(message, str):
                message = json.loads(message)
                assert message["op"] == "advertise", message
                subscribe(client, message["channels"], subscriptions)
                continue
            kind, number, log_ns = struct.unpack_from("<BIQ", message)
            assert kind == MESSAGE_DATA, kind
            messages[subscriptions[number]["topic"]].append((log_ns, message[13:]))
    return messages, {channel["topic"]: channel for channel in subscriptions.values()}


@functools.cache
def fields_of(kind):
    """Names of the fields of a class of messages of any library, or nothing of another class."""
    if dataclasses.is_dataclass(kind):
        # Constants have upper-case names: they are no part of a message.
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
        # Of numbers alone, as a covariance is.
        return list(value) if set(map(type, value)) == {float} else [plain(part) for part in value]
    if isinstance(value, numpy.generic):
        return value.item()
    if isinstance(value, bytes):
        return value[0]
    return {name: plain(getattr(value, name)) for name in fields_of(kind)}


def same(one, other):
    # Equal, unless a number in it is none.
    if one == other:
        return True
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    return isinstance(one, float) and math.isnan(one) and math.isnan(other)


def decoded(messages, channels):
    """Messages by the definitions that came with their channels, and nothing else."""
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
    # In the order of the file, which is that of each topic.
    for message in read_ros2_messages(path, log_time_order=False):
        entry = (message.log_time_ns, plain(message.ros_msg))
        messages[message.channel.topic].append(entry)
    return messages


def compare(received, expected):
    """Makes sure that what was received of a topic is all of it from the first message that came."""
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
    with served(program, source) as server:
        messages, channels = collect(server)
        assert SLOW not in server.stop()
    received, expected = decoded(messages, channels), recorded(recording)
    compare(received, expected)
    for change in (one_is_missing, the_last_is_missing, one_differs):
        would_be_seen(change, received, expected)
    print(json.dumps({topic: len(entries) for topic, entries in received.items()}))


def main_slow(program, source):
    with served(program, source) as server, connected(server, max_queue=1) as client:
        subscriptions = {}
        # Channels announced in the first second.
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            message = client.recv()
            if isinstance(message, str) and json.loads(message)["op"] == "advertise":
                subscribe(client, json.loads(message)["channels"], subscriptions)
        server.wait_for(SLOW)
        server.wait_for(ENDED)
        server.stop()


def main_old(program, source):
    with served(program, source) as server:
        try:
            connected(server, max_queue=1, protocol=OLD_PROTOCOL).close()
        except InvalidStatus as refused:
            assert refused.response.status_code == 400, refused
        else:
            raise AssertionError("an old viewer is connected")
        warning = server.process.stderr.readline()
        port = server.url.rpartition(":")[2]
        assert re.search(rf" the viewer at 127\.0\.0\.1:\d+ did not offer the subprotocol {PROTOCOL} ", warning), warning
        assert port not in warning, warning
        assert server.stop() == ""


faulthandler.dump_traceback_later(HANGS_S, exit=True)
{"compare": main_compare, "slow": main_slow, "old": main_old}[sys.argv[1]](*sys.argv[2:])
