"""Reads the phases of a biped, as `footfall record --compat biped` writes them, with a third-party library, and
compares them with the decisions of both feet.

usage: biped.py rec.mcap

Prints the number of messages.
"""

import sys
from collections import Counter

from mcap_ros2.reader import read_ros2_messages

LEFT_STANCE, RIGHT_STANCE, DOUBLE_STANCE = 0, 1, 2
PHASES = {(True, False): LEFT_STANCE, (False, True): RIGHT_STANCE, (True, True): DOUBLE_STANCE}


def main(path):
    stands, counts = {}, Counter()
    for message in read_ros2_messages(path):
        topic, ros = message.channel.topic, message.ros_msg
        if topic.endswith("/contact"):
            stands[topic.split("/")[2]] = ros.valid and ros.decision
        elif topic == "/footfall/phase":
            assert message.schema.name == "biped_interfaces/msg/Phase", message.schema.name
            assert ros.phase == PHASES[stands["L"], stands["R"]], (ros, stands)
            counts[ros.phase] += 1
    assert min(counts[phase] for phase in PHASES.values()) > 100, counts
    print(sum(counts.values()))


main(*sys.argv[1:])
