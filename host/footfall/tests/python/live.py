"""Publishes IMUs of feet with CycloneDDS, as drivers do, and subscribes to the messages of `footfall ros2` about
them.

Usage:
    live.py estimates FOOTFALL RELIABILITY SAMPLES.csv ESTIMATES.csv ROS2-ARGUMENT...
        publishes the samples on four topics, and compares each contact with the estimate of a replay, by the time of its
        sample
    live.py pattern FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        expects four feet named by their topics, two of them with loads, and not the trunk
    live.py late FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        starts the drivers of three feet after the first, and expects the contacts of all
    live.py others FOOTFALL SAMPLES.csv FOLDER ROS2-ARGUMENT...
        calibrates, records and monitors the feet at once
    live.py restart FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        kills the publisher, and starts another
    live.py mismatch FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        expects that a subscriber is named that asks for more than is offered, and a topic without a publisher
    live.py merge FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        publishes the state of a Go2, and expects it back with other forces
    live.py trunk FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        publishes the IMU of a trunk alone, and expects that a pattern leaves it out, and that its frame is named
    live.py unreadable FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        publishes states without forces, and expects a warning, and states with forces alone
    live.py view FOOTFALL RELIABILITY SAMPLES.csv ESTIMATES.csv VIEW-ARGUMENT...
        shows the feet to a page of Foxglove, and compares its contacts like `estimates`
    live.py units FOOTFALL SAMPLES.csv ROS2-ARGUMENT...
        publishes accelerations in g, and expects that diagnostics name the unit
    live.py publish DOMAIN RELIABILITY SAMPLES.csv RATE [STAMPS.json]
        publishes the samples on four topics until it is ended
    live.py latency FOOTFALL RATE SECONDS SAMPLES.csv RESULT.json ROS2-ARGUMENT...
        measures the time from the write of a sample to that of its contact, lost samples, and the load of a core
"""

import csv
import faulthandler
import itertools
import json
import os
import re
import signal
import struct
import subprocess
import sys
import threading
import time
from collections import defaultdict
from contextlib import contextmanager

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from dds_types import (
    BmsState,
    Contact,
    ContactDetection,
    DiagnosticArray,
    Float64MultiArray,
    Header,
    Imu,
    ImuState,
    LowState,
    MotorState,
    Quaternion,
    Time,
    Vector3,
)

# The topics of a lab, and the names of their feet.
TOPICS = {"FL": "/lf_foot/imu", "FR": "/rf_foot/imu", "RL": "/lh_foot/imu", "RR": "/rh_foot/imu"}
FORCES = "/foot_forces"
# The order of Unitree.
RIGHT_FIRST = ["FR", "FL", "RR", "RL"]

# Time in which topics are found, ns.
DISCOVERY_NS = 3_000_000_000

# Time after which the script counts as hung, s. It then ends, and prints the line at which it hangs.
HANGS_S = 900.0

BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(10))
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile, Policy.History.KeepAll)
RELIABILITIES = {"best_effort": BEST_EFFORT, "reliable": RELIABLE}


def domain_of(arguments):
    return int(arguments[arguments.index("--domain-id") + 1])


def samples_of(path):
    """Times in ns and readings of a table."""
    with open(path, encoding="utf-8") as file:
        return [
            (round(float(row["t"]) * 1e9), [float(row[axis]) for axis in ("ax", "ay", "az", "wx", "wy", "wz")],
             float(row["force"]))
            for row in csv.DictReader(file)
        ]


def stamp(nanoseconds):
    return Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def nanoseconds(time):
    return time.sec * 1_000_000_000 + time.nanosec


def message(frame):
    """A message of an IMU without an orientation."""
    zeros = [0.0] * 9
    return Imu(
        header=Header(stamp=stamp(0), frame_id=frame),
        orientation=Quaternion(0.0, 0.0, 0.0, 1.0),
        orientation_covariance=[-1.0] + [0.0] * 8,
        angular_velocity=Vector3(0.0, 0.0, 0.0),
        angular_velocity_covariance=zeros,
        linear_acceleration=Vector3(0.0, 0.0, 0.0),
        linear_acceleration_covariance=zeros,
    )


