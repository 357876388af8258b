"""Files: recordings of every format with the program's options, and the output of feet."""

from __future__ import annotations

import csv
import dataclasses
import json
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pyarrow.parquet as parquet
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import footfall
from conftest import rows
from test_bits import COLUMNS, assert_same, write

STORE = get_typestore(Stores.ROS2_JAZZY)
START_NS = 1_700_000_000_000_000_000


def message(name: str, **fields: Any) -> Any:
    return STORE.types[name](**fields)


def bag(path: Path, feet: Mapping[str, footfall.Recording], samples: int) -> None:
    """Writes a bag of ROS 2: of each foot an IMU and the force under it."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        imu, wrench = "sensor_msgs/msg/Imu", "geometry_msgs/msg/WrenchStamped"
        for foot, walk in feet.items():
            to = writer.add_connection(f"/{foot}/imu", imu, typestore=STORE)
            to_load = writer.add_connection(f"/{foot}/ft", wrench, typestore=STORE)
            assert walk.load is not None
            for k in range(samples):
                ns = START_NS + round(float(walk.t[k]) * 1e6) * 1000
                sec, nanosec = divmod(ns, 1_000_000_000)
                stamp = message("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
                header = message("std_msgs/msg/Header", stamp=stamp, frame_id="foot")
                sample = message(
                    imu,
                    header=header,
                    orientation=message("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
                    orientation_covariance=np.array([-1.0] + 8 * [0.0]),
                    angular_velocity=vector(walk.gyr[k]),
                    angular_velocity_covariance=np.zeros(9),
                    linear_acceleration=vector(walk.acc[k]),
                    linear_acceleration_covariance=np.zeros(9),
                )
                writer.write(to, ns, STORE.serialize_cdr(sample, imu))
                force, torque = vector([0.0, 0.0, walk.load[k]]), vector(np.zeros(3))
                load = message("geometry_msgs/msg/Wrench", force=force, torque=torque)
                load = message(wrench, header=header, wrench=load)
                writer.write(to_load, ns, STORE.serialize_cdr(load, wrench))


def vector(values: Any) -> Any:
    x, y, z = (float(value) for value in values)
    return message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def test_each_foot_of_a_bag_has_the_programs_bits(program: str, tmp_path: Path) -> None:
    feet = {name: footfall.simulate("trot", 4.0, seed) for seed, name in enumerate(["FL", "FR"])}
    bag(tmp_path / "bag", feet, 3000)
    table = rows(
        program,
        *["bag", "--topic", "/FR/imu", "--topic", "/FL/imu"],
        *["--load-topic", "/FR/ft:force.z", "--load-topic", "/FL/ft:force.z"],
        cwd=tmp_path,
    )
    chosen = {"topic": ["/FR/imu", "/FL/imu"], "load_topic": ["/FR/ft:force.z", "/FL/ft:force.z"]}
    results = footfall.estimate_file(tmp_path / "bag", **chosen)  # type: ignore[arg-type]
    recordings = footfall.read(tmp_path / "bag", **chosen)  # type: ignore[arg-type]
    assert [result.foot for result in results] == [recording.foot for recording in recordings]
    assert [recording.foot for recording in recordings] == ["FR", "FL"]
    for foot, (result, recording) in enumerate(zip(results, recordings)):
        part = table[3000 * foot : 3000 * (foot + 1)]
        assert_same(result, part)
        assert_same(recording.estimate(), part)
        assert recording.load is not None and np.isfinite(recording.load[1:]).all()
    [left, right] = footfall.read(tmp_path / "bag", topic="all")
    assert (left.foot, right.foot) == ("FL", "FR")
    other = {"FL": "a", "FR": "b"}
    for renamed in (other, "FL=a,FR=b"):
        read = footfall.read(tmp_path / "bag", topic="all", rename=renamed)
        assert [recording.foot for recording in read] == ["a", "b"]
    assert [result.foot for result in footfall.estimate_file(tmp_path / "bag", topic="all", rename=other)] == ["a", "b"]
    with pytest.raises(ValueError, match="two feet would be b: rename= gives each foot a name of its own"):
        footfall.read(tmp_path / "bag", topic="all", rename={"FL": "b", "FR": "b"})
    with pytest.raises(ValueError, match="rename: .*write OLD=NEW"):
        footfall.read(tmp_path / "bag", rename="FL")
    with pytest.raises(ValueError, match="/FL/imu"):
        footfall.read(tmp_path / "bag")


def test_a_table_of_somebody_else_is_read_with_the_programs_options(
    program: str, tmp_path: Path, walk: footfall.Recording
) -> None:
    """A table with other names and units, with times in ms of which one is repeated, and of a sensor that lies on its
    side."""
    acc = walk.acc[:, [0, 2, 1]] * [1.0, -1.0, 1.0] / 9.80665
    gyr = np.degrees(walk.gyr[:, [0, 2, 1]] * [1.0, -1.0, 1.0])
    lines = ["stamp,a1,a2,a3,wx,wy,wz"]
    for t, a, w in zip(walk.t, acc, gyr):
        lines.append(",".join([f"{1e3 * t:.3f}", *(f"{value:.6f}" for value in [*a, *w])]))
    lines.insert(4000, lines[4000])
    (tmp_path / "walk.csv").write_text("\n".join(lines) + "\n")
    table = rows(
        program,
        *["walk.csv", "--map", "t=stamp,ax=a1,ay=a2,az=a3", "--units", "g,dps"],
        *["--time-unit", "ms", "--times", "drop-bad", "--axes", "x,z,-y"],
        cwd=tmp_path,
    )
    chosen: dict[str, Any] = {
        "map": {"t": "stamp", "ax": "a1", "ay": "a2", "az": "a3"},
        "units": "g,dps",
        "time_unit": "ms",
        "times": "drop-bad",
        "axes": "x,z,-y",
    }
    [result] = footfall.estimate_file(tmp_path / "walk.csv", **chosen)
    assert_same(result, table)
    assert result.recording == "walk"
    assert [notice.partition(": ")[2] for notice in result.notices] == ["1 row left out, whose times do not advance"]
    [recording] = footfall.read(tmp_path / "walk.csv", **chosen)
    assert recording.axes == "x,z,-y"
    assert_same(recording.estimate(), table)
    assert_same(footfall.estimate(recording.acc, recording.gyr, recording.t, axes="x,z,-y"), table)
    assert result.p_stable[-1] == pytest.approx(walk.estimate().p_stable[-1], abs=0.02)


def test_a_sheet_of_excel_gives_the_same_as_its_table(tmp_path: Path, walk: footfall.Recording) -> None:
    write(walk, tmp_path / "table.csv")
    pandas.read_csv(tmp_path / "table.csv").to_excel(tmp_path / "walk.xlsx", index=False)
    [sheet] = footfall.read(tmp_path / "walk.xlsx")
    [table] = footfall.read(tmp_path / "table.csv")
    assert sheet.name == "walk" and np.array_equal(sheet.acc, table.acc) and np.array_equal(sheet.t, table.t)
    [result] = footfall.estimate_file(tmp_path / "walk.xlsx")
    assert np.array_equal(result.p_stable, table.estimate().p_stable)
    pandas.DataFrame({"a": [1.0], "b": [2.0]}).to_excel(tmp_path / "other.xlsx", index=False)
    with pytest.raises(ValueError, match="^[^ ]*other.xlsx"):
        footfall.read(tmp_path / "other.xlsx")


def test_a_recording_becomes_parquet_that_is_read_back(tmp_path: Path, walk: footfall.Recording) -> None:
    parquet.write_table(walk.to_arrow(), tmp_path / "walk.parquet")
    [again] = footfall.read(tmp_path / "walk.parquet")
    for name in ("t", "acc", "gyr", "load", "label", "validity"):
        assert np.array_equal(getattr(again, name), getattr(walk, name)), name
    assert walk.label is not None
    partly = dataclasses.replace(walk, label=np.where(walk.t < 3.0, -1, walk.label).astype(np.int8))
    parquet.write_table(partly.to_arrow(), tmp_path / "walk.parquet")
    [again] = footfall.read(tmp_path / "walk.parquet")
    assert np.array_equal(again.label, partly.label)  # type: ignore[arg-type]


def test_what_a_configuration_says_of_the_file_counts_and_an_argument_wins(
    program: str, tmp_path: Path, walk: footfall.Recording
) -> None:
    write(walk, tmp_path / "walk.csv")
    (tmp_path / "robot.toml").write_text('axes = "y,-x,z"\nsample_rate_hz = 998\n')
    table = rows(program, "walk.csv", "--config", "robot.toml", "--axes", "x,y,z", cwd=tmp_path)
    config = tmp_path / "robot.toml"
    [result] = footfall.estimate_file(tmp_path / "walk.csv", config=config, axes="x,y,z")
    assert_same(result, table)
    [other] = footfall.estimate_file(tmp_path / "walk.csv", config=config)
    assert not np.array_equal(other.quaternion, result.quaternion)


def test_events_are_those_of_the_program(program: str, tmp_path: Path) -> None:
    slippery = footfall.simulate("trot", 20.0, seed=3, greased=0.3)
    write(slippery, tmp_path / "walk.csv")
    command = [program, "replay", "walk.csv", "--events", "events.csv"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    with open(tmp_path / "events.csv", encoding="utf-8") as file:
        table = list(csv.DictReader(file))

    def number(cell: str) -> float | None:
        return float(cell) if cell else None

    events = slippery.estimate().events()
    assert len(events) == len(table) and {event.kind for event in events} == {
        "touch_down",
        "lift_off",
        "slip_start",
        "slip_end",
    }
    for event, row in zip(events, table):
        assert (event.kind, f"{event.t:.6f}") == (row["event"], row["t"])
        assert event.duration == number(row["duration"])
        assert np.float32(event.p_peak) == np.float32(row["p_peak"])
        distance = number(row["distance"])
        assert (event.distance is None) == (distance is None)
        assert event.distance is None or event.distance == pytest.approx(distance, abs=1e-6)
    [from_file] = footfall.estimate_file(tmp_path / "walk.csv")
    assert from_file.events() == events


@pytest.fixture(scope="session")
def demo(program: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the output of the simulated foot of the demo."""
    folder = tmp_path_factory.mktemp("demo")
    subprocess.run([program, "demo"], cwd=folder, check=True, capture_output=True)
    return folder / "footfall-demo"


