"""Measures the time that `footfall ros2` adds between a sample on a topic and its contact, and writes the result that
docs/guide/own-imus.md shows.

    cargo build --release --features ros2 --bin footfall
    pip install -r host/footfall/tests/python/ros2.txt
    cd laboratory && nice -n -15 python -m benchmarks.live ../target/release/footfall [--seconds 60] [--print]

CycloneDDS publishes four IMUs and subscribes to their contacts, on the loopback interface: see
`host/footfall/tests/python/live.py`. Publisher, subscriber and footfall share this machine, whose other
programs would otherwise be measured, too, which is why the command raises the priority.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from research.results import Result, machine, write

SCRIPT = Path(__file__).parents[2] / "host/footfall/tests/python/live.py"
TOPICS = ("FL=/lf_foot/imu", "FR=/rf_foot/imu", "RL=/lh_foot/imu", "RR=/rh_foot/imu")
RATES = (400, 1000)
# A domain that the tests do not use.
DOMAIN = "101"

# The loopback interface only, without multicast.
LOOPBACK = (
    "<CycloneDDS><Domain><General>"
    '<Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)


def measure(footfall: Path, rate: int, seconds: float, folder: Path) -> dict[str, Any]:
    """Figures at one rate."""
    subprocess.run([footfall, "demo", "--output", folder, "--overwrite", "--quiet"], check=True)
    samples, figures = folder / "walk.csv", folder / "figures.json"
    with open(folder / "samples.csv", encoding="utf-8") as source:
        rows = list(csv.reader(source))
    with open(samples, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(rows)
    command = [
        sys.executable, SCRIPT, "latency", footfall, str(rate), str(seconds), samples, figures,
        *(f"ros2:{topic}" for topic in TOPICS), "--network", "127.0.0.1", "--domain-id", DOMAIN,
    ]
    subprocess.run(command, check=True, env={**os.environ, "CYCLONEDDS_URI": LOOPBACK})
    return dict(json.loads(figures.read_text(encoding="utf-8")))


def measure_stream(footfall: Path, folder: Path, seconds: float) -> dict[str, Any]:
    """Time from a line on standard input to its row on standard output, at 1 kHz."""
    lines = (folder / "samples.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    command = [footfall, "replay", "-", "--output", "-", "--sample-rate", "1000", "--quiet"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as program:
        assert program.stdin is not None and program.stdout is not None
        # The format of the input is recognised by its first bytes.
        first = 20
        program.stdin.write("".join(lines[: 1 + first]).encode())
        program.stdin.flush()
        for _ in range(1 + first):
            program.stdout.readline()
        times = []
        begun = time.perf_counter()
        for k, line in enumerate(lines[1 + first : 1 + first + round(1000 * seconds)]):
            wait = begun + k / 1000 - time.perf_counter()
            if wait > 0:
                time.sleep(wait)
            written = time.perf_counter()
            program.stdin.write(line.encode())
            program.stdin.flush()
            program.stdout.readline()
            times.append(time.perf_counter() - written)
        program.stdin.close()
        program.stdout.read()
    times.sort()
    return {
        "stream_p50_ms": round(times[len(times) // 2] * 1000, 3),
        "stream_p99_ms": round(times[len(times) * 99 // 100] * 1000, 3),
    }


def main() -> None:
    """Measures, and writes the result."""
    arguments = argparse.ArgumentParser(description="Measures the time that footfall ros2 adds.")
    arguments.add_argument("footfall", type=Path, help="the program, built with the feature ros2")
    arguments.add_argument("--seconds", type=float, default=60.0, help="time at each rate")
    arguments.add_argument("--print", action="store_true", help="print the figures, write nothing")
    given = arguments.parse_args()
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            measure(given.footfall.resolve(), rate, given.seconds, Path(folder)) for rate in RATES
        ]
        stream = measure_stream(given.footfall.resolve(), Path(folder), min(given.seconds, 15.0))
    if given.print:
        print(*rows, stream, sep="\n")
        return
    result = Result(
        "live",
        "Time from the write of a sample on a topic of ROS 2 to that of its contact, with four feet.",
        "nice -n -15 python -m benchmarks.live ../target/release/footfall",
        values={"load_average_before": round(load, 1), **stream},
        rows=rows,
        machine=machine(),
    )
    write([result])


if __name__ == "__main__":
    main()
