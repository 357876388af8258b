"""Writes a walk in third-party file formats, each by its own library.

usage: roads.py walk.csv folder

walk.csv is a table of ours. Into folder/same go bags and Parquet files of that walk, into
folder/feet bags in which it is the left of two feet, into folder/states bags with messages of robots that
have its numbers as fields, into folder/robots bags of a Unitree robot with an IMU in each foot, into folder/frames bags with
four feet on one topic by their frames, into folder/other files that are no recordings.
Each name is printed. Bags have the load on /ft, or /ft/fl and /ft/fr.
"""

import dataclasses
import functools
import json
import pickle
import sqlite3
import sys
import tarfile
import zipfile
from pathlib import Path

import numpy
import pandas
import pyarrow
import pyarrow.feather
import pyarrow.parquet
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_123_456_000
# Time from the stamp of a message to its writing.
LATE_NS = 2_345_678

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
IMU = "sensor_msgs/msg/Imu"
WRENCH = "geometry_msgs/msg/WrenchStamped"

AXES = ["ax", "ay", "az", "wx", "wy", "wz"]


def header(stamp_ns, frame):
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def vector(x, y, z):
    return TYPES["geometry_msgs/msg/Vector3"](x=float(x), y=float(y), z=float(z))


def imu(stamp_ns, row, frame="foot"):
    unknown = numpy.array([-1.0] + 8 * [0.0])
    return TYPES[IMU](
        header=header(stamp_ns, frame),
        orientation=TYPES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=unknown,
        angular_velocity=vector(row.wx, row.wy, row.wz),
        angular_velocity_covariance=numpy.zeros(9),
        linear_acceleration=vector(row.ax, row.ay, row.az),
        linear_acceleration_covariance=numpy.zeros(9),
    )


def wrench(stamp_ns, force):
    zero = vector(0, 0, 0)
    return TYPES[WRENCH](
        header=header(stamp_ns, "sole"),
        wrench=TYPES["geometry_msgs/msg/Wrench"](force=vector(1, 2, force), torque=zero),
    )


class Walk:
    """Messages of a walk by topic, type, and time of writing; the load of a sample comes after it. Each is made and
    serialised once for all files."""

    def __init__(self, walk, feet):
        self.messages = list(messages(walk, feet))

    @functools.cached_property
    def plain(self):
        return [(topic, name, log_ns, plain(message)) for topic, name, log_ns, message in self.messages]

    @functools.cached_property
    def little_endian(self):
        return self.serialised(True)

    @functools.cached_property
    def big_endian(self):
        return self.serialised(False)

    def serialised(self, little_endian):
        return [
            (topic, name, log_ns, bytes(STORE.serialize_cdr(message, name, little_endian=little_endian)))
            for topic, name, log_ns, message in self.messages
        ]


def messages(walk, feet):
    for row in walk.itertuples():
        stamp_ns = START_NS + round(row.t * 1e6) * 1000
        for foot, turned in feet.items():
            turn = -1.0 if turned else 1.0
            sample = row._replace(ax=turn * row.ax, ay=turn * row.ay)
            yield "/imu" + foot, IMU, stamp_ns + LATE_NS, imu(stamp_ns, sample)
            yield "/ft" + foot, WRENCH, stamp_ns + LATE_NS + 1, wrench(stamp_ns, row.force)


def definition(name, store=STORE):
    text, _ = store.generate_msgdef(name, ros_version=2)
    return text


def plain(message):
    """A message of rosbags as mcap_ros2 takes it: lists instead of arrays."""
    if isinstance(message, numpy.ndarray):
        return message.tolist()
    if dataclasses.is_dataclass(message):
        names = [field.name for field in dataclasses.fields(message)]
        return {name: plain(getattr(message, name)) for name in names if name != "__msgtype__"}
    return message


def by_mcap_ros2(path, walk, compression):
    with path.open("wb") as file:
        writer = Ros2Writer(file, chunk_size=100_000, compression=compression)
        schemas = {name: writer.register_msgdef(name, definition(name)) for name in (IMU, WRENCH)}
        for topic, name, log_ns, message in walk.plain:
            writer.write_message(topic, schemas[name], message, log_time=log_ns)
        writer.add_attachment(0, 0, "notes.txt", "text/plain", b"a walk")
        writer.finish()


def by_mcap(path, serialised, store=STORE, **options):
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile="ros2", library="roads")
        schemas, channels = {}, {}
        for topic, name, log_ns, data in serialised:
            if name not in schemas:
                schemas[name] = writer.register_schema(name, "ros2msg", definition(name, store).encode())
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", schemas[name])
            writer.add_message(channels[topic], log_ns, data, log_ns)
        writer.finish()


