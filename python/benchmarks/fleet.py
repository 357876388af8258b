"""Measures what a fleet costs, and writes it into docs/fleet.md.

    pip install './python[fleet]'
    FOOTFALL_PROGRAM=target/wheel/footfall python python/benchmarks/fleet.py [--print]

The same recordings, of simulated feet as Parquet, go through the program `footfall batch`, through one process,
and through Ray with one worker and with two, all to tables on a local disk. The program is that of
`cargo build --profile wheel --package footfall`, compiled as the package is. Times are the best of several runs.
"""

from __future__ import annotations

import argparse
import datetime
import multiprocessing
import os
import platform
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from throughput import machine

import footfall
from footfall import fleet
from footfall._settings import read_options, settings
from footfall.fleet._need import need
from footfall.fleet._work import Task, work

DOCUMENT = Path(__file__).parents[2] / "docs/fleet.md"
SECONDS = 300.0
RECORDINGS = 8
RUNS = 3

FEET = 4
RATE = 1000.0
SAMPLES_A_DAY = FEET * RATE * 86_400.0
"""Of a robot that records day and night."""

CORE_HOUR = 0.04
"""What a core costs in an hour, $: an assumption, of the order of what clouds ask for one on demand."""

GIGABYTE_MONTH = 0.023
"""What it costs to keep a gigabyte for a month, $: an assumption, of the order of object storage."""


def record(path: Path, seconds: float, seed: int) -> None:
    """Records a simulated foot."""
    parquet = need("pyarrow.parquet")
    walk = footfall.simulate("trot", seconds, seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(walk.to_arrow(), path, compression="zstd")


def task(path: Path, out: Path) -> Task:
    """What a worker is given."""
    options = read_options()
    return Task(
        url=str(path),
        identity=fleet.Source(str(path)).identity(None),
        options=options,
        settings=settings("default", None, None, None),
        batch={"window": None, "strict": False, "only_foot": None},
        out=str(out),
        storage_options={},
        before=(),
        run="benchmark",
    )


def best(way: Callable[[Path], Any], folder: Path) -> float:
    """The shortest time that a way of estimating takes, s."""
    times = []
    for run in range(RUNS):
        out = folder / f"out-{run}"
        begin = time.perf_counter()
        way(out)
        times.append(time.perf_counter() - begin)
        shutil.rmtree(out)
    return min(times)


def peak(seconds: float, folder: Path) -> float:
    """The memory that a process needs for one recording, its libraries included, MB."""
    path = folder / f"long-{seconds:.0f}.parquet"
    record(path, seconds, 1)
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        return float(pool.apply(peak_of, (path, folder / "peak"))) / 1e6


def peak_of(path: Path, out: Path) -> int:
    """What this process has needed at most after one task, bytes."""
    work(task(path, out))
    # Of this program alone: what getrusage says counts the process that has started it, too.
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    found = re.search(r"VmHWM:\s*(\d+) kB", status)
    return 1024 * int(found.group(1)) if found else 0


def on_ray(workers: int, recordings: Path, folder: Path) -> float:
    """The time of estimating all recordings, s."""
    ray = need("ray")
    ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)
    try:
        # Workers are started and have imported what they need before the clock runs.
        fleet.estimate(recordings, folder / "warm")
        return best(lambda out: fleet.estimate(recordings, out), folder)
    finally:
        ray.shutdown()
        shutil.rmtree(folder / "warm", ignore_errors=True)