@pytest.mark.parametrize("log", ["can.log", "uart.bin"])
def test_what_a_foot_has_sent_has_the_programs_rows(
    program: str, tmp_path: Path, demo: Path, log: str
) -> None:
    command = [program, "decode", str(demo / log), "--output", "rows.csv", "--json"]
    command += ["--names", "17=front-left"]
    output = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True).stdout
    report = json.loads(output)
    del report["schema"], report["version"]
    decoded = footfall.decode(demo / log, names={17: "front-left"})
    assert decoded.report == report
    with open(tmp_path / "rows.csv", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert len(decoded) == len(table) > 10_000
    angular_rate = {f"uw{axis}": ("angular_rate", k) for k, axis in enumerate("xyz")}
    temperature: dict[str, tuple[str, int | None]] = {"temperature": ("temperature", None)}
    # No frame has the standard deviation of the velocity.
    of_frames = {column: of for column, of in COLUMNS.items() if column != "sigma_v"}
    for column, (attribute, index) in (of_frames | angular_rate | temperature).items():
        array = getattr(decoded, attribute)
        array = array if index is None else array[:, index]
        cells = [row[column] for row in table]
        assert np.array_equal(np.isnan(array), [cell == "" for cell in cells]), column
        expected = np.array([float(cell or "nan") for cell in cells], dtype=np.float32)
        assert np.array_equal(array, expected, equal_nan=True), column
    for column in ("t", "t_received", "t_common"):
        cells = [f"{time:.6f}" if time == time else "" for time in getattr(decoded, column)]
        assert cells == [row[column] for row in table]
    for place, names, column in (
        (decoded.interface, decoded.interfaces, "interface"),
        (decoded.foot, decoded.feet, "foot"),
    ):
        cells = [names[k] if k >= 0 else "" for k in place]
        assert cells == [row[column] for row in table]
    assert list(decoded.node) == [int(row["node"] or 0) for row in table]
    assert list(decoded.segment) == [int(row["segment"]) for row in table]
    assert list(decoded.sequence) == [int(row["sequence"]) for row in table]
    assert list(decoded.by_sync) == [row["clock"] == "sync" for row in table]
    assert list(decoded.state_names()) == [row["state"] for row in table]
    assert list(decoded.decision) == [row["decision"] == "1" for row in table]
    assert {name for row in table for name in row["flags"].split("|")} <= {"", *footfall.SENT_FLAGS}
    for name in footfall.SENT_FLAGS:
        expected_flag = [name in row["flags"].split("|") for row in table]
        assert list(decoded.has_flag(name)) == expected_flag
    if log == "can.log":
        assert decoded.of("front-left").all() and "front-left" in repr(decoded)
        with pytest.raises(ValueError, match="'RR', but one of front-left"):
            decoded.of("RR")


def test_a_node_is_a_foot_where_it_is_said_to_be_one(tmp_path: Path) -> None:
    log = tmp_path / "can.log"
    log.write_text("(1609459200.000111) can0 1A1#FFFF80800C0007D8\n")
    assert len(footfall.decode(log)) == 0
    [node] = footfall.decode(log, nodes=[0x21]).node
    assert node == 0x21
    for call, error in (
        ({"nodes": [128]}, "node is 128, but a node id, 1 to 127"),
        ({"names": {1: "a b"}}, "'a b' of node 1"),
    ):
        with pytest.raises(ValueError, match=error.replace("'a b'", '"a b"')):
            footfall.decode(log, **call)
    with pytest.raises(OSError, match="nowhere.log"):
        footfall.decode("nowhere.log")
    with pytest.raises(ValueError, match="neither a log of candump"):
        footfall.decode(__file__)


def test_recorded_contacts_are_the_estimates(program: str, tmp_path: Path) -> None:
    record = [program, "record", "demo:feet=2,seconds=4", "-o", "walk.mcap"]
    subprocess.run(record, cwd=tmp_path, check=True, capture_output=True)
    options = ["walk.mcap", "--topic", "all"]
    blank_is_nan = [
        {column: cell or ("" if column == "flags" else "nan") for column, cell in row.items()}
        for row in rows(program, *options, cwd=tmp_path)
    ]
    results = footfall.estimate_file(tmp_path / "walk.mcap", topic="all")
    assert [(len(result), result.rate, len(result.learnt)) for result in results] == 2 * [(4000, 1000.0, 0)]
    for foot, result in enumerate(results):
        assert_same(result, blank_is_nan[4000 * foot : 4000 * (foot + 1)])
        assert not result.findings
    assert "estimate_again=True computes the estimate from the samples" in results[0].notices[0]
    again = footfall.estimate_file(tmp_path / "walk.mcap", topic="all", estimate_again=True)
    table = rows(program, *options, "--estimate-again", cwd=tmp_path)
    assert len(again[0]) < 250
    assert_same(again[0], table[: len(again[0])])
    assert [(result.edge > 0, result.first_gyro_bias.size) for result in results] == [(False, 0), (False, 0)]
