"""Subscribes with CycloneDDS to the messages of `footfall ros2`.

Usage:
    ros2.py all WHOSE RELIABILITY FOOTFALL REC.mcap ROS2-ARGUMENT...
        compares every message with a recording of the same feet by `footfall record`. The interface package is read
        by third-party parsers
    ros2.py now FOOTFALL ROS2-ARGUMENT...
        compares the stamps of a foot FL with the clock of this machine
    ros2.py namesake FOOTFALL ROS2-ARGUMENT...
        expects one warning about another node of the same name, and none beside a node of another name
    ros2.py slow FOOTFALL ROS2-ARGUMENT...
        stops a reliable subscriber of a foot FL, and expects a warning about messages that were not sent
    ros2.py hold DOMAIN
        subscribes to the contacts of a foot FL, and prints a line when it has received one
"""

import faulthandler
import functools
import re
import signal
import subprocess
import sys
import time
from bisect import bisect_left, bisect_right
from collections import defaultdict
from pathlib import Path

from catkin_pkg.package import parse_package
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from mcap_ros2.reader import read_ros2_messages
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from dds_types import (
    Contact,
    ContactsStamped,
    DiagnosticArray,
    Float64,
    Imu,
    NodeEntitiesInfo,
    Gid,
    ParticipantEntitiesInfo,
    QuadrupedStance,
    TwistWithCovarianceStamped,
)

PACKAGE = Path(__file__).parents[4] / "ros2/footfall_msgs"
FEET = ["FL", "FR", "RL", "RR"]
# The feet walk three seconds longer than each topic is read, because subscribers need time to find the topic.
CONTACTS = 4000
# Time after which the script counts as hung, s. It then ends, and prints the line at which it hangs.
HANGS_S = 600.0

# Number of runs. At least one of them must not stall.
ATTEMPTS = 5

# Longest lead of a stamp over the clock, ns.
EARLY_NS = 10_000_000

# Largest number of decisions, of some 20 000 in messages of all feet, that may be "swing" because the machine
# stalled.
SILENT = 100
LEAST = {
    "contact": CONTACTS,
    "contact/probability": CONTACTS,
    "velocity": CONTACTS,
    "imu": 180,
    "load": 180,
}


WHOSE = {
    "champ": ("/foot_contacts", ContactsStamped, lambda m: [float(c) for c in m.contacts]),
    "pronto": ("/footfall/stance", QuadrupedStance, lambda m: [m.lf, m.rf, m.lh, m.rh]),
}


@functools.cache
def fields_of(kind):
    """Names of the fields of a message class of any library."""
    return getattr(kind, "__slots__", None) or list(kind.__annotations__)


def number(value):
    return "nan" if value != value else float(value)


def plain(value):
    """A message of any library as nested tuples; NaNs are equal."""
    kind = type(value)
    if kind in (str, bool):
        return value
    if kind in (int, float):
        return number(value)
    if kind in (list, tuple) or kind.__name__ in ("ndarray", "array"):
        # The sequence contains only numbers, like a covariance.
        if set(map(type, value)) == {float}:
            return tuple(map(number, value))
        return tuple(plain(item) for item in value)
    if isinstance(value, bytes):
        [value] = value
        return number(value)
    if isinstance(value, (str, bool)):
        return value
    if isinstance(value, (int, float)):
        return number(value)
    return tuple(plain(getattr(value, field)) for field in fields_of(kind))


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def check_package():
    package = parse_package(str(PACKAGE))
    assert package.name == "footfall_msgs", package.name
    assert package.get_build_type() == "ament_cmake"
    assert [group.name for group in package.member_of_groups] == ["rosidl_interface_packages"]
    lists = (PACKAGE / "CMakeLists.txt").read_text()
    store = get_typestore(Stores.ROS2_HUMBLE)
    for path in sorted(PACKAGE.glob("msg/*.msg")):
        types = get_types_from_msg(path.read_text(), f"footfall_msgs/msg/{path.stem}")
        store.register(types)
        assert f'"msg/{path.name}"' in lists, path
    names = [name for name, _ in store.get_msgdef("footfall_msgs/msg/Contact").fields]
    assert names == list(Contact.__annotations__), names


