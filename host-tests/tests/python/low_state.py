"""Checks, with rosbags, the LowStates that `footfall replay --lowstate` has added to a copy of a bag. Each must equal
the robot's own message except for its forces.

usage: low_state.py copy.mcap [scale]

Without a scale, a consumer that compares the forces with a threshold must get the decisions in the copy. With a
scale, the forces must be the loads, which are the robot's own forces, times the scale.
Prints the number of states.
"""

import dataclasses
import functools
import math
import sys
from bisect import bisect_left
from pathlib import Path

import numpy
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

# The places of the feet in foot_force, and in the messages of champ.
FEET = {"fl": (1, 0), "fr": (0, 1), "rl": (3, 2), "rr": (2, 3)}
# A consumer's threshold: above the force of a foot in the air, and below the force of a standing foot.
THRESHOLD = 50


@functools.cache
def names_of(kind):
    """Names of the fields of a message class; None for any other class."""
    return [field.name for field in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else None


def equal(one, other, but=()):
    """Returns whether messages are equal in all fields except those in `but`."""
    if (names := names_of(type(one))) is not None:
        names = [name for name in names if name not in but]
        return all(equal(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, numpy.ndarray):
        return one.dtype == other.dtype and numpy.array_equal(one, other)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(equal, one, other))
    return one == other


def rounded(value):
    """To the nearest, halves away from zero."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


def main(copy, scale=None):
    store = get_typestore(Stores.ROS2_JAZZY)
    own, states, decisions, champs = {}, [], {foot: [] for foot in FEET}, []
    with AnyReader([Path(copy)], default_typestore=store) as reader:
        for connection, log_ns, data in reader.messages():
            topic = connection.topic
            if topic not in ("/lowstate", "/footfall/lowstate", "/foot_contacts") and not topic.endswith("/contact"):
                continue
            message = reader.deserialize(data, connection.msgtype)
            if topic == "/lowstate":
                own[log_ns] = message
            elif topic == "/footfall/lowstate":
                states.append((log_ns, message))
            elif topic == "/foot_contacts":
                champs.append(message)
            else:
                stands = message.valid and message.decision
                stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
                decisions[topic.split("/")[2]].append((log_ns, stamp, stands))
    assert len(states) == len(own) > 500, (len(states), len(own))
    logs = sorted(own)
    conclusions = {foot: set() for foot in FEET}
    next_contact = dict.fromkeys(FEET, 0)
    for log_ns, state in states:
        original = own[log_ns]
        assert equal(state, original, but=["foot_force"]), log_ns
        for foot, (place, _) in FEET.items():
            # A contact is written before every message that is at least a microsecond later than its sample.
            of_foot = decisions[foot]
            while next_contact[foot] < len(of_foot) and of_foot[next_contact[foot]][0] <= log_ns - 1000:
                next_contact[foot] += 1
            if next_contact[foot] == 0:
                assert state.foot_force[place] == 0, (foot, log_ns)
                continue
            sample_ns, _, stands = of_foot[next_contact[foot] - 1]
            if scale is None:
                assert state.foot_force[place] == 100 * stands, (foot, log_ns)
                concluded = bool(state.foot_force[place] > THRESHOLD)
                assert concluded == stands, (foot, log_ns)
                conclusions[foot].add(concluded)
            else:
                before = bisect_left(logs, sample_ns + 1000)
                load = float(own[logs[before - 1]].foot_force[place]) if before else 0.0
                expected = max(-32768, min(32767, rounded(float(scale) * load)))
                assert state.foot_force[place] == expected, (foot, log_ns, state.foot_force, load)
                conclusions[foot].add(expected)
    assert all(len(different) > 1 for different in conclusions.values()), conclusions
    by_stamp = {foot: {stamp: stands for _, stamp, stands in found} for foot, found in decisions.items()}
    assert scale is not None or len(champs) > 500, len(champs)
    for champ in champs:
        stamp = (champ.header.stamp.sec, champ.header.stamp.nanosec)
        for foot, (_, place) in FEET.items():
            assert champ.contacts[place] == by_stamp[foot].get(stamp, False), (foot, stamp)
    print(len(states))


main(*sys.argv[1:])
