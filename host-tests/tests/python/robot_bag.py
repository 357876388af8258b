"""A bag of a robot with an IMU in its trunk and in two feet, and the loads of the feet, written by rosbags.

usage: robot_bag.py walk.csv folder

The left foot has the samples of the table. The right foot has the same samples with x and y turned.
"""

import sys
from pathlib import Path

import numpy
import pandas
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore

START_NS = 1_700_000_000_000_000_000
STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
IMU, LOAD = "sensor_msgs/msg/Imu", "std_msgs/msg/Float64"


def imu(stamp_ns, row, turn):
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    vector = TYPES["geometry_msgs/msg/Vector3"]
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return TYPES[IMU](
        header=TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id="imu"),
        orientation=TYPES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=numpy.array([-1.0] + 8 * [0.0]),
        angular_velocity=vector(x=turn * row.wx, y=turn * row.wy, z=row.wz),
        angular_velocity_covariance=numpy.zeros(9),
        linear_acceleration=vector(x=turn * row.ax, y=turn * row.ay, z=row.az),
        linear_acceleration_covariance=numpy.zeros(9),
    )


def main(table, folder):
    walk = pandas.read_csv(table).head(3000)
    with Writer(Path(folder), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {"/fl/imu": IMU, "/fr/imu": IMU, "/trunk/imu": IMU, "/ft/fl": LOAD, "/ft/fr": LOAD}
        connections = {topic: writer.add_connection(topic, kind, typestore=STORE) for topic, kind in topics.items()}
        for row in walk.itertuples():
            now_ns = START_NS + round(row.t * 1e9)
            for topic, kind in topics.items():
                if kind == LOAD:
                    message = TYPES[LOAD](data=float(row.force))
                else:
                    message = imu(now_ns, row, -1.0 if topic == "/fr/imu" else 1.0)
                writer.write(connections[topic], now_ns + (kind == IMU), bytes(STORE.serialize_cdr(message, kind)))


main(*sys.argv[1:])