def recorded(path):
    """Messages of a recording, by topic."""
    messages = defaultdict(list)
    # The messages of each topic come in the order of the file.
    for message in read_ros2_messages(path, log_time_order=False):
        messages[message.channel.topic].append(message.ros_msg)
    return messages


class Stalled(Exception):
    """The machine was too busy for the subscribers, so the messages were not tested."""


def compare(topic, received, published, least):
    """Compares the last `least` messages value for value, without a gap. Earlier messages came while the subscriber
    was being found, and DDS guarantees only their order."""
    if len(received) < least:
        raise Stalled(f"{topic}: {len(received)} messages, not {least}")
    pairs = zip(received[-least:], published[-least:])
    for index, (one, other) in enumerate(pairs, start=len(received) - least):
        if plain(one) == plain(other):
            continue
        # A writer keeps few messages for a subscriber that is late.
        if plain(one) in map(plain, published):
            raise Stalled(f"{topic}: a gap before message {index}")
        raise AssertionError(f"{topic}, message {index}:\n{one}\n{other}")
    earlier = map(plain, published[:-least])
    for index, one in enumerate(received[:-least]):
        assert plain(one) in earlier, f"{topic}, message {index} is not of these feet, or late:\n{one}"


def last_of(received, topic):
    return [received[f"/footfall/{foot}/{topic}"][-1] for foot in FEET]


def take_last_words(received, other_topic, other_values):
    """Removes the messages of the end, in which all feet are silent and no foot stands."""
    if any(message.data != 0.0 for message in last_of(received, "contact/probability")):
        raise Stalled("the last words have not come")
    for foot in FEET:
        received[f"/footfall/{foot}/contact/probability"].pop()
    silent = [received["/diagnostics"].pop().status[0] for _ in FEET]
    if any(not status.message.startswith("silent") for status in silent):
        raise Stalled("the last words have not come")
    assert {status.name for status in silent} == {f"footfall: {foot}" for foot in FEET}, silent
    assert all(status.level == 3 for status in silent), silent
    assert other_values(received[other_topic].pop()) == [0.0] * len(FEET)


def participant_of(arguments):
    """Returns a participant of the domain that the arguments of `footfall ros2` name."""
    return DomainParticipant(int(arguments[arguments.index("--domain-id") + 1]))


def topic_of_nodes(participant):
    return Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo)


# Quality of service of messages about nodes.
ABOUT_NODES = Qos(Policy.Reliability.Reliable(0), Policy.Durability.TransientLocal)


def ended(program):
    """Ends a program by the signal that a service manager sends."""
    program.terminate()
    _, errors = program.communicate()
    assert program.returncode == 0, (program.returncode, errors)
    return errors


def check_now(footfall, *arguments):
    """The stamps of contacts are between the start of the program and their reception."""
    participant = participant_of(arguments)
    qos = Qos(Policy.Reliability.Reliable(0), Policy.Durability.Volatile, Policy.History.KeepAll)
    reader = DataReader(participant, Topic(participant, "rt/footfall/FL/contact", Contact), qos=qos)
    begun = time.time_ns()
    program = subprocess.Popen([footfall, "ros2", *arguments])
    count = 0
    while count < 1000:
        time.sleep(0.01)
        contacts = [sample for sample in reader.take(10_000) if isinstance(sample, Contact)]
        now = time.time_ns()
        for contact in contacts:
            stamp = nanoseconds(contact.header.stamp)
            # A contact is due at the end of its millisecond.
            assert begun <= stamp <= now + EARLY_NS, (stamp - begun, now - stamp)
        count += len(contacts)
    ended(program)


