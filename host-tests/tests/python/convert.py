"""Reads what `footfall convert` writes with third-party libraries, and compares every value with the table.

usage: convert.py WALK.csv FOLDER

FOLDER has walk.parquet, walk.mcap and the bag walk, all of WALK.csv. Prints the number of samples.
"""

import sys
from pathlib import Path

import numpy
import pandas
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

AXES = ["ax", "ay", "az", "wx", "wy", "wz"]
IMU = "/footfall/walk/imu"


def same(found, expected, what):
    found, expected = numpy.asarray(found), numpy.asarray(expected)
    assert found.shape == expected.shape, (what, found.shape, expected.shape)
    assert numpy.array_equal(found, expected, equal_nan=True), what


def tables(walk, folder):
    typed = pandas.read_parquet(folder / "walk.parquet")
    assert list(typed.columns) == list(walk.columns), typed.columns
    assert {str(typed[name].dtype) for name in AXES + ["force"]} == {"float32"}, typed.dtypes
    for name in AXES + ["force", "t", "label"]:
        same(typed[name].astype("float64"), walk[name].astype("float64"), name)
    assert list(typed["validity"]) == list(walk["validity"].fillna("valid")), "validity"


def numbers(message):
    a, w = message.linear_acceleration, message.angular_velocity
    return [a.x, a.y, a.z, w.x, w.y, w.z]


def compare(walk, messages, reader):
    """Messages by topic: the time of writing, ns, and the message."""
    samples = messages[IMU]
    times = numpy.round(walk["t"] * 1e6).astype("int64") * 1000
    shift = samples[0][0] - times[0]
    assert shift % 1_000_000_000 == 0, shift
    same([log_ns for log_ns, _ in samples], times + shift, f"{reader}: times")
    stamps = [m.header.stamp.sec * 1_000_000_000 + m.header.stamp.nanosec for _, m in samples]
    same(stamps, times + shift, f"{reader}: stamps")
    same([numbers(m) for _, m in samples], walk[AXES].astype("float64"), f"{reader}: axes")
    assert all(m.orientation_covariance[0] == -1 for _, m in samples), reader
    by_time = {log_ns: row for log_ns, row in zip(times + shift, range(len(walk)))}
    for topic, column in [("/label", "label"), ("/validity", "validity")]:
        values = [None] * len(walk)
        for log_ns, message in messages[IMU + topic]:
            values[by_time[log_ns]] = message.data
        expected = [None if pandas.isna(value) else value for value in walk[column]]
        assert values == expected, f"{reader}: {column}"
    loads = numpy.full(len(walk), numpy.nan)
    for log_ns, message in messages["/footfall/walk/load"]:
        loads[by_time[log_ns]] = message.data
    same(loads, walk["force"].astype("float64"), f"{reader}: load")


def bags(walk, folder):
    messages = {}
    for message in read_ros2_messages(folder / "walk.mcap"):
        entry = (message.log_time_ns, message.ros_msg)
        messages.setdefault(message.channel.topic, []).append(entry)
    compare(walk, messages, "mcap-ros2-support")
    store = get_typestore(Stores.ROS2_HUMBLE)
    messages = {}
    with AnyReader([folder / "walk.mcap"], default_typestore=store) as reader:
        assert reader.message_count == sum(c.msgcount for c in reader.connections)
        for connection, log_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            messages.setdefault(connection.topic, []).append((log_ns, message))
        assert sum(map(len, messages.values())) == reader.message_count
    compare(walk, messages, "rosbags")


DTYPES = {name: "float32" for name in AXES + ["force"]} | {"label": "float64", "validity": "object"}


def main():
    walk = pandas.read_csv(sys.argv[1], dtype=DTYPES)
    folder = Path(sys.argv[2])
    tables(walk, folder)
    bags(walk, folder)
    print(len(walk))


main()
