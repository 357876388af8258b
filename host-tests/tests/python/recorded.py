"""Compares the IMU messages of a recording, which `footfall record file:bag` has written, with the IMU messages of
the bag, in which the feet are frames of one topic. rosbags reads the bag, mcap_ros2 the recording.

usage: recorded.py bag topic rec.mcap

Prints the number of messages that are equal as f32.
"""

import sys
from collections import defaultdict
from pathlib import Path

import numpy
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def vector(v):
    return tuple(numpy.float32([v.x, v.y, v.z]))


def readings(message):
    return vector(message.linear_acceleration), vector(message.angular_velocity)


def main(bag, topic, recording):
    original, recorded = defaultdict(list), defaultdict(list)
    with AnyReader([Path(bag)], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topic]
        for connection, _, data in reader.messages(connections):
            message = reader.deserialize(data, connection.msgtype)
            original[message.header.frame_id].append(readings(message))
    for message in read_ros2_messages(recording, log_time_order=False):
        foot, _, kind = message.channel.topic.removeprefix("/footfall/").partition("/")
        if kind == "imu":
            recorded[foot].append(readings(message.ros_msg))
    assert len(original) == 4, sorted(original)
    assert original == recorded, (sorted(original), sorted(recorded))
    print(sum(len(messages) for messages in recorded.values()))


main(*sys.argv[1:])
