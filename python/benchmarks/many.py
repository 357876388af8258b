"""Measures what many short recordings cost, and writes it into docs/fleet.md.

    pip install './python[fleet]' --config-settings build-args='--features all'
    python python/benchmarks/many.py [--recordings 2000] [--seconds 1] [--print]

The same recordings are estimated by the Rust part alone on as many threads as Ray has workers, which is what
`footfall batch` does, by `footfall.batch`, and by `footfall.fleet`; then called again, and the rows are read.
"""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import shutil
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from fleet import record, task, write_blocks
from throughput import machine

from footfall import _footfall, fleet
from footfall.fleet._need import need

WORKERS = 2
ROBOTS = 50
RUNS = 3


def seconds(way: Callable[[], Any]) -> float:
    """The time that something takes, s."""
    begin = time.perf_counter()
    way()
    return time.perf_counter() - begin


def measure(count: int, duration: float) -> str:
    """The block of the document."""
    ray = need("ray")
    load = os.getloadavg()[0]
    folder = Path(tempfile.mkdtemp(prefix="many-"))
    paths = [folder / "recordings" / f"robot{k % ROBOTS:02}" / f"{k:05}.parquet" for k in range(count)]
    for k, path in enumerate(paths):
        record(path, duration, k)
    recordings, alone, threads, tables = (folder / name for name in ("recordings", "alone", "threads", "tables"))

    def estimate_alone(path: Path) -> None:
        one = task(path, alone)
        arguments = one.identity, one.options, one.settings, one.batch
        _footfall.batch_recording(one.url, *arguments, one.out)

    def all_alone() -> None:
        with ThreadPoolExecutor(WORKERS) as pool:
            list(pool.map(estimate_alone, paths))

    ways = {
        f"the Rust part, a call for each recording, {WORKERS} threads": (alone, all_alone),
        f"`footfall.batch`, {WORKERS} threads": (threads, lambda: fleet.estimate(recordings, threads, jobs=WORKERS)),
        f"`footfall.fleet.estimate`, {WORKERS} workers": (tables, lambda: fleet.estimate(recordings, tables)),
    }
    times = dict.fromkeys(ways, float("inf"))
    ray.init(num_cpus=WORKERS, include_dashboard=False, log_to_driver=False)
    try:
        # Workers are started and have imported what they need before the clock runs.
        fleet.estimate(paths[:8], folder / "warm")
        for _ in range(RUNS):
            # In turns, as other work on the machine comes and goes.
            for name, (out, way) in ways.items():
                shutil.rmtree(out, ignore_errors=True)
                times[name] = min(times[name], seconds(way))
    finally:
        ray.shutdown()
    times["the same again"] = seconds(lambda: fleet.estimate(recordings, tables))
    times['the same again with `verify="contents"`'] = seconds(
        lambda: fleet.estimate(recordings, tables, verify="contents", jobs=WORKERS)
    )
    times["`footfall.fleet.rows`"] = seconds(lambda: fleet.rows(tables))
    shutil.rmtree(folder)
    lines = ["| what | s | ms a recording |", "|---|---|---|"]
    lines += [f"| {name} | {took:.2f} | {1000.0 * took / count:.2f} |" for name, took in times.items()]
    today = datetime.date.today().isoformat()
    about = (
        f"The best of {RUNS} runs in turns of the first three. {count} recordings of {duration:g} s at 1 kHz, on"
        f" {machine()}, {os.cpu_count()} cores, CPython {platform.python_version()}, on {today}; before it began, the load average was {load:.1f}."
    )
    return "\n".join([*lines, "", about])


def main() -> None:
    """Measures, and writes the block of docs/fleet.md."""
    parser = argparse.ArgumentParser(description="Measures what many short recordings cost.")
    parser.add_argument("--print", action="store_true", help="print the block, write nothing")
    parser.add_argument("--recordings", type=int, default=2000, help="how many")
    parser.add_argument("--seconds", type=float, default=1.0, help="how long each of them is")
    arguments = parser.parse_args()
    write_blocks({"many": measure(arguments.recordings, arguments.seconds)}, arguments.print)


if __name__ == "__main__":
    main()
