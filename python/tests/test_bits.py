"""The package gives the program's results, to the last bit."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import footfall
from conftest import published, rows

COLUMNS = {
    "p_stable": ("p_stable", None),
    "p_tangential": ("p_tangential", None),
    "p_vertical": ("p_vertical", None),
    **{f"p_{axis}": ("p_axes", k) for k, axis in enumerate(footfall.AXES)},
    **{f"q{name}": ("quaternion", k) for k, name in enumerate("wxyz")},
    **{f"la{name}": ("linear_acceleration", k) for k, name in enumerate("xyz")},
    **{f"bw{name}": ("gyro_bias", k) for k, name in enumerate("xyz")},
    "sigma_v": ("sigma_v", None),
}

VALIDITIES = ("valid", "accelerometer_saturated", "gyroscope_saturated", "both_saturated")


def assert_same(result: footfall.Result, table: list[dict[str, str]]) -> None:
    """Compares every column of the program's table with its array."""
    assert len(result) == len(table)
    for column, (attribute, index) in COLUMNS.items():
        array = getattr(result, attribute)
        array = array if index is None else array[:, index]
        expected = np.array([row[column] for row in table], dtype=np.float32)
        assert np.array_equal(array.view(np.uint32), expected.view(np.uint32)), column
    assert list(result.state_names()) == [row["state"] for row in table]
    assert list(result.decision) == [row["decision"] == "1" for row in table]
    micros = np.array([round(float(row["t"]) * 1e6) for row in table])
    assert np.array_equal(np.round(result.t * 1e6), micros)
    for name in footfall.FLAGS:
        expected_flag = np.array([name in row["flags"].split("|") for row in table])
        assert np.array_equal(result.has_flag(name), expected_flag), name


@pytest.mark.parametrize(("format", "path"), published(), ids=lambda value: str(value)[-24:])
@pytest.mark.parametrize("preset", ["default", "paper"])
def test_published_recordings_have_the_programs_bits(
    program: str, tmp_path: Path, format: str, path: Path, preset: footfall.Preset
) -> None:
    options = ["--format", format, "--preset", preset]
    table = rows(program, str(path), *options, cwd=tmp_path)
    [recording] = footfall.read(path, format=format)
    assert_same(recording.estimate(preset=preset), table)


def test_a_simulated_walk_has_the_programs_bits_by_way_of_a_file(
    program: str, tmp_path: Path, walk: footfall.Recording
) -> None:
    write(walk, tmp_path / "walk.csv")
    table = rows(program, "walk.csv", cwd=tmp_path)
    assert_same(walk.estimate(), table)
    assert walk.load is not None
    assert walk.validity.any()
    result = footfall.estimate(walk.acc, walk.gyr, walk.t, load=walk.load, validity=walk.validity)
    assert_same(result, table)


def test_a_configuration_has_the_programs_effect(
    program: str, tmp_path: Path, walk: footfall.Recording
) -> None:
    bias = {"ax": 0.1, "ay": -0.2, "az": 0.05}
    config = {
        "axes": "x,-z,y",
        "accelerometer": {"bias_m_s2": bias},
        "decision": {"on_delay_s": 0.05},
    }
    (tmp_path / "robot.toml").write_text(
        'axes = "x,-z,y"\n'
        "accelerometer.bias_m_s2 = { ax = 0.1, ay = -0.2, az = 0.05 }\n"
        "decision.on_delay_s = 0.05\n"
    )
    write(walk, tmp_path / "walk.csv")
    table = rows(program, "walk.csv", "--config", "robot.toml", cwd=tmp_path)
    assert_same(walk.estimate(config=config), table)
    assert_same(walk.estimate(config=tmp_path / "robot.toml"), table)


