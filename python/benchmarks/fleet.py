"""Measures what trees of recordings cost, and writes it into docs/fleet.md.

    pip install './python[fleet]' --config-settings build-args='--features all'
    python python/benchmarks/fleet.py [--print]
"""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pyarrow.parquet as parquet
from throughput import machine

import footfall
from footfall import fleet

DOCUMENT = Path(__file__).parents[2] / "docs/fleet.md"
WORKERS = 2
TREES = (("long", 8, 300.0), ("short", 1000, 1.0), ("many", 10_000, 0.1))  # name, number, length in s


def seconds(source: Path, rows: Path, samples: bool = False) -> float:
    """The time that a call takes, s."""
    begin = time.perf_counter()
    statuses = fleet.estimate(source, rows, samples=samples)["status"]
    took = time.perf_counter() - begin
    assert set(statuses.to_pylist()) == {"done"}
    return took


def record(folder: Path, count: int, duration: float) -> Path:
    """Writes recordings of one walk, in folders of a hundred."""
    walk = footfall.simulate("trot", duration, seed=1).to_arrow()
    for k in range(count):
        path = folder / f"robot{k // 100}" / f"{k}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(walk, path, compression="zstd")
    return folder


def bytes_a_sample(folder: Path) -> float:
    """By how much the memory of a process grows with a recording, for each of its samples."""
    for duration in (60, 600):
        record(folder / str(duration), 1, duration)
    code = "import re, sys, footfall; footfall.estimate_file(sys.argv[1])\n"
    code += "print(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read())[1])"
    paths = (str(folder / f"{duration}/robot0/0.parquet") for duration in (60, 600))
    short, long = (int(subprocess.check_output([sys.executable, "-c", code, path])) for path in paths)
    return 1024.0 * (long - short) / 540_000.0


def measure(folder: Path) -> str:
    """The block of the document."""
    import ray

    load = os.getloadavg()[0]
    ray.init(num_cpus=WORKERS, include_dashboard=False, log_to_driver=False)
    # Workers are started and have imported what they need before the clock runs.
    fleet.estimate(record(folder / "warm", WORKERS, 1.0), folder / "warm-rows")
    lines = ["| recordings | s | recordings/s | samples/s |", "|---|---|---|---|"]
    for name, count, duration in TREES:
        source, rows = record(folder / name, count, duration), folder / f"{name}-rows"
        for title, samples in (("", False), (", samples written", True)) if name == "long" else (("", False),):
            took = seconds(source, rows, samples)
            rate = count * duration * 1000.0 / took
            lines.append(f"| {count} of {duration:g} s{title} | {took:.1f} | {count / took:.1f} | {rate:,.0f} |")
    took = seconds(source, rows)
    lines.append(f"| these again, unchanged | {took:.1f} | {count / took:,.0f} | |")
    ray.shutdown()
    about = f"At 1 kHz, Parquet, {WORKERS} workers on {machine()}, {os.cpu_count()} cores, CPython"
    about += f" {platform.python_version()}, on {datetime.date.today().isoformat()}; load average before: {load:.1f}."
    memory = f"In memory an estimate takes {bytes_a_sample(folder / 'memory'):.0f} bytes a sample and foot."
    return "\n".join([*lines, "", f"{about} {memory}", ""])


def main() -> None:
    """Measures, and writes the block of docs/fleet.md."""
    parser = argparse.ArgumentParser(description="Measures what trees of recordings cost.")
    parser.add_argument("--print", action="store_true", help="print the block, write nothing")
    only_printed = parser.parse_args().print
    with tempfile.TemporaryDirectory(prefix="fleet-") as folder:
        block = measure(Path(folder))
    if only_printed:
        print(block)
        return
    begin, end = "<!-- begin fleet -->\n", "<!-- end fleet -->"
    before, _, rest = DOCUMENT.read_text(encoding="utf-8").partition(begin)
    DOCUMENT.write_text(before + begin + block + end + rest.partition(end)[2], encoding="utf-8")


if __name__ == "__main__":
    main()