def check_namesake(footfall, *arguments):
    """Another participant announces a node /footfall, as any node of ROS with this name does, and publishes FL.

    A node with another name in the same namespace also publishes FL. A node in another namespace does not.
    """
    participant = participant_of(arguments)
    nodes = DataWriter(participant, topic_of_nodes(participant), qos=ABOUT_NODES)
    # Keep the object, because the publisher exists only as long as it does.
    _publisher = DataWriter(participant, Topic(participant, "rt/footfall/FL/contact", Contact))
    named = NodeEntitiesInfo(node_namespace="/", node_name="footfall", reader_gid_seq=[], writer_gid_seq=[])
    gid = Gid(data=[7] * 16)
    programs = [
        subprocess.Popen([footfall, "ros2", *arguments, *name], stderr=subprocess.PIPE, text=True)
        for name in ([], ["--node-name", "other"], ["--namespace", "dog"])
    ]
    while len(nodes.get_matched_subscriptions()) < len(programs):
        time.sleep(0.1)
    nodes.write(ParticipantEntitiesInfo(gid=gid, node_entities_info_seq=[named]))
    first, second = [programs[0].stderr.readline() for _ in range(2)], [programs[1].stderr.readline()]
    namesakes = [warning for warning in first if "is named /footfall, too" in warning]
    rivals = [warning for warning in first + second if "publishes /footfall/FL/" in warning]
    assert (len(namesakes), len(rivals)) == (1, 2), (first, second)
    # All have received it.
    assert nodes.wait_for_acks(duration(seconds=HANGS_S))
    errors = [ended(program) for program in programs]
    assert errors == ["", "", ""], errors


def hold(domain):
    """A reliable subscriber, which another process stops."""
    participant = DomainParticipant(int(domain))
    qos = Qos(Policy.Reliability.Reliable(0), Policy.Durability.Volatile, Policy.History.KeepAll)
    reader = DataReader(participant, Topic(participant, "rt/footfall/FL/contact", Contact), qos=qos)
    while not any(isinstance(sample, Contact) for sample in reader.take(100)):
        time.sleep(0.01)
    print("received", flush=True)
    while True:
        time.sleep(1.0)


def check_slow(footfall, *arguments):
    """A reliable subscriber that has stopped acknowledges nothing. Messages that no longer fit are counted by topic."""
    domain = arguments[arguments.index("--domain-id") + 1]
    expected = r"/footfall/FL/contact: \d+ messages were not sent: a reliable subscriber did not keep up"
    # A busy machine takes longer to publish as many messages as are kept for a subscriber.
    for seconds in (4.0, 8.0, 16.0, 32.0):
        subscriber = subprocess.Popen([sys.executable, __file__, "hold", domain], stdout=subprocess.PIPE, text=True)
        program = subprocess.Popen([footfall, "ros2", *arguments], stderr=subprocess.PIPE, text=True)
        try:
            assert subscriber.stdout.readline() == "received\n"
            subscriber.send_signal(signal.SIGSTOP)
            time.sleep(seconds)
            errors = ended(program)
        finally:
            subscriber.kill()
            subscriber.wait()
        if re.search(expected, errors):
            return
    raise AssertionError(errors)


def check_all(*arguments):
    check_package()
    published = recorded(arguments[3])
    for attempt in range(1, ATTEMPTS + 1):
        try:
            return check_messages(published, *arguments)
        except Stalled:
            if attempt == ATTEMPTS:
                raise


