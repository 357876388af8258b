"""Writes bags whose messages differ in everything that a bag stores about a message, and compares their copies with
them, by third-party libraries.

usage: bag_copies.py write folder | bag_copies.py compare bag copy.mcap

`write` makes folder/sent.mcap and folder/offered, a bag in SQLite. `compare` fails if a message of the bag is missing
in the copy or has changed, and prints the number of messages that are equal.
"""

import struct
import sys
from collections import Counter
from pathlib import Path

import numpy
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
IMU = "sensor_msgs/msg/Imu"
START_NS = 1_700_000_000_000_000_000
SAMPLES = 400

GAUGE = "my_msgs/msg/Gauge"
# Two nodes of different versions of a package publish on one topic.
GAUGES = ["float64 force\nfloat64 torque", "float64 force"]
TITLED = "my_msgs/msg/Titled"


def imu(stamp_ns, k):
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    vector = TYPES["geometry_msgs/msg/Vector3"]
    header = TYPES["std_msgs/msg/Header"]
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return TYPES[IMU](
        header=header(stamp=stamp, frame_id="foot"),
        orientation=TYPES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=numpy.array([-1.0] + 8 * [0.0]),
        angular_velocity=vector(x=0.01 * (k % 3), y=0.0, z=0.0),
        angular_velocity_covariance=numpy.zeros(9),
        linear_acceleration=vector(x=0.0, y=0.02 * (k % 5), z=9.81),
        linear_acceleration_covariance=numpy.zeros(9),
    )


def samples():
    for k in range(SAMPLES):
        stamp_ns = START_NS + 5_000_000 * k
        yield k, stamp_ns, bytes(STORE.serialize_cdr(imu(stamp_ns, k), IMU))


def wide(text):
    """Encodes a text of type wstring as rmw_cyclonedds_cpp and others do, in units of two bytes."""
    return struct.pack("<I", len(text)) + text.encode("utf-16-le")


def titled(title, force):
    body = wide(title)
    body += bytes(-len(body) % 8)
    return b"\0\1\0\0" + body + struct.pack("<d", force)


def sent(path):
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2", library="copies")
        definition, _ = STORE.generate_msgdef(IMU, ros_version=2)
        schema = writer.register_schema(IMU, "ros2msg", definition.encode())
        qos = {"offered_qos_profiles": "- history: 1\n  depth: 10\n"}
        channel = writer.register_channel("/imu", "cdr", schema, qos)
        gauges = [
            writer.register_channel("/gauge", "cdr", writer.register_schema(GAUGE, "ros2msg", text.encode()))
            for text in GAUGES
        ]
        text = b"wstring title\nfloat64 force"
        title = writer.register_channel("/titled", "cdr", writer.register_schema(TITLED, "ros2msg", text))
        for k, stamp_ns, data in samples():
            log_ns = stamp_ns + 700_000
            writer.add_message(title, log_ns - 10, titled("Fuß " * (k % 4), 80.0 + k % 7), log_ns - 20)
            writer.add_message(channel, log_ns, data, stamp_ns + 90_000, sequence=3 * k + 5)
            for gauge, numbers in zip(gauges, ([1.0, 2.0], [3.0])):
                packed = b"\0\1\0\0" + struct.pack(f"<{len(numbers)}d", *numbers)
                writer.add_message(gauge, log_ns + 1, packed, log_ns - 7, sequence=k)
        writer.finish()


def offered(path):
    never = QosTime(0, 0)
    latched = Qos(
        QosHistory.KEEP_LAST, 7, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, never, never,
        QosLiveliness.AUTOMATIC, never, False,
    )
    with Rosbag2Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/imu", IMU, typestore=STORE, offered_qos_profiles=[latched])
        for _, stamp_ns, data in samples():
            writer.write(connection, stamp_ns + 700_000, data)


def stored(path):
    """Everything that an MCAP file stores about each message, except footfall's own messages."""
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic.startswith("/footfall/"):
                continue
            yield (
                channel.topic, schema.name, schema.encoding, schema.data, channel.message_encoding,
                tuple(channel.metadata.items()), message.log_time, message.publish_time, message.sequence, message.data,
            )


def profiles(path):
    """Returns the offered profiles of the topic of samples, and the number of messages on it."""
    with AnyReader([path], default_typestore=STORE) as reader:
        [connection] = [connection for connection in reader.connections if connection.topic == "/imu"]
        return connection.ext.offered_qos_profiles, connection.msgcount


def compare(bag, copy):
    if bag.is_dir():
        offered, count = profiles(bag)
        assert offered and profiles(copy) == (offered, count), (offered, profiles(copy))
        print(count)
        return
    [before, after] = [Counter(stored(path)) for path in (bag, copy)]
    assert before == after, (before - after).most_common(1) + (after - before).most_common(1)
    print(before.total())


def main(what, *paths):
    paths = [Path(path) for path in paths]
    if what == "write":
        sent(paths[0] / "sent.mcap")
        offered(paths[0] / "offered")
    else:
        compare(*paths)


main(*sys.argv[1:])