class Robot:
    """The drivers of a robot with an IMU on each foot."""

    def __init__(self, domain, reliability):
        self.participant = DomainParticipant(domain)
        qos = RELIABILITIES[reliability]
        self.writers = {
            foot: DataWriter(self.participant, Topic(self.participant, f"rt{topic}", Imu), qos=qos)
            for foot, topic in TOPICS.items()
        }
        self.forces = DataWriter(
            self.participant, Topic(self.participant, f"rt{FORCES}", Float64MultiArray), qos=qos
        )
        self.messages = {foot: message(f"{foot}_foot") for foot in TOPICS}

    def wait_for_subscriber(self, program):
        while not all(writer.get_matched_subscriptions() for writer in self.writers.values()):
            assert program.poll() is None, program.communicate()
            time.sleep(0.02)

    def publish(self, stamp_ns, readings, force, scale=1.0):
        """A sample of each foot; all feet have the force `force`."""
        layout = Float64MultiArray.Layout(dim=[], data_offset=0)
        self.forces.write(Float64MultiArray(layout=layout, data=[force] * len(TOPICS)))
        ax, ay, az, wx, wy, wz = readings
        for foot, writer in self.writers.items():
            imu = self.messages[foot]
            imu.header.stamp = stamp(stamp_ns)
            imu.linear_acceleration = Vector3(scale * ax, scale * ay, scale * az)
            imu.angular_velocity = Vector3(wx, wy, wz)
            writer.write(imu)

    def play(self, samples, scale=1.0):
        """Publishes samples at their times, from now on. Returns the difference between the stamp and the time of the
        first sample."""
        # The estimator rounds stamps to whole µs, but contacts keep the ns. 499 ns test both.
        begun, begun_ns = time.monotonic(), time.time_ns() // 1000 * 1000 + 499
        first = samples[0][0]
        for at, readings, force in samples:
            wait = begun + (at - first) / 1e9 - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            self.publish(begun_ns + at - first, readings, force, scale)
        return begun_ns - first


def contact_readers(participant, names=TOPICS):
    return {
        foot: DataReader(participant, Topic(participant, f"rt/footfall/{foot}/contact", Contact), qos=RELIABLE)
        for foot in names
    }


def taken(reader, kind):
    return [sample for sample in reader.take(100_000) if isinstance(sample, kind)]


def started(footfall, arguments, log=subprocess.PIPE):
    return subprocess.Popen(
        [footfall, "ros2", *arguments], stdout=subprocess.DEVNULL, stderr=log, text=True
    )


def ended(program):
    """Ends a program by the signal that a service manager sends, and returns its error output."""
    program.terminate()
    _, errors = program.communicate()
    assert program.returncode == 0, (program.returncode, errors)
    return errors


@contextmanager
def repeated(action):
    """Calls `action` again and again, in a thread of its own, until the end of the block."""
    is_over = threading.Event()

    def repeat():
        while not is_over.is_set():
            action()

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


def check_estimates(footfall, reliability, samples, estimates, *arguments):
    samples = samples_of(samples)
    with open(estimates, encoding="utf-8") as file:
        expected = list(csv.DictReader(file))
    robot = Robot(domain_of(arguments), reliability)
    participant = DomainParticipant(domain_of(arguments))
    readers = contact_readers(participant)
    muse = Topic(participant, "rt/footfall/contact_detection", ContactDetection)
    muse = DataReader(participant, muse, qos=RELIABLE)
    program = started(footfall, arguments)
    robot.wait_for_subscriber(program)
    contacts = defaultdict(list)

    def collect():
        for foot, reader in readers.items():
            contacts[foot].extend(taken(reader, Contact))
        time.sleep(0.02)

    with repeated(collect):
        offset = robot.play(samples)
        time.sleep(1.0)
    stances = taken(muse, ContactDetection)
    errors = ended(program)
    by_stamp = {
        foot: {nanoseconds(contact.header.stamp): vars(contact) for contact in sent} for foot, sent in contacts.items()
    }
    compare_contacts(by_stamp, samples, offset, expected, reliability, errors)
    assert any(stance.stance_lf for stance in stances) and not all(stance.stance_lf for stance in stances)
    assert "warning" not in errors and "footfall:" not in errors, errors