def check_messages(published, whose, reliability, footfall, _, *arguments):
    reliable = reliability == "reliable"
    policy = Policy.Reliability.Reliable(0) if reliable else Policy.Reliability.BestEffort
    qos = Qos(policy, Policy.Durability.Volatile, Policy.History.KeepAll)
    participant = participant_of(arguments)
    other_topic, other_type, other_values = WHOSE[whose]
    types = {other_topic: other_type, "/diagnostics": DiagnosticArray}
    for foot in FEET:
        types[f"/footfall/{foot}/contact"] = Contact
        types[f"/footfall/{foot}/contact/probability"] = Float64
        types[f"/footfall/{foot}/velocity"] = TwistWithCovarianceStamped
        types[f"/footfall/{foot}/load"] = Float64
        types[f"/footfall/{foot}/imu"] = Imu
    readers = {}
    for topic, kind in types.items():
        readers[topic] = DataReader(participant, Topic(participant, f"rt{topic}", kind), qos=qos)
    nodes = DataReader(participant, topic_of_nodes(participant), qos=ABOUT_NODES)

    program = subprocess.Popen([footfall, "ros2", *arguments], stderr=subprocess.PIPE, text=True)
    info = None
    while program.poll() is None:
        time.sleep(0.2)
        for sample in nodes.take(100):
            # The last message reports that the node has gone.
            if isinstance(sample, ParticipantEntitiesInfo) and sample.node_entities_info_seq:
                info = sample
    errors = program.stderr.read()
    assert program.returncode == 0, (program.returncode, errors)
    if "did not keep up" in errors:
        raise Stalled(errors)
    assert errors == "", errors
    # The receiving threads may be late. If they miss the messages of the end, the run counts as stalled.
    time.sleep(1.0)
    received = {}
    for topic, reader in readers.items():
        samples = reader.take(200_000)
        received[topic] = [sample for sample in samples if isinstance(sample, types[topic])]

    if info is None or not all(received.values()):
        raise Stalled("the subscriber has not found all topics")
    [node] = info.node_entities_info_seq
    assert (node.node_namespace, node.node_name) == ("/", "footfall"), node
    # The topics', and the node's own.
    assert len(node.writer_gid_seq) > len(types), len(node.writer_gid_seq)
    expected = {f"/footfall/{foot}/{topic}": least for foot in FEET for topic, least in LEAST.items()}
    expected["/diagnostics"] = 16
    if reliable:
        take_last_words(received, other_topic, other_values)
    for topic, least in expected.items():
        if reliable:
            compare(topic, received[topic], published[topic], least)
        elif len(received[topic]) <= least // 2:
            raise Stalled(f"{topic}: {len(received[topic])}")
    check_other(received[other_topic], published, other_values, whose)
    print(sum(len(messages) for messages in received.values()))


def check_other(messages, published, values, whose):
    """Checks that each message of all feet has the decision of a contact of each foot. A foot that was silent for 20
    ms may have "swing" instead, which is rare: the source is silent while this machine stalls."""
    if len(messages) <= CONTACTS // 2:
        raise Stalled(f"{whose}: {len(messages)}")
    said = []
    for foot in FEET:
        of_foot = published[f"/footfall/{foot}/contact"]
        stamps = [nanoseconds(contact.header.stamp) for contact in of_foot]
        assert stamps == sorted(stamps), f"{foot} goes back in time"
        said.append((stamps, [float(contact.valid and contact.decision) for contact in of_foot]))
    silent = []
    for message in messages[1000:-1000]:
        newest = nanoseconds(message.header.stamp)
        for (stamps, values_of_foot), value in zip(said, values(message)):
            # A foot stands for the reader of the message if the value is true (champ) or above 0.01 (pronto).
            value = float(abs(value) > 0.01)
            begin, end = bisect_left(stamps, newest - 3_000_000), bisect_right(stamps, newest)
            near = values_of_foot[begin:end]
            if value not in near:
                silent.append(f"{newest}: {value}, not one of {near}")
                assert value == 0.0, f"{whose} at {silent[-1]}"
    if len(silent) > SILENT:
        raise Stalled(f"{whose}, {len(silent)} values, the first at {silent[0]}")


faulthandler.dump_traceback_later(HANGS_S, exit=True)
CHECKS = {"all": check_all, "now": check_now, "namesake": check_namesake, "slow": check_slow, "hold": hold}
CHECKS[sys.argv[1]](*sys.argv[2:])