def test_a_stream_has_the_bits_of_the_whole(walk: footfall.Recording) -> None:
    assert walk.load is not None
    whole = walk.estimate()
    flags = {name: whole.has_flag(name) for name in footfall.FLAGS}
    foot = footfall.Estimator(rate=walk.rate, format=walk.format)
    events: list[footfall.Event] = []
    late: list[float] = []
    for k in range(len(walk)):
        if k == 10_000:
            copy.deepcopy(foot).update((0.0, 0.0, 0.0), (9.0, 9.0, 9.0))
            foot = copy.copy(foot)
        new = foot.events()
        late.extend(walk.t[k - 1] - event.t for event in new if event.kind == "touch_down")
        events.extend(new)
        sample = walk.acc[k], walk.gyr[k], walk.t[k], walk.load[k], int(walk.validity[k])
        estimate = foot.update(*sample)
        assert np.float32(estimate.p_stable) == whole.p_stable[k]
        assert np.array_equal(np.array(estimate.p_axes, dtype=np.float32), whole.p_axes[k])
        assert np.array_equal(np.array(estimate.quaternion, dtype=np.float32), whole.quaternion[k])
        assert estimate.state == footfall.STATES[whole.state[k]]
        assert estimate.decision == whole.decision[k]
        assert np.float32(estimate.sigma_v) == whole.sigma_v[k]
        assert estimate.t == whole.t[k]
        assert set(estimate.flags) == {name for name in footfall.FLAGS if flags[name][k]}
    assert np.array_equal(np.array(foot.gyro_bias, dtype=np.float32), whole.gyro_bias[-1])
    assert np.array_equal(foot.learnt, whole.learnt)
    # Touch-downs come with their sample, before their duration is known.
    assert late and max(late) == 0.0
    events.extend(foot.events(ended=True))
    for event, other in zip(events, whole.events(), strict=True):
        assert (event.kind, event.t) == (other.kind, other.t)
        assert event == other or event.kind == "touch_down" and event.duration is None
    assert foot.events(ended=True) == ()


def test_an_estimator_has_no_pickle() -> None:
    with pytest.raises(TypeError, match="keep its samples, or .learnt"):
        pickle.dumps(footfall.Estimator(rate=1000.0))


def test_double_precision_and_strides_change_nothing(walk: footfall.Recording) -> None:
    expected = footfall.estimate(walk.acc, walk.gyr, walk.t)
    double = footfall.estimate(walk.acc.astype(np.float64), walk.gyr.astype(np.float64), walk.t)
    wide = np.zeros((len(walk), 14), dtype=np.float32)
    wide[:, 1:7:2], wide[:, 7:13:2] = walk.acc, walk.gyr
    strided = footfall.estimate(wide[:, 1:7:2], wide[:, 7:13:2], walk.t)
    for other in (double, strided):
        assert np.array_equal(other.p_stable, expected.p_stable)
        assert np.array_equal(other.quaternion, expected.quaternion)


@pytest.mark.parametrize("number", ["<f4", ">f4", "<f8", ">f8"])
@pytest.mark.parametrize("before", range(9))
def test_any_memory_layout_has_the_bits_of_a_copy(
    walk: footfall.Recording, number: str, before: int
) -> None:
    assert walk.load is not None
    n = 2000
    expected = footfall.estimate(walk.acc[:n], walk.gyr[:n], walk.t[:n], load=walk.load[:n])
    # Records as a C program writes them, without padding.
    record = np.dtype(
        [("head", f"S{before}"), ("acc", number, 3), ("status", "u1"), ("gyr", number, 3)]
        + [("t", "<f8"), ("load", number)]
    )
    packed = np.zeros(n, record)
    packed["acc"], packed["gyr"] = walk.acc[:n], walk.gyr[:n]
    packed["t"], packed["load"] = walk.t[:n], walk.load[:n]
    reversed_in_memory = packed[::-1].copy()[::-1]
    shifted = np.frombuffer(b"x" * before + packed.tobytes(), record, offset=before)
    for records in (packed, reversed_in_memory, shifted):
        columns = records["acc"], records["gyr"], records["t"]
        assert_equal(footfall.estimate(*columns, load=records["load"]), expected)


def assert_equal(result: footfall.Result, expected: footfall.Result) -> None:
    for column in ("p_stable", "quaternion", "state", "t"):
        assert np.array_equal(getattr(result, column), getattr(expected, column)), column