def compare_contacts(contacts, samples, offset, expected, reliability, errors):
    """Compares the contacts of each foot, by their stamps, with the estimates of a replay."""
    for foot, by_stamp in contacts.items():
        places = [place for place, (at, *_) in enumerate(samples) if at + offset in by_stamp]
        assert len(by_stamp) == len(places), f"{foot}: contacts of no sample"
        # The contacts of the first half second come at once, while the subscriber still looks for their topics.
        found = samples[0][0] + DISCOVERY_NS
        received = set(places)
        missing = [
            place for place, (at, *_) in enumerate(samples) if at >= found and place not in received
        ]
        if reliability == "reliable":
            assert not missing, f"{foot}: contacts {missing} of {len(samples)} are missing\n{errors}"
        assert len(places) > len(samples) // 2, f"{foot}: {len(places)} contacts\n{errors}"
        if missing:
            continue
        for place in places:
            contact = by_stamp[samples[place][0] + offset]
            for ours, theirs in (("p_stable", "p_stable"), ("p_tangential", "p_tangential")):
                one, other = contact[ours], float(expected[place][theirs])
                assert abs(one - other) < 2e-7, f"{foot}, sample {place}: {ours} is {one}, and {other} in a replay"
    assert len(contacts) == len(TOPICS), list(contacts)


