"""The demo's CAN log as python-can reads it and cantools decodes it, against the demo's samples.

usage: demo.py footfall.dbc can.log samples.csv
"""

import csv
import math
import sys

import can
import cantools

EPOCH = 1609459200

# Signal, column, and half a step of the signal: what rounding may do.
P16 = 0.5 / 65535
P8 = 0.5 / 255
COMPARED = {
    "FL_Contact": [
        ("StableContactProbability", "p_stable", P16),
        ("TangentialProbability", "p_tangential", P8),
        ("VerticalProbability", "p_vertical", P8),
    ],
    "FL_Axes": [
        ("Probability" + axis.capitalize(), "p_" + axis, P8)
        for axis in ("ax", "ay", "az", "wx", "wy", "wz")
    ],
    "FL_Attitude": [("Quaternion" + q.upper(), "q" + q, 0.5 / 32767) for q in "wxyz"],
    "FL_Acceleration": [("Acceleration" + x.upper(), "la" + x, 0.005) for x in "xyz"],
    "FL_Rate": [],
    "FL_Bias": [("Bias" + x.upper(), "bw" + x, 0.5e-5) for x in "xyz"],
    "FL_Health": [],
}
FLAGS = {
    "WindowNotFull": "window_not_full",
    "AttitudeNotInitialised": "attitude_not_initialised",
    "SampleSaturated": "saturated",
    "Stale": "stale",
    "InvalidSample": "invalid_sample",
    "TimeGap": "time_gap",
    "Settling": "settling",
    "Unproven": "unproven",
}


# While one of these is raised, motion has no value.
MOTION = {"FL_Attitude", "FL_Acceleration", "FL_Rate", "FL_Bias"}
UNKNOWN = {"attitude_not_initialised", "stale", "invalid_sample"}


def close(value, expected, half_step):
    """To rounding, and to what f32 makes of a product with the step."""
    return abs(value - expected) <= half_step + 1e-6 * max(1.0, abs(expected))


def check_contact(signals, states, row, index):
    flags = row["flags"].split("|") if row["flags"] else []
    doubt = [flag for flag in flags if flag not in {"time_gap", "settling"}]
    ticks = math.floor(float(row["t"]) * 1e5 + 1e-3) % 65536
    assert round(signals["Timestamp"] * 100) == ticks, (index, signals, row["t"])
    assert signals["Sequence"] == index % 256
    assert bool(signals["Valid"]) == (not doubt)
    stable = row["decision"] == "1"
    assert bool(signals["Decision"]) == (stable and not doubt), (index, signals, row)
    assert bool(signals["Saturated"]) == ("saturated" in flags)
    assert not signals["Fault"]
    if not doubt:
        assert str(states[signals["State"]]) == row["state"], (index, signals, row)


def check_rate(signals, row, index):
    """What the gyroscope read, less its bias."""
    for axis in "xyz":
        value = signals["Rate" + axis.upper()]
        expected = float(row["w" + axis]) - float(row["bw" + axis])
        assert close(value, expected, 0.5 * 0.00125), (index, axis, value, expected)


def main(dbc, log, samples):
    database = cantools.database.load_file(dbc, strict=True)
    with open(samples, newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    states = database.get_message_by_name("FL_Contact").get_signal_by_name("State").choices
    counts = {}
    index = -1
    values = 0
    previous = 0.0
    for frame in can.LogReader(log):
        assert frame.channel == "can0" and not frame.is_extended_id
        assert frame.timestamp > previous, "the log runs backwards"
        previous = frame.timestamp
        message = database.get_message_by_frame_id(frame.arbitration_id)
        signals = message.decode(bytes(frame.data), decode_choices=False)
        counts[message.name] = counts.get(message.name, 0) + 1
        if message.name not in COMPARED:
            continue
        index += message.name == "FL_Contact"
        row = rows[index]
        late = frame.timestamp - EPOCH - float(row["t"])
        assert 0 <= late < 0.002, (index, late)
        if message.name == "FL_Rate" and "attitude_not_initialised" not in row["flags"]:
            check_rate(signals, row, index)
            values += 3
        for signal, column, half_step in COMPARED[message.name]:
            value, expected = signals[signal], float(row[column])
            if message.name in MOTION and UNKNOWN & set(row["flags"].split("|")):
                described = message.get_signal_by_name(signal)
                assert value == -32768 * described.scale, (index, signal, value)
                continue
            assert close(value, expected, half_step), (index, signal, value, expected)
            values += 1
        if message.name == "FL_Contact":
            check_contact(signals, states, row, index)
        if message.name == "FL_Health":
            raised = {name for signal, name in FLAGS.items() if signals[signal]}
            assert raised == set(filter(None, row["flags"].split("|"))), (index, raised)
    assert index + 1 == len(rows) > 10_000, (index, len(rows))
    missing = set(COMPARED) - set(counts)
    assert not missing, missing
    print(f"{values} values of {len(rows)} samples agree")


if __name__ == "__main__":
    main(*sys.argv[1:])
