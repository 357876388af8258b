"""Reads messages of all feet, as `footfall record --compat` writes them, with a third-party library. From each message
the script draws the conclusion of its consumer, and compares it with the decisions of the feet.

usage: compat.py rec.mcap

Prints the number of messages of each type.
"""

import math
import sys
from collections import Counter, defaultdict

from mcap.reader import make_reader
from mcap_ros2.reader import read_ros2_messages

FEET = ["FL", "FR", "RL", "RR"]
# enum Leg of DRIFT's kinematics, and foot_force of Unitree.
RIGHT_FIRST = ["FR", "FL", "RR", "RL"]


def by_foot(names, values):
    return dict(zip(names, values, strict=True))


def pronto(message):
    """legodo_handler_ros.cpp: any number beyond 0.01 is stance."""
    return by_foot(FEET, (abs(v) > 0.01 for v in (message.lf, message.rf, message.lh, message.rh)))


def muse(message):
    return by_foot(FEET, (message.stance_lf, message.stance_rf, message.stance_lh, message.stance_rh))


# By topic: the type, and the function that draws the consumer's conclusion.
CONSUMERS = {
    "/footfall/stance": ("pronto_msgs/msg/QuadrupedStance", pronto),
    "/foot_contacts": ("champ_msgs/msg/ContactsStamped", lambda m: by_foot(FEET, m.contacts)),
    "/footfall/drift/contacts": (
        "custom_sensor_msgs/msg/ContactArray",
        lambda m: by_foot(RIGHT_FIRST, (contact.indicator for contact in m.contacts)),
    ),
    "/footfall/contact_detection": ("state_estimator_msgs/msg/ContactDetection", muse),
    "/footfall/lowstate": ("unitree_go/msg/LowState", lambda m: by_foot(RIGHT_FIRST, (f > 60 for f in m.foot_force))),
}


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def check_covariances(imu):
    """Checks that a state estimator accepts the covariances: finite, and positive where something is known."""
    tilt, _, _, _, other_tilt, _, _, _, heading = imu.orientation_covariance
    assert 0 < tilt == other_tilt < math.radians(5) ** 2 < 100 < heading, imu.orientation_covariance
    for covariance, most in ((imu.angular_velocity_covariance, 0.01), (imu.linear_acceleration_covariance, 0.1)):
        diagonal = covariance[0], covariance[4], covariance[8]
        assert all(0 < value < most**2 for value in diagonal), covariance


def check_frame(message):
    """Checks the prefix in the header of a message of one foot, if the message has a header."""
    topic = message.channel.topic
    foot = topic.split("/")[2]
    if hasattr(message.ros_msg, "header") and foot in FEET:
        assert message.ros_msg.header.frame_id == f"spot/footfall_{foot}", topic


def main(path):
    with open(path, "rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    # These topics have no consumer here. Half a second of them is enough.
    unused = {topic for topic in topics if topic.endswith(("/velocity", "/probability", "/load"))}
    end_ns = summary.statistics.message_start_time + 500_000_000
    seen = set()
    for message in read_ros2_messages(path, topics=unused, end_time=end_ns):
        check_frame(message)
        seen.add(message.channel.topic)
    assert len(seen) >= 2 * len(FEET), seen
    counts, newest, said = Counter(), {}, defaultdict(list)
    bools, forces = {}, {}
    for message in read_ros2_messages(path, topics=topics - unused):
        topic, ros, kind = message.channel.topic, message.ros_msg, message.schema.name
        foot = topic.split("/")[2] if topic.startswith("/footfall/") else ""
        if topic.startswith("/footfall/"):
            check_frame(message)
        if topic.endswith("/contact") and foot in FEET:
            newest[foot] = ros.valid and ros.decision
            said[foot].append((message.log_time_ns, newest[foot]))
        elif topic.endswith("/decision"):
            bools[foot] = ros.data
            counts[kind] += 1
            if len(bools) == len(FEET):
                check(bools, newest, topic)
                bools = {}
        elif topic.endswith("/wrench"):
            force, torque = ros.wrench.force, ros.wrench.torque
            assert (force.x, force.y, torque.x, torque.y, torque.z) == (0, 0, 0, 0, 0), ros
            assert force.z in (0, 40), ros
            forces[foot] = force.z > 20
            counts[kind] += 1
            if len(forces) == len(FEET):
                check(forces, newest, topic)
                forces = {}
        elif topic.endswith("/imu"):
            check_covariances(ros)
        elif topic in CONSUMERS:
            expected, conclude = CONSUMERS[topic]
            assert kind == expected, (topic, kind)
            check(conclude(ros), newest, topic)
            counts[kind] += 1
    stands = [value for of_foot in said.values() for _, value in of_foot]
    assert 0.2 < sum(stands) / len(stands) < 0.8
    expected = {kind for kind, _ in CONSUMERS.values()} | {"geometry_msgs/msg/WrenchStamped"}
    assert expected <= set(counts), counts
    assert min(counts.values()) > 2500, counts
    print(sorted(counts.items()))


def check(conclusion, newest, topic):
    """Checks that each message has the newest decision of each foot, because all feet stream."""
    assert conclusion == {foot: bool(value) for foot, value in newest.items()}, (topic, conclusion, newest)


main(*sys.argv[1:])
