"""A walk as other programs write it: pandas with comma decimals, a logger with counts and with mg, rosbags as a bag
of ROS 1.

usage: others.py walk.csv folder
"""

import sys
from pathlib import Path

import numpy
import pandas
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

ACC, GYR = ["ax", "ay", "az"], ["wx", "wy", "wz"]
G = 9.80665
# The values of a count at ±4 g and 2000 °/s, in g and °/s.
ACC_COUNT, GYR_COUNT = 0.000122, 0.07

START_NS = 1_700_000_000_000_000_000
IMU, LOAD = "sensor_msgs/msg/Imu", "std_msgs/msg/Float64"


STORE = get_typestore(Stores.ROS1_NOETIC)
TOPICS = {"/ft": LOAD, "/imu": IMU}


def messages(walk):
    """Topics, times and messages of a walk, in the serialisation of ROS 1."""
    types = STORE.types
    vector = types["geometry_msgs/msg/Vector3"]
    for k, row in enumerate(walk.itertuples()):
        now_ns = START_NS + round(row.t * 1e9)
        sec, nanosec = divmod(now_ns, 1_000_000_000)
        stamp = types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        message = types[IMU](
            header=types["std_msgs/msg/Header"](seq=k, stamp=stamp, frame_id="foot"),
            orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=numpy.array([-1.0] + 8 * [0.0]),
            angular_velocity=vector(x=row.wx, y=row.wy, z=row.wz),
            angular_velocity_covariance=numpy.zeros(9),
            linear_acceleration=vector(x=row.ax, y=row.ay, z=row.az),
            linear_acceleration_covariance=numpy.zeros(9),
        )
        force = types[LOAD](data=float(row.force))
        yield "/ft", now_ns, bytes(STORE.serialize_ros1(force, LOAD))
        yield "/imu", now_ns + 1, bytes(STORE.serialize_ros1(message, IMU))


def bag(path, walk, compression=None):
    writer = Writer(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {topic: writer.add_connection(topic, TOPICS[topic], typestore=STORE) for topic in TOPICS}
        for topic, now_ns, message in messages(walk):
            writer.write(connections[topic], now_ns, message)


def bag_in_mcap(path, walk):
    """Writes the messages of a bag of ROS 1 into MCAP unchanged, as the MCAP CLI does."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros1", library="others")
        channels = {}
        for topic, of_type in TOPICS.items():
            definition, _ = STORE.generate_msgdef(of_type)
            schema = writer.register_schema(of_type.replace("/msg/", "/"), "ros1msg", definition.encode())
            channels[topic] = writer.register_channel(topic, "ros1", schema)
        for topic, now_ns, message in messages(walk):
            writer.add_message(channels[topic], now_ns, message, now_ns)
        writer.finish()


def main(table, folder):
    walk = pandas.read_csv(table, usecols=["t", *ACC, *GYR, "force"]).head(3000)
    folder = Path(folder)
    walk.to_csv(folder / "point.csv", index=False)
    walk.to_csv(folder / "comma.csv", index=False, sep=";", decimal=",")
    counts = walk.copy()
    counts[ACC] = (walk[ACC] / G / ACC_COUNT).round().astype(int)
    counts[GYR] = (numpy.degrees(walk[GYR]) / GYR_COUNT).round().astype(int)
    counts.to_csv(folder / "counts.csv", index=False)
    of_counts = walk.copy()
    of_counts[ACC] = counts[ACC] * ACC_COUNT * G
    of_counts[GYR] = numpy.radians(counts[GYR] * GYR_COUNT)
    of_counts.to_csv(folder / "of_counts.csv", index=False)
    milli = walk.copy()
    milli[ACC] = walk[ACC] / G * 1000
    milli[GYR] = numpy.degrees(walk[GYR]) * 1000
    milli.to_csv(folder / "milli.csv", index=False)
    bag(folder / "walk.bag", walk)
    bag(folder / "bz2.bag", walk, Writer.CompressionFormat.BZ2)
    bag(folder / "lz4.bag", walk, Writer.CompressionFormat.LZ4)
    bag_in_mcap(folder / "ros1.mcap", walk)


main(*sys.argv[1:])