def size(folder: Path) -> int:
    """Bytes of all files below a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def measure(program: str) -> dict[str, str]:
    """The blocks of the document."""
    load = os.getloadavg()[0]
    folder = Path(tempfile.mkdtemp(prefix="fleet-"))
    recordings = folder / "recordings"
    for k in range(RECORDINGS):
        record(recordings / f"robot{k // FEET}" / f"foot{k % FEET}.parquet", SECONDS, k)
    samples = RECORDINGS * SECONDS * RATE
    paths = sorted(recordings.rglob("*.parquet"))

    def batch(jobs: int) -> Callable[[Path], Any]:
        def run(out: Path) -> None:
            command = [program, "batch", str(recordings), "--out", str(out), "--jobs", str(jobs)]
            subprocess.run(command, check=True, capture_output=True)

        return run

    def alone(out: Path) -> None:
        for path in paths:
            work(task(path, out))

    times = {
        "`footfall batch --jobs 1`": best(batch(1), folder),
        "`footfall batch --jobs 2`": best(batch(2), folder),
        "one Python process, without Ray": best(alone, folder),
    }
    for workers in (1, 2):
        unit = "worker" if workers == 1 else "workers"
        times[f"Ray, {workers} {unit}"] = on_ray(workers, recordings, folder)
    alone(folder / "size")
    read, written = size(recordings) / samples, size(folder / "size") / samples
    memory = [peak(seconds, folder) for seconds in (60.0, 1200.0)]
    shutil.rmtree(folder)

    today = datetime.date.today().isoformat()
    about = (
        f"{RECORDINGS} recordings of {SECONDS:.0f} s at 1 kHz, on {machine()}, {os.cpu_count()} cores, CPython"
        f" {platform.python_version()}, on {today}; before it began, the load average was {load:.1f}."
    )
    names = list(times)
    lines = ["| way | s | samples/s | samples/s and core |", "|---|---|---|---|"]
    for name, seconds in times.items():
        cores = 2 if "2" in name else 1
        lines.append(
            f"| {name} | {seconds:.2f} | {samples / seconds:,.0f} | {samples / seconds / cores:,.0f} |"
        )
    lines += [
        "",
        f"From one worker to two: {times[names[3]] / times[names[4]]:.2f} times as fast; the program from one"
        f" thread to two: {times[names[0]] / times[names[1]]:.2f} times. {about}",
    ]
    per_core = samples / times[names[4]] / 2.0
    core_hours = SAMPLES_A_DAY / per_core / 3600.0
    stored = SAMPLES_A_DAY * written / 1e9
    plan = [
        "| of a robot with four feet at 1 kHz, in a day | |",
        "|---|---|",
        f"| samples | {SAMPLES_A_DAY / 1e6:.0f} million |",
        f"| recordings, Parquet with zstd, read | {SAMPLES_A_DAY * read / 1e9:.1f} GB ({read:.1f} bytes a sample) |",
        f"| tables, written | {stored:.1f} GB ({written:.1f} bytes a sample) |",
        f"| work | {core_hours:.2f} core hours |",
        f"| cost of the work, at ${CORE_HOUR:.2f} a core hour | ${core_hours * CORE_HOUR:.4f} |",
        f"| cost of keeping the tables, at ${GIGABYTE_MONTH:.3f} a GB and month | ${stored * GIGABYTE_MONTH:.3f} a month |",
        "",
        "| workers | robots that record day and night | read, Gbit/s | written, Gbit/s | recordings of an hour, each second |",
        "|---|---|---|---|---|",
    ]
    for workers in (1, 10, 100, 1000):
        rate = workers * per_core
        plan.append(
            f"| {workers} | {rate * 86_400.0 / SAMPLES_A_DAY:.0f} | {8e-9 * rate * read:.2f} |"
            f" {8e-9 * rate * written:.2f} | {rate / (3600.0 * RATE):.2f} |"
        )
    memories = (
        f"A task needs {memory[0]:.0f} MB at most for a recording of a minute and {memory[1]:.0f} MB for one of"
        f" twenty minutes, the process with its libraries included; Ray is told 512 MB."
    )
    return {"throughput": "\n".join(lines), "plan": "\n".join(plan), "memory": memories}


def write_blocks(blocks: dict[str, str], is_printed: bool) -> None:
    """Writes blocks into the document, or prints them."""
    text = DOCUMENT.read_text(encoding="utf-8")
    for name, block in blocks.items():
        if is_printed:
            print(block, end="\n\n")
            continue
        begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        text = f"{before}{begin}{block}\n{end}{after}"
    if not is_printed:
        DOCUMENT.write_text(text, encoding="utf-8")


def main() -> None:
    """Measures, and writes the blocks of docs/fleet.md."""
    parser = argparse.ArgumentParser(description="Measures what a fleet costs.")
    parser.add_argument("--print", action="store_true", help="print the blocks, write nothing")
    arguments = parser.parse_args()
    program = os.environ.get("FOOTFALL_PROGRAM")
    if program is None:
        parser.error("FOOTFALL_PROGRAM does not name the program")
    write_blocks(measure(os.path.abspath(program)), arguments.print)


if __name__ == "__main__":
    main()