def by_rosbags(path, serialised, version, plugin, mode=CompressionMode.NONE, store=STORE):
    writer = Rosbag2Writer(path, version=version, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, name, log_ns, data in serialised:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=store)
            writer.write(connections[topic], log_ns, data)


UNCHUNKED = {
    "use_chunking": False,
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
    "enable_crcs": False,
}


MODES = {
    StoragePlugin.SQLITE3: (CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE),
    StoragePlugin.MCAP: (
        CompressionMode.NONE,
        CompressionMode.FILE,
        CompressionMode.MESSAGE,
        CompressionMode.STORAGE,
    ),
}


def bags(folder, walk):
    """The walk of one foot in bags of every kind."""
    for compression in (CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD):
        by_mcap_ros2(folder / f"ros2_{compression.name.lower()}.mcap", walk, compression)
    by_mcap(folder / "records.mcap", walk.little_endian, **UNCHUNKED)
    by_mcap(folder / "big_endian.mcap", walk.big_endian, compression=CompressionType.ZSTD)
    for plugin, modes in MODES.items():
        for mode in modes:
            for version in (8, 9):
                name = f"{plugin.name}_{mode.name}_{version}".lower()
                by_rosbags(folder / name, walk.little_endian, version, plugin, mode)
    alone(folder)


def alone(folder):
    """The file of a bag, without its folder."""
    database = next((folder / "sqlite3_none_9").glob("*.db3"))
    (folder / "alone.db3").write_bytes(database.read_bytes())


