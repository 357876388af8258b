"""Compares a copy of a bag with contacts and events, as `footfall replay --output copy.mcap` writes it, with the bag and
with the tables of the same estimates and events, read by a third-party library.

usage: copied.py bag copy.mcap estimates.csv events.csv

The tables have a column `foot`; each foot's topic of samples is /imu/ and its name. Prints the numbers of contacts and of
events.
"""

import csv
import math
import struct
import sys
from collections import defaultdict
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

OURS = "/footfall/"
STATES = ["unknown", "stance", "slip", "swing", "quiet_swing", "landing"]
EVENTS = ["", "touch_down", "lift_off", "slip_start", "slip_end", "unstable_start", "unstable_end"]
MESSAGES = Path(__file__).parents[3] / "ros2/footfall_msgs/msg"


def single(text):
    return struct.unpack("f", struct.pack("f", float(text)))[0]


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def messages(path, store):
    path = Path(path)
    with AnyReader([path], default_typestore=store) as reader:
        for connection, log_ns, data in reader.messages():
            yield connection.topic, connection.msgtype, log_ns, bytes(data), reader


def rows_by_foot(table):
    rows = defaultdict(list)
    with open(table, newline="") as file:
        for row in csv.DictReader(file):
            rows[row["foot"]].append(row)
    return rows


def is_number(found, text):
    """Returns whether a value equals the number in a cell. A blank cell stands for NaN."""
    return math.isnan(found) if text == "" else abs(found - float(text)) <= 1e-6 * max(1.0, abs(found))


def sample_of(message, by_us):
    """Stamp of the sample of a message. Stamps of the bag are in ns, whereas our messages round them to µs."""
    own_us = stamp_ns(message) // 1000
    stamps = [stamp for us in (own_us - 1, own_us) for stamp in by_us.get(us, [])]
    [stamp] = [stamp for stamp in stamps if abs(stamp - stamp_ns(message)) <= 500]
    return stamp


def compare_events(foot, found, rows, samples, by_us):
    """Checks that each event of the table is written together with the sample of its time."""
    assert len(found) == len(rows), (foot, len(found), len(rows))
    for (message, log_ns), row in zip(found, sorted(rows, key=lambda row: float(row["t"]))):
        assert abs(log_ns - samples[sample_of(message, by_us)]) <= 1000, (foot, row)
        assert abs(stamp_ns(message) / 1e9 - float(row["t"])) <= 1e-6, (foot, row)
        assert (message.foot, EVENTS[message.kind]) == (foot, row["event"]), (foot, row)
        assert is_number(message.p_peak, row["p_peak"]), (foot, row)
        assert is_number(message.duration, row["duration"]), (foot, row)
        assert is_number(message.distance, row["distance"]), (foot, row)


def main(bag, copy, table, table_of_events):
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in ("Contact", "Event"):
        definition = (MESSAGES / f"{name}.msg").read_text()
        store.register(get_types_from_msg(definition, f"footfall_msgs/msg/{name}"))
    rows, rows_of_events = rows_by_foot(table), rows_by_foot(table_of_events)
    original = [(t, kind, log, data) for t, kind, log, data, _ in messages(bag, store)]
    others, contacts, velocities, events = [], defaultdict(list), defaultdict(list), defaultdict(list)
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
        elif topic.endswith("/event"):
            events[foot].append((message, log_ns))
    assert sorted(others) == sorted(original), "messages of others differ"
    assert events.keys() == rows_of_events.keys(), (sorted(events), sorted(rows_of_events))
    by_us = {foot: defaultdict(list) for foot in samples}
    for foot, stamps in samples.items():
        for stamp in stamps:
            by_us[foot][stamp // 1000].append(stamp)
    for foot, found in events.items():
        compare_events(foot, found, rows_of_events[foot], samples[foot], by_us[foot])
    for foot, found in contacts.items():
        assert len(found) == len(rows[foot]) == len(samples[foot]) == len(velocities[foot]), foot
        for (message, log_ns), row, variance in zip(found, rows[foot], velocities[foot]):
            # The contact and its sample are written at the same time.
            stamp = sample_of(message, by_us[foot])
            assert 0 <= log_ns - samples[foot].pop(stamp) + 500 <= 1000, foot
            assert message.p_stable == single(row["p_stable"]), foot
            assert message.decision == (row["decision"] == "1"), foot
            assert STATES[message.state] == row["state"], foot
            assert abs(variance - single(row["sigma_v"]) ** 2) <= 1e-12 * variance, foot
    print(*(sum(map(len, found.values())) for found in (contacts, events)))


main(*sys.argv[1:])
