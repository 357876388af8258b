"""Compares a copy of a bag with contacts, as `footfall replay --output copy.mcap` writes it, with the bag and with
the table of the same estimates, read by a library of others.

usage: copied.py bag copy.mcap estimates.csv

The table has a column `foot`; each foot's topic of samples is /imu/ and its name. Prints the number of contacts.
"""

import csv
import struct
import sys
from collections import defaultdict
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

OURS = "/footfall/"
STATES = ["unknown", "stance", "slip", "swing", "quiet_swing"]


def single(text):
    return struct.unpack("f", struct.pack("f", float(text)))[0]


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def messages(path, store):
    path = Path(path)
    with AnyReader([path], default_typestore=store) as reader:
        for connection, log_ns, data in reader.messages():
            yield connection.topic, connection.msgtype, log_ns, bytes(data), reader


def main(bag, copy, table):
    store = get_typestore(Stores.ROS2_JAZZY)
    definition = Path(__file__).parents[3] / "ros2/footfall_msgs/msg/Contact.msg"
    store.register(get_types_from_msg(definition.read_text(), "footfall_msgs/msg/Contact"))
    rows = defaultdict(list)
    with open(table, newline="") as file:
        for row in csv.DictReader(file):
            rows[row["foot"]].append(row)
    original = [(t, kind, log, data) for t, kind, log, data, _ in messages(bag, store)]
    others, contacts, velocities = [], defaultdict(list), defaultdict(list)
    samples, newest = defaultdict(dict), 0
    for topic, kind, log_ns, data, reader in messages(copy, store):
        assert log_ns >= newest, "messages are not in order of time"
        newest = log_ns
        if not topic.startswith(OURS):
            others.append((topic, kind, log_ns, data))
            if topic.startswith("/imu/"):
                stamp = stamp_ns(reader.deserialize(data, kind))
                samples[topic.removeprefix("/imu/")][stamp] = log_ns
            continue
        foot = topic.split("/")[2]
        message = reader.deserialize(data, kind)
        if topic.endswith("/velocity"):
            velocities[foot].append(message.twist.covariance[0])
        elif topic.endswith("/contact"):
            contacts[foot].append((message, log_ns))
    assert sorted(others) == sorted(original), "messages of others differ"
    for foot, found in contacts.items():
        assert len(found) == len(rows[foot]) == len(samples[foot]) == len(velocities[foot]), foot
        for (message, log_ns), row, variance in zip(found, rows[foot], velocities[foot]):
            # Both are written at once, and stamps of the bag have ns, those of ours µs.
            stamp = min(samples[foot], key=lambda other: abs(other - stamp_ns(message)))
            assert abs(stamp - stamp_ns(message)) <= 500, (foot, stamp, stamp_ns(message))
            assert 0 <= log_ns - samples[foot].pop(stamp) + 500 <= 1000, foot
            assert message.p_stable == single(row["p_stable"]), foot
            assert message.decision == (row["decision"] == "1"), foot
            assert STATES[message.state] == row["state"], foot
            assert abs(variance - single(row["sigma_v"]) ** 2) <= 1e-12 * variance, foot
    print(sum(len(found) for found in contacts.values()))


main(*sys.argv[1:])