def bags_of_feet(folder, walk):
    """Two feet in one bag of each kind of container, with the same compressions as the bags of one foot."""
    by_mcap_ros2(folder / "ros2_zstd.mcap", walk, CompressionType.ZSTD)
    by_mcap(folder / "records.mcap", walk.little_endian, **UNCHUNKED)
    by_mcap(folder / "big_endian.mcap", walk.big_endian, compression=CompressionType.ZSTD)
    for version, plugin, mode in (
        (8, StoragePlugin.SQLITE3, CompressionMode.NONE),
        (9, StoragePlugin.SQLITE3, CompressionMode.NONE),
        (9, StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
        (8, StoragePlugin.MCAP, CompressionMode.FILE),
        (9, StoragePlugin.MCAP, CompressionMode.NONE),
    ):
        name = f"{plugin.name}_{mode.name}_{version}".lower()
        by_rosbags(folder / name, walk.little_endian, version, plugin, mode)
    alone(folder)


def parquets(folder, walk):
    write = pyarrow.parquet.write_table
    table = pyarrow.Table.from_pandas(walk, preserve_index=False)
    for compression in ("none", "snappy", "gzip", "lz4", "zstd"):
        write(table, folder / f"{compression}.parquet", compression=compression)
    write(table, folder / "groups.parquet", row_group_size=1000, data_page_version="2.0")
    plain = {"use_dictionary": False, "version": "2.6"}
    encodings = {name: "BYTE_STREAM_SPLIT" for name in AXES + ["t", "force"]}
    write(table, folder / "split.parquet", column_encoding=encodings, **plain)
    # The axes are converted to f32.
    single = walk.astype({name: "float32" for name in AXES + ["force"]})
    single.to_parquet(folder / "single.parquet")
    stamps = START_NS + (walk["t"] * 1e6).round().astype("int64") * 1000
    indexed = walk.drop(columns="t").set_index(pandas.to_datetime(stamps, utc=True).rename(None))
    indexed.to_parquet(folder / "indexed.parquet")
    whole = walk.assign(t=stamps).rename(columns={"t": "timestamp_ns"})
    names = dict(zip(AXES, ["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"]))
    whole.rename(columns=names).to_parquet(folder / "others.parquet")
    by_struct = pyarrow.Table.from_pydict(
        {
            "elapsed": pyarrow.array((walk["t"] * 1e6).round().astype("int64"), pyarrow.duration("us")),
            "linear_acceleration": [dict(zip("xyz", a)) for a in walk[AXES[:3]].to_numpy()],
            "angular_velocity": [dict(zip("xyz", w)) for w in walk[AXES[3:]].to_numpy()],
            "force": walk["force"],
            "validity": pyarrow.array(["valid"] * len(walk)).dictionary_encode(),
        }
    )
    write(by_struct, folder / "structs.parquet")


# Frames of the feet on one topic, with the factors of their x and y.
FRAMES = {"fl_foot": 1.0, "fr_foot": -1.0, "rl_foot": 0.5, "rr_foot": 0.25}


def frames(folder, walk):
    """Four feet on one topic, distinguished by their frames. The first foot has the walk."""
    for plugin in (StoragePlugin.SQLITE3, StoragePlugin.MCAP):
        with Rosbag2Writer(folder / plugin.name.lower(), version=9, storage_plugin=plugin) as writer:
            connection = writer.add_connection("/foot_imus", IMU, typestore=STORE)
            for row in walk.itertuples():
                stamp_ns = START_NS + round(row.t * 1e6) * 1000
                for frame, factor in FRAMES.items():
                    sample = row._replace(ax=factor * row.ax, ay=factor * row.ay)
                    data = STORE.serialize_cdr(imu(stamp_ns, sample, frame), IMU)
                    writer.write(connection, stamp_ns + LATE_NS, data)


LOW_STATE = "unitree_go/msg/LowState"
FEET = "test_msgs/msg/Feet"
JOINTS = "sensor_msgs/msg/JointState"

# The first definition is from https://github.com/unitreerobotics/unitree_ros2. The second one is invented, for a
# robot with an IMU in each foot.
DEFINITIONS = {
    LOW_STATE: """
uint8[2] head\nuint8 level_flag\nuint8 frame_reserve\nuint32[2] sn\nuint32[2] version\nuint16 bandwidth
IMUState imu_state\nMotorState[20] motor_state\nBmsState bms_state\nint16[4] foot_force\nint16[4] foot_force_est
uint32 tick\nuint8[40] wireless_remote\nuint8 bit_flag\nfloat32 adc_reel\nint8 temperature_ntc1
int8 temperature_ntc2\nfloat32 power_v\nfloat32 power_a\nuint16[4] fan_frequency\nuint32 reserve\nuint32 crc""",
    "unitree_go/msg/IMUState": """
float32[4] quaternion\nfloat32[3] gyroscope\nfloat32[3] accelerometer\nfloat32[3] rpy\nint8 temperature""",
    "unitree_go/msg/MotorState": """
uint8 mode\nfloat32 q\nfloat32 dq\nfloat32 ddq\nfloat32 tau_est\nfloat32 q_raw\nfloat32 dq_raw
float32 ddq_raw\nint8 temperature\nuint32 lost\nuint32[2] reserve""",
    "unitree_go/msg/BmsState": """
uint8 version_high\nuint8 version_low\nuint8 status\nuint8 soc\nint32 current\nuint16 cycle
int8[2] bq_ntc\nint8[2] mcu_ntc\nuint16[15] cell_vol""",
    FEET: "std_msgs/Header header\nstring[] names\nFoot[] feet",
    "test_msgs/msg/Foot": "bool ok\ngeometry_msgs/Vector3 gyro\ngeometry_msgs/Vector3 acc",
}


def typed(store, name, fields):
    """A message with these fields. All other fields are zero, or empty if their length is variable."""
    def zero(kind, detail):
        if kind == 1:  # a number or a text
            return "" if detail[0] == "string" else 0
        if kind == 2:  # a message
            return typed(store, detail, {})
        inner, length = detail
        if kind == 4:  # a sequence
            length = 0
        if inner[0] == 2 or inner[1][0] == "string":
            return [zero(*inner) for _ in range(length)]
        return numpy.zeros(length, dtype=inner[1][0])

    _, definition = store.fielddefs[name]
    values = {field: fields.get(field, zero(int(kind), detail)) for field, (kind, detail) in definition}
    return store.types[name](**values)


def states_of_one_foot(store, walk):
    """Topic, time of writing, fields."""
    whole = numpy.array
    for row in walk.itertuples():
        stamp_ns = START_NS + round(row.t * 1e6) * 1000
        stamped = {"header": header(stamp_ns, "")}
        imu_state = typed(store, "unitree_go/msg/IMUState", {
            "accelerometer": whole([row.ax, row.ay, row.az], dtype=numpy.float32),
            "gyroscope": whole([row.wx, row.wy, row.wz], dtype=numpy.float32),
        })
        foot = {"acc": vector(row.ax, row.ay, row.az), "gyro": vector(row.wx, row.wy, row.wz)}
        feet = [typed(store, "test_msgs/msg/Foot", {}), typed(store, "test_msgs/msg/Foot", foot)]
        messages = {
            "/joints": {**stamped, "name": ["a", "b"], "effort": whole([0.0, row.force])},
            "/lowstate": {
                "imu_state": imu_state,
                "foot_force": whole([0, round(row.force), 0, 0], dtype=numpy.int16),
            },
            "/feet": {**stamped, "names": ["left", "right one"], "feet": feet},
        }
        for topic, fields in messages.items():
            yield topic, stamp_ns + LATE_NS, fields


def robot_store():
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def states(folder, walk):
    """Writes axes and loads as fields of messages whose types are not made for an IMU."""
    store = robot_store()
    topics = {"/lowstate": LOW_STATE, "/feet": FEET, "/joints": JOINTS}
    serialised = [
        (topic, topics[topic], log_ns, store.serialize_cdr(typed(store, topics[topic], fields), topics[topic]))
        for topic, log_ns, fields in states_of_one_foot(store, walk)
    ]
    for version, plugin in ((8, StoragePlugin.SQLITE3), (9, StoragePlugin.SQLITE3), (9, StoragePlugin.MCAP)):
        by_rosbags(folder / f"{plugin.name}_{version}".lower(), serialised, version, plugin, store=store)
    # Bags before ROS 2 Iron have no definitions.
    with sqlite3.connect(next((folder / "sqlite3_8").glob("*.db3"))) as database:
        database.execute("DROP TABLE message_definitions")
    database.close()


def robot_messages(store, walk):
    """Four feet that walk at different times, and the state of a robot with their forces every two samples: topic, type,
    time of writing, message."""
    shifted = {foot: walk.iloc[numpy.roll(numpy.arange(len(walk)), 400 * k)] for k, foot in enumerate(("fl", "fr", "rl", "rr"))}
    rows = {foot: list(table.itertuples()) for foot, table in shifted.items()}
    for k, t in enumerate(walk["t"]):
        stamp_ns = START_NS + round(t * 1e6) * 1000
        if k % 2 == 0:
            forces = [round(rows[foot][k].force) for foot in ("fr", "fl", "rr", "rl")]
            motors = [typed(store, "unitree_go/msg/MotorState", {"q": 0.1 * k + motor}) for motor in range(20)]
            fields = {
                "motor_state": motors,
                "foot_force": numpy.array(forces, dtype=numpy.int16),
                "foot_force_est": numpy.array([1, -2, 3, -4], dtype=numpy.int16),
                "tick": k,
                "crc": 0xDEADBEEF - k,
            }
            yield "/lowstate", LOW_STATE, stamp_ns + LATE_NS - 400_000, typed(store, LOW_STATE, fields)
        for foot, of_foot in rows.items():
            yield f"/imu/{foot}", IMU, stamp_ns + LATE_NS, imu(stamp_ns, of_foot[k])


def robots(folder, walk):
    store = robot_store()
    messages = list(robot_messages(store, walk))

    def serialised(little_endian):
        return [
            (topic, name, log_ns, bytes(store.serialize_cdr(message, name, little_endian=little_endian)))
            for topic, name, log_ns, message in messages
        ]

    for version, plugin in ((8, StoragePlugin.SQLITE3), (9, StoragePlugin.MCAP)):
        by_rosbags(folder / f"{plugin.name}_{version}".lower(), serialised(True), version, plugin, store=store)
    by_mcap(folder / "big_endian.mcap", serialised(False), store, compression=CompressionType.ZSTD)


def others(folder, walk):
    few = walk.head(20)
    # If a server answers with a page instead of the file, a browser saves the page under the file's name.
    page = few.to_html(table_id="walk")
    (folder / "html.parquet").write_text(f"<!DOCTYPE html>\n<html><body>{page}</body></html>")
    numpy.save(folder / "numpy.npy", few.to_numpy())
    numpy.savez(folder / "numpy_archive.npz", walk=few.to_numpy())
    pyarrow.feather.write_feather(few, folder / "arrow_ipc.feather")
    (folder / "pickle.pkl").write_bytes(pickle.dumps(few))
    (folder / "json.json").write_text(json.dumps(few.to_dict()))
    few.to_json(folder / "json_records.json", orient="records")
    with zipfile.ZipFile(folder / "zip.zip", "w") as archive:
        archive.writestr("walk.csv", few.to_csv())
    few.to_csv(folder / "walk.csv")
    with tarfile.open(folder / "tar.tar.gz", "w:gz") as archive:
        archive.add(folder / "walk.csv")
    (folder / "walk.csv").unlink()
    with sqlite3.connect(folder / "sqlite.db") as database:
        few.to_sql("walk", database)
    database.close()


def main():
    walk = pandas.read_csv(sys.argv[1], usecols=["t", *AXES, "force"])
    folder = Path(sys.argv[2])
    for name in ("same", "feet", "frames", "states", "robots", "other"):
        (folder / name).mkdir(parents=True)
    bags(folder / "same", Walk(walk, {"": False}))
    parquets(folder / "same", walk)
    bags_of_feet(folder / "feet", Walk(walk.head(2000), {"/fl": False, "/fr": True}))
    frames(folder / "frames", walk.head(2000))
    states(folder / "states", walk.head(2000))
    robots(folder / "robots", walk.iloc[1000:4000].assign(t=walk["t"][:3000].to_numpy()))
    others(folder / "other", walk)


main()