def check_view(footfall, reliability, samples, estimates, *arguments):
    """A page of Foxglove shows feet whose IMUs are topics."""
    # Imported here, because only this check needs these packages.
    import view

    samples = samples_of(samples)
    with open(estimates, encoding="utf-8") as file:
        expected = list(csv.DictReader(file))
    robot = Robot(domain_of(arguments), reliability)
    program = subprocess.Popen(
        [footfall, "view", *arguments, "--port", "0"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    url = re.search(r"ws://127\.0\.0\.1:[1-9]\d*$", program.stderr.readline().strip()).group()
    robot.wait_for_subscriber(program)
    subscriptions, received = {}, defaultdict(list)
    with view.connected(url, max_queue=None, origin="https://app.foxglove.dev") as page:

        def collect():
            try:
                message = page.recv(timeout=0.1)
            except TimeoutError:
                return
            if isinstance(message, str):
                view.subscribe(page, json.loads(message).get("channels", []), subscriptions)
            else:
                _, number, log_ns = struct.unpack_from("<BIQ", message)
                received[subscriptions[number]["topic"]].append((log_ns, message[13:]))

        with repeated(collect):
            offset = robot.play(samples)
            time.sleep(1.0)
    errors = ended(program)
    channels = {channel["topic"]: channel for channel in subscriptions.values()}
    messages = view.decoded(received, channels)
    contacts = {
        foot: {
            contact["header"]["stamp"]["sec"] * 1_000_000_000 + contact["header"]["stamp"]["nanosec"]: contact
            for _, contact in messages[f"/footfall/{foot}/contact"]
        }
        for foot in TOPICS
    }
    compare_contacts(contacts, samples, offset, expected, reliability, errors)
    # The curves of the layout: the samples and their probabilities.
    for foot in TOPICS:
        heights = [imu["linear_acceleration"]["z"] for _, imu in messages[f"/footfall/{foot}/imu"]]
        assert len(heights) > len(samples) // 2 and max(heights) > 9.0, (foot, len(heights))
    statuses = [array["status"][0] for _, array in messages["/diagnostics"]]
    # At the end the topics are silent, which is level 3.
    assert {status["level"] for status in statuses} <= {0, 3}, statuses
    assert {status["name"] for status in statuses} == {f"footfall: {foot}" for foot in TOPICS}, statuses


def check_restart(footfall, samples, *arguments):
    domain = domain_of(arguments)
    participant = DomainParticipant(domain)
    readers = contact_readers(participant)
    program = started(footfall, arguments)

    def publisher():
        script = [sys.executable, __file__, "publish", str(domain), "best_effort", samples, "200"]
        return subprocess.Popen(script)

    def wait_for_contacts():
        begun, counts = time.time_ns(), dict.fromkeys(TOPICS, 0)
        while min(counts.values()) < 100:
            time.sleep(0.05)
            for foot, reader in readers.items():
                new = [c for c in taken(reader, Contact) if nanoseconds(c.header.stamp) > begun]
                counts[foot] += len(new)

    first = publisher()
    wait_for_contacts()
    first.send_signal(signal.SIGKILL)
    first.wait()
    time.sleep(1.0)
    second = publisher()
    wait_for_contacts()
    second.kill()
    second.wait()
    errors = ended(program)
    assert "two publishers" not in errors, errors


def check_mismatch(footfall, samples, *arguments):
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    robot = Robot(domain_of(arguments), "best_effort")
    # This subscriber asks that lost messages are sent again.
    readers = contact_readers(participant, ["FL"])
    program = started(footfall, [*arguments, "--reliability", "best-effort", "ros2:XX=/nowhere/imu"])
    robot.wait_for_subscriber(program)
    robot.play(samples)
    errors = ended(program)
    assert "/footfall/FL/contact" in errors and "reliability" in errors, errors
    assert "no publisher of /nowhere/imu was found" in errors and "/lf_foot/imu" in errors, errors
    assert not any(taken(reader, Contact) for reader in readers.values())


def check_units(footfall, samples, *arguments):
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    robot = Robot(domain_of(arguments), "best_effort")
    reader = DataReader(participant, Topic(participant, "rt/diagnostics", DiagnosticArray), qos=RELIABLE)
    program = started(footfall, arguments)
    robot.wait_for_subscriber(program)
    robot.play(samples, scale=1 / 9.80665)
    time.sleep(0.5)
    statuses = [status for array in taken(reader, DiagnosticArray) for status in array.status]
    errors = ended(program)
    assert errors.count("--units g") == len(TOPICS), errors
    worst = {status.name: status for status in statuses if "looks like g" in status.message}
    assert set(worst) == {f"footfall: {foot}" for foot in TOPICS}, statuses
    # A warning.
    assert {status.level for status in worst.values()} == {1}, worst


def check_pattern(footfall, samples, *arguments):
    """The feet of a pattern are named by their topics, and one of them has a load."""
    names = ["lf_foot", "rf_foot", "lh_foot", "rh_foot"]
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    robot = Robot(domain_of(arguments), "best_effort")
    trunk = DataWriter(robot.participant, Topic(robot.participant, "rt/trunk/imu", Imu), qos=BEST_EFFORT)
    readers = contact_readers(participant, names + ["trunk"])
    loads = ["--load", f"lf_foot={FORCES}:data[1]", "--load", f"RH_foot={FORCES}:data[3]"]
    program = started(footfall, ["-v", *arguments, *loads])
    robot.wait_for_subscriber(program)
    trunk.write(message("trunk"))
    robot.play(samples)
    time.sleep(0.5)
    contacts = {foot: taken(reader, Contact) for foot, reader in readers.items()}
    errors = ended(program)
    assert not contacts.pop("trunk") and "/trunk/imu is left out" in errors, errors
    counts = {foot: len(of_foot) for foot, of_foot in contacts.items()}
    assert min(counts.values()) > len(samples) // 2, (counts, errors)
    # Without a load, the phase is unknown: 0.
    known = {foot: sum(contact.state != 0 for contact in of_foot) for foot, of_foot in contacts.items()}
    assert known["lf_foot"] > 0.8 * counts["lf_foot"] and known["rh_foot"] > 0.8 * counts["rh_foot"], known
    assert known["rf_foot"] == known["lh_foot"] == 0, known


def check_late(footfall, samples, *arguments):
    """Checks a robot where the drivers of three feet start long after the driver of the first."""
    names = ["lf_foot", "rf_foot", "lh_foot", "rh_foot"]
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    readers = contact_readers(participant, names)
    first = DataWriter(participant, Topic(participant, f"rt{TOPICS['FL']}", Imu), qos=BEST_EFFORT)
    program = started(footfall, arguments)
    while not first.get_matched_subscriptions():
        time.sleep(0.02)
    robot = Robot(domain_of(arguments), "best_effort")
    robot.wait_for_subscriber(program)
    robot.play(samples)
    time.sleep(0.5)
    counts = {foot: len(taken(reader, Contact)) for foot, reader in readers.items()}
    errors = ended(program)
    assert min(counts.values()) > len(samples) // 2, (counts, errors)


def check_trunk(footfall, samples, *arguments):
    """Checks a robot whose only IMU is on its trunk, which the topic or the frame shows."""
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    trunks = {
        topic: DataWriter(participant, Topic(participant, f"rt{topic}", Imu), qos=BEST_EFFORT)
        for topic in ("/trunk/imu", "/imu/data")
    }
    programs = {
        source: started(footfall, [*arguments, source])
        for source in ("ros2:/trunk/*", "ros2:/imu/data", "ros2:FL=/imu/data")
    }
    imu = message("imu_link")
    while len(trunks["/imu/data"].get_matched_subscriptions()) < 2:
        time.sleep(0.02)
    for _, (ax, ay, az, wx, wy, wz), _ in samples[:400]:
        imu.header.stamp = stamp(time.time_ns())
        imu.linear_acceleration, imu.angular_velocity = Vector3(ax, ay, az), Vector3(wx, wy, wz)
        for trunk in trunks.values():
            trunk.write(imu)
        time.sleep(0.005)
    said = {source: ended(program) for source, program in programs.items()}
    assert "/trunk/imu is left out" in said["ros2:/trunk/*"], said
    assert "ros2:NAME=/trunk/imu takes it as a foot" in said["ros2:/trunk/*"], said
    assert '/imu/data has the frame "imu_link"' in said["ros2:/imu/data"], said
    assert "trunk" not in said["ros2:FL=/imu/data"], said


def check_others(footfall, samples, folder, *arguments):
    """Checks that feet on topics can be calibrated, recorded and monitored like feet with a board."""
    samples = samples_of(samples)
    robot = Robot(domain_of(arguments), "best_effort")
    commands = {
        "calibrate": ["--output", f"{folder}/robot.toml", "--seconds", "60"],
        "record": ["--output", f"{folder}/walk.mcap"],
        "monitor": ["--json"],
    }
    programs = {
        command: subprocess.Popen(
            [footfall, command, *arguments, *own], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for command, own in commands.items()
    }
    while any(len(writer.get_matched_subscriptions()) < len(programs) for writer in robot.writers.values()):
        assert all(program.poll() is None for program in programs.values())
        time.sleep(0.02)
    # The walk is played twice, because a calibration takes ten seconds.
    length = samples[-1][0] - samples[0][0] + samples[1][0] - samples[0][0]
    robot.play(samples + [(at + length, readings, force) for at, readings, force in samples])
    calibrated, errors = programs["calibrate"].communicate()
    assert programs["calibrate"].returncode == 0, errors
    with open(f"{folder}/robot.toml", encoding="utf-8") as file:
        text = file.read()
    assert all(f"[feet.{foot}.learnt]" in text for foot in TOPICS), (text, calibrated)
    ended(programs["record"])
    programs["monitor"].terminate()
    shown, _ = programs["monitor"].communicate()
    lines = [json.loads(line) for line in shown.splitlines()]
    rates = {line["foot"]: line["rate_hz"] for line in lines if "rate_hz" in line and not line["silent"]}
    assert set(rates) == set(TOPICS) and all(150 < rate < 250 for rate in rates.values()), lines[-8:]


def low_state(tick):
    motor = MotorState(
        mode=1, q=0.0, dq=0.0, ddq=0.0, tau_est=0.0, q_raw=0.0, dq_raw=0.0, ddq_raw=0.0, temperature=30, lost=0,
        reserve=[0, 0],
    )
    motors = [MotorState(**{**vars(motor), "q": 0.01 * place + 1e-4 * tick}) for place in range(20)]
    return LowState(
        head=[0xFE, 0xEF], level_flag=0xFF, frame_reserve=0, sn=[1, 2], version=[3, 4], bandwidth=5,
        imu_state=ImuState(
            quaternion=[1.0, 0.0, 0.0, 0.0], gyroscope=[0.0] * 3, accelerometer=[0.0, 0.0, 9.8], rpy=[0.0] * 3,
            temperature=40,
        ),
        motor_state=motors,
        bms_state=BmsState(
            version_high=1, version_low=2, status=3, soc=90, current=-1000, cycle=7, bq_ntc=[20, 21],
            mcu_ntc=[22, 23], cell_vol=[4000] * 15,
        ),
        foot_force=[7, 8, 9, 10], foot_force_est=[11, 12, 13, 14], tick=tick, wireless_remote=[0] * 40,
        bit_flag=1, adc_reel=2.0, temperature_ntc1=33, temperature_ntc2=34, power_v=28.0, power_a=1.5,
        fan_frequency=[1, 2, 3, 4], reserve=0, crc=0xDEADBEEF,
    )


def check_merge(footfall, samples, *arguments):
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    robot = Robot(domain_of(arguments), "best_effort")
    states = DataWriter(participant, Topic(participant, "rt/lowstate", LowState), qos=RELIABLE)
    merged = Topic(participant, "rt/footfall/lowstate", LowState)
    reader = DataReader(participant, merged, qos=RELIABLE)
    program = started(footfall, arguments)
    robot.wait_for_subscriber(program)
    while not states.get_matched_subscriptions() or not reader.get_matched_publications():
        time.sleep(0.02)
    numbers = itertools.count(1)

    def publish_state():
        states.write(low_state(next(numbers)))
        time.sleep(0.01)

    with repeated(publish_state):
        robot.play(samples)
    time.sleep(0.5)
    received = taken(reader, LowState)
    said = ended(program)
    assert len(received) > 200, (len(received), said)
    ticks = [state.tick for state in received]
    assert ticks == sorted(set(ticks)), "each state once"
    for state in received:
        sent = low_state(state.tick)
        assert [motor.q for motor in state.motor_state] == [
            MotorState.deserialize(motor.serialize()).q for motor in sent.motor_state
        ]
        assert set(state.foot_force) <= {0, 100} and state.foot_force == state.foot_force_est, state.foot_force
        assert (state.power_v, state.crc, list(state.fan_frequency)) == (28.0, 0xDEADBEEF, [1, 2, 3, 4])
    assert {max(state.foot_force) for state in received} == {0, 100}


def check_unreadable(footfall, samples, *arguments):
    """The robot's states have another layout than those of a Unitree, so they cannot be merged."""
    participant = DomainParticipant(domain_of(arguments))
    samples = samples_of(samples)
    robot = Robot(domain_of(arguments), "best_effort")
    states = Topic(participant, "rt/lowstate", Float64MultiArray)
    # Keep the object, because the publisher exists only as long as it does.
    _states = DataWriter(participant, states, qos=RELIABLE)
    reader = DataReader(participant, Topic(participant, "rt/footfall/lowstate", LowState), qos=RELIABLE)
    program = started(footfall, arguments)
    robot.wait_for_subscriber(program)
    robot.play(samples)
    time.sleep(0.5)
    received = taken(reader, LowState)
    said = ended(program)
    assert said.count("/lowstate cannot be merged: ") == 1 and "foot_force" in said, said
    assert {max(state.foot_force) for state in received} == {0, 100}, (len(received), said)


def publish(domain, reliability, path, rate, stamps=None):
    """Publishes until it is ended. Then `stamps` gets the stamps of each foot: the times just before the writes, ns."""
    samples = samples_of(path)
    robot = Robot(int(domain), reliability)
    sent = {foot: [] for foot in TOPICS}
    is_over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: is_over.set())
    period = 1.0 / float(rate)
    begun = time.monotonic()
    k = 0
    while not is_over.is_set():
        wait = begun + k * period - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        _, (ax, ay, az, wx, wy, wz), _ = samples[k % len(samples)]
        for foot, writer in robot.writers.items():
            imu = robot.messages[foot]
            imu.linear_acceleration = Vector3(ax, ay, az)
            imu.angular_velocity = Vector3(wx, wy, wz)
            now = time.time_ns()
            imu.header.stamp = stamp(now)
            writer.write(imu)
            sent[foot].append(now)
        k += 1
    if stamps:
        with open(stamps, "w", encoding="utf-8") as file:
            json.dump(sent, file)


def quantile(values, share):
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def measure(footfall, rate, seconds, samples, result, *arguments):
    """Another process publishes the IMUs. A sample has the time just before it is written as its stamp, and its contact has
    the same stamp; the time at which footfall writes the contact comes with it."""
    domain = domain_of(arguments)
    participant = DomainParticipant(domain)
    seconds = float(seconds)
    readers = contact_readers(participant)
    program = started(footfall, arguments)
    stamps = f"{result}.stamps"
    script = [sys.executable, __file__, "publish", str(domain), "reliable", samples, rate, stamps]
    publisher = subprocess.Popen(script)
    written = {foot: {} for foot in TOPICS}

    def collect(until):
        while time.monotonic() < until:
            time.sleep(0.01)
            for foot, reader in readers.items():
                for contact in taken(reader, Contact):
                    at = contact.sample_info.source_timestamp
                    written[foot][nanoseconds(contact.header.stamp)] = at

    # The first seconds find the topics and the rate.
    collect(time.monotonic() + 5.0)
    begin_ns, before, since = time.time_ns(), cpu_seconds(program.pid), time.monotonic()
    collect(since + seconds)
    end_ns = time.time_ns()
    share = (cpu_seconds(program.pid) - before) / (time.monotonic() - since)
    # Collects the contacts of the last samples.
    collect(time.monotonic() + 2.0)
    publisher.terminate()
    publisher.wait()
    errors = ended(program)
    with open(stamps, encoding="utf-8") as file:
        sent = json.load(file)
    latencies, lost, count = [], 0, 0
    for foot, of_foot in sent.items():
        for stamp_ns in of_foot:
            if begin_ns <= stamp_ns < end_ns:
                count += 1
                at = written[foot].get(stamp_ns)
                if at is None:
                    lost += 1
                else:
                    latencies.append((at - stamp_ns) / 1e6)
    assert latencies, errors
    figures = {
        "rate_hz": float(rate),
        "seconds": seconds,
        "samples": count,
        "lost": lost,
        "p50_ms": round(quantile(latencies, 0.5), 3),
        "p99_ms": round(quantile(latencies, 0.99), 3),
        "cpu_share": round(share, 3),
    }
    with open(result, "w", encoding="utf-8") as file:
        json.dump(figures, file, indent=1)
    print(figures, errors)


def cpu_seconds(pid):
    """Time that a process has used a core, s."""
    with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    if sys.argv[1] != "publish":
        faulthandler.dump_traceback_later(HANGS_S, exit=True)
    CHECKS = {
        "estimates": check_estimates,
        "restart": check_restart,
        "pattern": check_pattern,
        "others": check_others,
        "mismatch": check_mismatch,
        "merge": check_merge,
        "late": check_late,
        "trunk": check_trunk,
        "unreadable": check_unreadable,
        "view": check_view,
        "units": check_units,
        "publish": publish,
        "latency": measure,
    }
    CHECKS[sys.argv[1]](*sys.argv[2:])
