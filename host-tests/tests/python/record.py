"""Reads a recording of `footfall record` with third-party libraries, and compares every contact and
every probability with the table of `footfall decode`.

Usage: record.py REC.mcap ROWS.csv
"""

import csv
import math
import struct
import sys
from pathlib import Path

from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

TOPIC = "/footfall/FL/contact"
STATES = ["unknown", "stance", "slip", "swing", "quiet_swing", "landing"]
AXES = ["p_ax", "p_ay", "p_az", "p_wx", "p_wy", "p_wz"]


def single(text):
    """A number as a float of 32 bits; NaN if the cell is blank."""
    return struct.unpack("f", struct.pack("f", float(text)))[0] if text else math.nan


def same(one, other):
    return one == other or (math.isnan(one) and math.isnan(other))


def compare(messages, probabilities, rows, reader):
    assert len(messages) == len(rows), f"{reader}: {len(messages)} messages, {len(rows)} rows"
    assert len(probabilities) == len(rows), f"{reader}: {len(probabilities)} probabilities"
    stamps = []
    for index, (message, number, row) in enumerate(zip(messages, probabilities, rows)):
        where = f"{reader}, message {index}"
        assert message.foot == row["foot"] == "FL", where
        assert message.node == int(row["node"]), where
        assert message.sequence == int(row["sequence"]), where
        for field in ["p_stable", "p_tangential", "p_vertical"]:
            assert same(getattr(message, field), single(row[field])), f"{where}: {field}"
        assert number == (message.p_stable if message.valid else 0.0), where
        for value, axis in zip(message.p_axes, AXES):
            assert same(value, single(row[axis])), f"{where}: {axis}"
        assert message.decision == (row["decision"] == "1"), where
        assert STATES[message.state] == row["state"], where
        stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)
        assert message.header.frame_id == "footfall_FL", where
    assert all(a < b for a, b in zip(stamps, stamps[1:])), f"{reader}: stamps run backwards"
    times = [round(float(row["t"]) * 1e9) for row in rows]
    drift = [stamp - time for stamp, time in zip(stamps, times)]
    spread = max(drift) - min(drift)
    assert spread <= 1_100_000, f"{reader}: stamps are off the foot's clock by up to {spread} ns"


def main(recording, table):
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))

    contacts, probabilities = [], []
    for message in read_ros2_messages(recording, topics=[TOPIC, TOPIC + "/probability", "/diagnostics"]):
        if message.channel.topic == TOPIC:
            contacts.append(message.ros_msg)
        elif message.channel.topic == TOPIC + "/probability":
            probabilities.append(message.ros_msg.data)
        else:
            assert message.ros_msg.status[0].name == "footfall: FL"
    compare(contacts, probabilities, rows, "mcap-ros2-support")

    store = get_typestore(Stores.ROS2_HUMBLE)
    definition = Path(__file__).parents[3] / "ros2/footfall_msgs/msg/Contact.msg"
    store.register(get_types_from_msg(definition.read_text(), "footfall_msgs/msg/Contact"))
    contacts, probabilities, others = [], [], set()
    with AnyReader([Path(recording)], default_typestore=store) as reader:
        for connection, _, data in reader.messages():
            is_compared = connection.topic in (TOPIC, TOPIC + "/probability")
            # One of each other type.
            if not is_compared and connection.msgtype in others:
                continue
            message = reader.deserialize(data, connection.msgtype)
            if connection.topic == TOPIC:
                contacts.append(message)
            elif connection.topic == TOPIC + "/probability":
                probabilities.append(message.data)
            else:
                others.add(connection.msgtype)
    compare(contacts, probabilities, rows, "rosbags")
    expected = {"sensor_msgs/msg/Imu", "diagnostic_msgs/msg/DiagnosticArray"}
    assert expected <= others, others
    print(len(rows))


main(*sys.argv[1:])