def test_missing_values_are_not_a_number(walk: footfall.Recording) -> None:
    n = 500
    acc = walk.acc[:n].astype(np.float64)
    acc[100:110, 1] = np.nan
    expected = footfall.estimate(acc, walk.gyr[:n], walk.t[:n])
    masked = np.ma.masked_array(np.nan_to_num(acc), np.isnan(acc))
    objects = acc.astype(object)
    objects[100:110, 1] = None
    for other in (masked, objects):
        assert_equal(footfall.estimate(other, walk.gyr[:n], walk.t[:n]), expected)


def test_datetimes_are_seconds_since_1970(walk: footfall.Recording) -> None:
    micros = np.round(walk.t * 1e6).astype(np.int64) + 1_600_000_000_000_000
    expected = footfall.estimate(walk.acc, walk.gyr, micros / 1e6)
    for unit in ("us", "ns"):
        times = micros.astype("datetime64[us]").astype(f"datetime64[{unit}]")
        assert_equal(footfall.estimate(walk.acc, walk.gyr, times), expected)
    missing = micros.astype("datetime64[us]")
    missing[7] = np.datetime64("NaT")
    with pytest.raises(ValueError, match=r"t\[7\] is NaN"):
        footfall.estimate(walk.acc, walk.gyr, missing)


def test_missing_values_of_pandas_are_not_a_number(walk: footfall.Recording) -> None:
    pandas = pytest.importorskip("pandas")
    n = 500
    acc = walk.acc[:n].astype(np.float64)
    acc[100:110, 1] = np.nan
    load = np.full(n, 50.0)
    load[200:220] = np.nan
    expected = footfall.estimate(acc, walk.gyr[:n], walk.t[:n], load=load)
    # Nullable numbers, and objects among which pandas.NA stands.
    nullable = pandas.DataFrame(acc, columns=["ax", "ay", "az"]).convert_dtypes()
    assert str(nullable["ay"].dtype) == "Float64" and nullable["ay"][100] is pandas.NA
    objects = nullable.astype(object)
    assert objects["ay"][100] is pandas.NA
    loads = pandas.Series(load, dtype="Float64")
    assert loads[200] is pandas.NA
    for other in (nullable, objects):
        for of_foot in (loads, loads.astype(object)):
            result = footfall.estimate(other, walk.gyr[:n], walk.t[:n], load=of_foot)
            assert_equal(result, expected)


@pytest.mark.parametrize("zone", ["UTC", "Europe/Athens"])
@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
def test_datetime_index_with_a_time_zone_counts_from_1970(
    walk: footfall.Recording, zone: str, unit: str
) -> None:
    pandas = pytest.importorskip("pandas")
    # Whole milliseconds, which every unit has.
    millis = 1_600_000_000_000 + np.arange(len(walk), dtype=np.int64)
    expected = footfall.estimate(walk.acc, walk.gyr, millis / 1e3)
    index = pandas.DatetimeIndex(millis.astype("datetime64[ms]")).as_unit(unit)
    index = index.tz_localize("UTC").tz_convert(zone)
    assert str(index.dtype) == f"datetime64[{unit}, {zone}]"
    for times in (index, index.to_series(), index.to_series().reset_index(drop=True)):
        assert_equal(footfall.estimate(walk.acc, walk.gyr, times), expected)


def write(recording: footfall.Recording, path: Path) -> None:
    """Writes a recording as a table of the program, with enough digits that numbers read back as the same float32."""
    assert recording.load is not None
    with open(path, "w", encoding="utf-8") as file:
        file.write("t,ax,ay,az,wx,wy,wz,force,validity\n")
        columns = recording.t, recording.acc, recording.gyr, recording.load, recording.validity
        for t, acc, gyr, load, validity in zip(*columns):
            numbers = [f"{t:.6f}", *map(str, acc), *map(str, gyr), repr(float(load))]
            cells = [*numbers, VALIDITIES[validity]]
            file.write(",".join(cells) + "\n")
