"""Measures the time that trees of recordings take, and writes the result that docs/guide/fleet.md shows.

    pip install './python[fleet]' --config-settings build-args='--features all'
    cd laboratory && python -m benchmarks.fleet [--print]
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pyarrow.parquet as parquet
from research.results import Result, machine, write

import footfall
from footfall import fleet

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
    """Growth of a process's memory with a recording, bytes per sample."""
    for duration in (60, 600):
        record(folder / str(duration), 1, duration)
    code = "import re, sys, footfall; footfall.estimate_file(sys.argv[1])\n"
    code += "print(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read())[1])"
    paths = (str(folder / f"{duration}/robot0/0.parquet") for duration in (60, 600))
    short, long = (int(subprocess.check_output([sys.executable, "-c", code, path])) for path in paths)
    return 1024.0 * (long - short) / 540_000.0


def measure(folder: Path) -> Result:
    import ray

    load = os.getloadavg()[0]
    ray.init(num_cpus=WORKERS, include_dashboard=False, log_to_driver=False)
    # Start the workers and let them import their modules before time is measured.
    fleet.estimate(record(folder / "warm", WORKERS, 1.0), folder / "warm-rows")
    rows: list[dict[str, object]] = []

    def add(count: int, duration: float, took: float, samples_written: bool, unchanged: bool) -> None:
        rate = count * duration * 1000.0 / took
        rows.append(
            {
                "recordings": count,
                "length_s": duration,
                "samples_written": samples_written,
                "unchanged": unchanged,
                "duration_s": round(took, 1),
                "recordings_per_s": round(count / took, 1),
                "samples_per_s": None if unchanged else round(rate),
            }
        )

    for name, count, duration in TREES:
        source, destination = record(folder / name, count, duration), folder / f"{name}-rows"
        for samples in (False, True) if name == "long" else (False,):
            add(count, duration, seconds(source, destination, samples), samples, False)
    add(count, duration, seconds(source, destination), False, True)
    ray.shutdown()
    return Result(
        "fleet",
        "Time to estimate trees of recordings with `footfall.fleet`, at 1 kHz, in Parquet.",
        "python -m benchmarks.fleet",
        values={
            "workers": WORKERS,
            "cpython": platform.python_version(),
            "load_average_before": round(load, 1),
            "bytes_per_sample": round(bytes_a_sample(folder / "memory")),
        },
        rows=rows,
        machine=machine(),
    )


def main() -> None:
    """Measures, and writes the result."""
    parser = argparse.ArgumentParser(description="Measures the time that trees of recordings take.")
    parser.add_argument("--print", action="store_true", help="print the figures, write nothing")
    only_printed = parser.parse_args().print
    with tempfile.TemporaryDirectory(prefix="fleet-") as folder:
        result = measure(Path(folder))
    if only_printed:
        print(*result.rows, result.values, sep="\n")
    else:
        write([result])


if __name__ == "__main__":
    main()
