"""Contents of results, and arguments that are refused."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import footfall


def standing(
    samples: int = 2000,
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    acc = np.tile(np.array([0.0, 0.0, 9.81], dtype=np.float32), (samples, 1))
    return acc, np.zeros_like(acc)


def test_a_standing_foot_is_stable_and_plausible() -> None:
    result = footfall.estimate(*standing(), rate=1000.0)
    assert result.p_stable[-1] > 0.9
    assert result.decision[-1]
    assert result.rate == 1000.0
    assert result.findings == ()
    assert set(result.state_names()) == {"unknown"}
    assert "2000 samples at 1000 Hz" in repr(result)


def test_wrong_units_are_a_finding() -> None:
    acc, gyr = standing()
    [finding] = footfall.estimate(acc / 9.81, gyr, rate=1000.0).findings
    assert finding.name == "acceleration_in_g"
    assert finding.message.endswith("which looks like g: acc * 9.80665 is in m/s²")


def test_structured_and_arrow_have_the_programs_columns(walk: footfall.Recording) -> None:
    result = walk.estimate()
    structured = result.to_structured()
    assert np.array_equal(structured["p_wy"], result.p_axes[:, 4])
    pytest.importorskip("pyarrow")
    table = result.to_arrow()
    assert table.column_names == list(structured.dtype.names or ())
    assert table.num_rows == len(structured) == len(walk)
    assert np.array_equal(table["qz"].to_numpy(), result.quaternion[:, 3])
    assert table["state"].to_pylist() == list(result.state_names())


def test_a_simulated_foot_has_its_true_motion() -> None:
    walk = footfall.simulate("walk", 10.0, seed=2)
    assert walk.position.shape == walk.velocity.shape == (len(walk), 3)
    moved = np.diff(walk.position, axis=0) / np.diff(walk.t)[:, None]
    mean = 0.5 * (walk.velocity[1:] + walk.velocity[:-1])
    # A touch-down stops the foot within a sample.
    assert np.median(np.abs(moved - mean)) < 1e-4
    stable = walk.label == 1
    assert np.linalg.norm(walk.velocity[stable], axis=1).max() < 5e-3


def test_joints_of_a_robot_give_the_feet_their_true_motion() -> None:
    robot = footfall.simulate_robot("trot", 8.0, seed=3, greased=0.3)
    base = robot.base
    w, u = base.quaternion[:, :1], base.quaternion[:, 1:]
    assert list(robot.legs) == ["FL", "FR", "RL", "RR"]
    for leg in robot.legs.values():
        in_base = leg.geometry.foot_position(leg.angles)
        t = 2.0 * np.cross(u, in_base)
        position = base.position + in_base + w * t + np.cross(u, t)
        for axis in range(3):
            true = np.interp(base.t, leg.foot.t, leg.foot.position[:, axis])
            assert np.abs(position[:, axis] - true).max() < 1e-4
        step = 1e-6
        moved = leg.geometry.foot_position(leg.angles + step * leg.rates) - in_base
        rates = np.einsum("nij,nj->ni", leg.geometry.jacobian(leg.angles), leg.rates)
        np.testing.assert_allclose(moved / step, rates, atol=1e-4)
    assert base.position[-1, 0] > 0.5
    with pytest.raises(ValueError, match="gait"):
        footfall.simulate_robot("demo")


def test_simulation_is_printed_in_one_line() -> None:
    walk = footfall.simulate("walk", 1.0)
    assert repr(walk) == f"<footfall.Simulation {walk.name!r}: {len(walk)} samples at 1000 Hz>"


def test_nine_of_ten_simulated_slips_are_events() -> None:
    slippery = footfall.simulate("trot", 60.0, seed=1, greased=0.1)
    assert len(slippery.touch_downs) > 100 and slippery.slips.shape == (10, 2)
    begins, ends = slippery.slips.T
    starts = np.array([event.t for event in slippery.estimate().events() if event.kind == "slip_start"])
    for start in starts:
        assert np.any((begins < start) & (start < ends + 0.05)), start
    assert len(starts) <= 10
    found = [np.abs(starts - begin).min() < 0.05 for begin in begins]
    assert sum(found) >= 9


def test_the_demo_slips_on_its_greased_patch() -> None:
    demo = footfall.simulate("demo", seconds=3.0)
    assert len(demo) == 14_010
    assert demo.slips.shape == (4, 2) and 5.0 < demo.slips.min() < demo.slips.max() < 7.5


def test_a_robot_that_rests_shows_the_drift_of_its_gyroscope() -> None:
    sound = footfall.simulate("walk", 20.0, rests=(5.0, 4.0))
    drifting = footfall.simulate("walk", 20.0, rests=(5.0, 4.0), gyro_drift=(5e-4, 0.0, -2e-4))
    biases = [walk.estimate().gyro_bias for walk in (sound, drifting)]
    change = [bias[-1] - bias[1900] for bias in biases]
    assert np.abs(change[0]).max() < 3e-4
    assert change[1][0] > 1.5e-3 and change[1][2] < -0.6e-3


def test_a_warm_start_begins_settled(walk: footfall.Recording) -> None:
    calibration = footfall.calibrate(walk)
    assert calibration.report["settled"] is True
    assert walk.estimate().has_flag("settling").any()
    assert not walk.estimate(config=calibration.config).has_flag("settling").any()


def test_a_file_is_read_with_its_load_labels_and_notices(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    rows = "".join(f"{k / 100:.2f},0,0,1,0,0,0,{k},1,x\n" for k in range(100))
    path.write_text("t,ax,ay,az,wx,wy,wz,force,label,note\n" + rows)
    [recording] = footfall.read(path, units="g,dps")
    assert (recording.rate, recording.gravity, recording.format) == (100.0, "included", "csv")
    assert recording.load is not None and recording.label is not None
    assert np.array_equal(recording.load, np.arange(100.0))
    assert (recording.label == 1).all()
    assert np.allclose(recording.acc[:, 2], 9.80665)
    assert any("note" in notice for notice in recording.notices)
    assert "100 samples at 100 Hz" in repr(recording)


def test_threads_estimate_several_feet_at_once(walk: footfall.Recording) -> None:
    expected = walk.estimate().p_stable
    results: list[footfall.Result] = []
    work = [threading.Thread(target=lambda: results.append(walk.estimate())) for _ in range(4)]
    for thread in work:
        thread.start()
    for thread in work:
        thread.join()
    assert all(np.array_equal(result.p_stable, expected) for result in results)
    assert len(results) == 4


ACC, GYR = standing(10)
FOOT = footfall.Estimator(rate=100.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: footfall.estimate(ACC, GYR), "give the times t in s, or the sample rate"),
        (lambda: footfall.estimate(ACC, GYR[:5], rate=100.0), "gyr has 5 samples, but acc has 10"),
        (lambda: footfall.estimate(ACC[:0], GYR[:0], rate=100.0), "acc is empty"),
        (lambda: footfall.estimate(ACC[:, :2], GYR, rate=100.0), r"acc has the shape \[10, 2\]"),
        (lambda: footfall.estimate(ACC, GYR, np.zeros(10)), r"t\[1\] is 0 s, which does not come"),
        (lambda: footfall.estimate(ACC, GYR, np.full(10, np.nan)), r"t\[0\] is NaN"),
        (lambda: footfall.estimate(ACC, GYR, np.arange(9)), "t has 9 values, but acc has 10"),
        (lambda: footfall.estimate(ACC, GYR, rate=1.0), "rate= is 1 Hz, allowed is 20 to 10000 Hz"),
        (lambda: footfall.estimate(ACC, GYR, rate=-5.0), "rate is -5"),
        (
            lambda: footfall.estimate(ACC, GYR, np.arange(10) / 100, rate=200.0),
            "column t gives 100.00 Hz, but the given sample rate is 200 Hz",
        ),
        (lambda: footfall.estimate(ACC, GYR, rate=100.0, preset="best"), '"default" or "paper"'),  # type: ignore[arg-type]
        (lambda: footfall.estimate(ACC, GYR, rate=100.0, gravity="no"), '"included" or "removed"'),  # type: ignore[arg-type]
        (lambda: footfall.estimate(ACC, GYR, rate=100.0, config={"decision": {"on": 1}}), "on"),
        (lambda: footfall.estimate(ACC, GYR, rate=100.0, config={"x": None}), "config"),
        (lambda: footfall.simulate("hop"), "hop"),
        (lambda: footfall.simulate("walk", ground="ice"), "hard, greased, soft"),
        (lambda: footfall.simulate("walk", float("inf")), "seconds is inf"),
        (lambda: footfall.simulate(greased=1.5), "greased is 1.5, but 0 to 1 is expected"),
        (lambda: footfall.simulate(rests=(0.0, 1.0)), r"rests\[0\] is 0, but 0.1"),
        (lambda: footfall.simulate(gyro_drift=(0.0, 0.0, 2.0)), "gyro_drift is 2"),
        (lambda: footfall.estimate(ACC, GYR, rate=100.0, axes="x,x,y"), "axes"),
        (lambda: footfall.read(__file__, load_topic=":x"), "load_topic"),
        (lambda: footfall.estimate_file(__file__), "test_results.py"),
        (lambda: footfall.calibrate([]), "nothing to learn from"),
        (lambda: footfall.Estimator(rate=0.0), "rate is 0"),
        (lambda: FOOT.update((0.0, 0.0), (0.0, 0.0, 0.0)), "acc has 2 values, but 3 are expected"),
        (lambda: FOOT.update((0.0,) * 3, (0.0,) * 4), "gyr has 4 values, but 3 are expected"),
        (lambda: FOOT.update((0.0,) * 3, (0.0,) * 3, validity=77), "validity is 77, but one of"),
        (lambda: FOOT.update((0.0,) * 3, (0.0,) * 3, validity="old"), "validity is 'old'"),
        (lambda: footfall.estimate(ACC, GYR, rate=100.0, validity=[77] * len(ACC)), "is 77, but 0 to 5"),
        (lambda: footfall.read(__file__), "test_results.py"),
    ],
)
def test_value_out_of_range_is_named_with_its_range(call, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("name", ["acc", "gyr", "t", "load"])
def test_array_of_texts_is_refused_by_its_name(name: str) -> None:
    arrays: dict[str, object] = {"acc": ACC, "gyr": GYR, "t": np.arange(len(ACC)) / 100.0, "load": None}
    arrays[name] = [["a", "b", "c"]]
    with pytest.raises(TypeError, match=f"^{name} is not an array of numbers$"):
        footfall.estimate(**arrays)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [256, -1, 6, 1.5, np.nan])
def test_validity_is_checked_before_it_is_stored_in_8_bits(value: float) -> None:
    validity = np.zeros(len(ACC)) + 1
    validity[3] = value
    with pytest.raises(ValueError, match=r"^validity\[3\] is .*, but 0 to 5 are expected: valid, "):
        footfall.estimate(ACC, GYR, rate=100.0, validity=validity)
    with pytest.raises(TypeError, match="^validity is an array of <U5, but numbers are expected$"):
        footfall.estimate(ACC, GYR, rate=100.0, validity=["valid"] * len(ACC))


def test_validity_of_any_number_type_gives_the_same(walk: footfall.Recording) -> None:
    places = np.arange(len(walk)) % 6
    expected = footfall.estimate(walk.acc, walk.gyr, rate=1000.0, validity=places.astype(np.uint8))
    for other in (places, places.astype(np.float64), places.tolist()):
        found = footfall.estimate(walk.acc, walk.gyr, rate=1000.0, validity=other)
        assert np.array_equal(found.p_stable, expected.p_stable)


def test_missing_file_is_named() -> None:
    with pytest.raises(FileNotFoundError, match="nowhere.csv"):
        footfall.read("nowhere.csv")
    with pytest.raises(FileNotFoundError, match="nowhere.csv"):
        footfall.estimate_file("nowhere.csv")


def test_a_time_that_does_not_advance_is_refused_and_the_stream_goes_on() -> None:
    foot = footfall.Estimator(rate=1000.0)
    sample = ((0.0, 0.0, 9.81), (0.0, 0.0, 0.0))
    foot.update(*sample, t=5.0)
    with pytest.raises(ValueError, match="does not come after 5 s"):
        foot.update(*sample, t=5.0)
    assert foot.update(*sample, t=5.001).t == 5.001
    assert foot.update(*sample).t == 5.002


def test_sample_without_a_time_is_one_period_after_the_last() -> None:
    foot = footfall.Estimator(rate=1000.0)
    sample = ((0.0, 0.0, 9.81), (0.0, 0.0, 0.0))
    times = [None, None, 10.0, None, None, 10.5, None]
    found = [foot.update(*sample, t=t).t for t in times]
    assert found == [0.0, 0.001, 10.0, 10.001, 10.002, 10.5, 10.501]


def test_samples_of_one_read_get_times_of_their_own() -> None:
    foot = footfall.Estimator(rate=1000.0)
    sample = ((0.0, 0.0, 9.81), (0.0, 0.0, 0.0))
    assert foot.batch_times(100.0, 0) == ()
    first = foot.batch_times(100.0, 4)
    assert first == (99.997, 99.998, 99.999, 100.0)
    for t in first:
        foot.update(*sample, t=t)
    # The second read is late, as with a slow clock of the sensor. Its times are even after the previous read.
    second = foot.batch_times(100.0044, 4)
    assert second == pytest.approx((100.0011, 100.0022, 100.0033, 100.0044))
    flags = [foot.update(*sample, t=t).flags for t in second]
    assert not any({"time_gap", "invalid_sample"} & set(found) for found in flags)
    # Samples are missing before these.
    assert foot.batch_times(101.0, 2) == (100.999, 101.0)
    with pytest.raises(ValueError, match="count is -1"):
        foot.batch_times(101.0, -1)


def test_stream_in_other_units_has_the_bits_of_si_units(walk: footfall.Recording) -> None:
    si, other = footfall.Estimator(rate=1000.0), footfall.Estimator(rate=1000.0, units="mg,dps")
    g, degree = 9.80665, np.radians(1.0)
    for k in range(3000):
        mg, dps = walk.acc[k] / g * 1000.0, walk.gyr[k] / degree
        expected = si.update(np.float32(mg / 1000.0 * g), np.float32(dps * degree))
        assert other.update(mg, dps).p_stable == pytest.approx(expected.p_stable, abs=1e-3)
    with pytest.raises(ValueError, match="units: "):
        footfall.Estimator(rate=1000.0, units="stone,rpm")


def test_stream_with_axes_has_the_bits_of_turned_samples(walk: footfall.Recording) -> None:
    straight = footfall.Estimator(rate=1000.0)
    # The sensor's y is along the foot's x, and its -x along the foot's y.
    turned = footfall.Estimator(rate=1000.0, axes="y,-x,z")
    for acc, gyr in zip(walk.acc[:3000], walk.gyr[:3000], strict=True):
        expected = straight.update(acc, gyr)
        found = turned.update((-acc[1], acc[0], acc[2]), (-gyr[1], gyr[0], gyr[2]))
        assert found == expected
    with pytest.raises(ValueError, match="axes"):
        footfall.Estimator(rate=1000.0, axes="x,y")


def test_stream_in_g_without_a_unit_warns_once() -> None:
    foot = footfall.Estimator(rate=100.0)
    with pytest.warns(RuntimeWarning, match="acc is 1 m/s² on average.*units=") as warnings:
        for _ in range(300):
            foot.update((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    assert len(warnings) == 1
    with pytest.raises(ValueError, match="which no foot has"):
        foot.check_unit()
    right = footfall.Estimator(rate=100.0, units="g,dps")
    for _ in range(300):
        right.update((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    right.check_unit()


@pytest.mark.parametrize("gait, shortest", [("walk", 2.701), ("trot", 2.08), ("run", 2.1)])
def test_a_robot_does_not_walk_shorter_than_its_gait_allows(gait: str, shortest: float) -> None:
    message = rf"^rests\[0\] is 1, but at least {shortest} is expected of a robot in the gait {gait}$"
    with pytest.raises(ValueError, match=message):
        footfall.simulate_robot(gait, 20.0, rests=(1.0, 2.5))
    robot = footfall.simulate_robot(gait, 8.0, rests=(shortest, 0.0))
    assert robot.base.position[-1, 0] > 0.1


@pytest.mark.parametrize("name, ends", [
    ("greased", (0.0, 1.0)),
    ("step_length", (0.1, 3.0)),
    ("shaking", (0.0, 10.0)),
    ("rests", ((0.1, 0.0), (3.0, 0.0))),
    ("warming", (0.0, 60.0)),
    ("gyro_drift", ((-1.0,) * 3, (1.0,) * 3)),
])
def test_simulation_is_finite_at_both_ends_of_a_range(name: str, ends: tuple[object, object]) -> None:
    for end in ends:
        walk = footfall.simulate("walk", 6.0, **{name: end})  # type: ignore[arg-type]
        for array in (walk.acc, walk.gyr, walk.position, walk.velocity):
            assert np.isfinite(array).all(), (name, end)
