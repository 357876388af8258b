"""Measures how many samples a second the package estimates, and writes it into README.md.

    pip install './python[benchmarks]'
    python python/benchmarks/throughput.py [--print]

A million samples of a simulated walk go through `footfall.estimate` in one call, and on two threads at
once. Beside it stands the paper's method as its authors compute it: for each sample, each axis and the
window of 50 samples a kernel density estimate of scikit-learn, evaluated at 50 points in the half-width and
summed up by the rectangle rule. That is written here from the paper, as their script is not part of this
repository; it runs on a small slice. Times are the best of several runs.
"""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import footfall

SAMPLES = 1_000_000
RUNS = 5
README = Path(__file__).parents[1] / "README.md"

# The paper's, for ATLAS: window in samples, bandwidths and half-widths in m/s² and rad/s.
WINDOW, POINTS = 50, 50
BANDWIDTH = [0.02467] * 3 + [0.01653] * 3
HALF_WIDTH = [0.4] * 3 + [0.04] * 3
SLICE = 500


def best(work: Callable[[], Any], runs: int = RUNS) -> float:
    """The shortest time that the work takes, s."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def on_threads(count: int, work: Callable[[], Any]) -> None:
    """Does the work once on each of several threads."""
    threads = [threading.Thread(target=work) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def as_published(axes: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """P of each sample whose window is full: the product over six axes of the density's sum."""
    from sklearn.neighbors import KernelDensity

    p = np.ones(len(axes) - WINDOW)
    for k in range(len(p)):
        for axis, (bandwidth, half_width) in enumerate(zip(BANDWIDTH, HALF_WIDTH)):
            window = axes[k : k + WINDOW, axis : axis + 1]
            points = np.linspace(-half_width, half_width, POINTS)[:, None]
            density = KernelDensity(bandwidth=bandwidth).fit(window).score_samples(points)
            p[k] *= np.exp(density).sum() * (points[1, 0] - points[0, 0])
    return p


def machine() -> str:
    """The processor, by its name."""
    try:
        info = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        info = ""
    name = re.search(r"model name\s*:\s*(.+)", info)
    return name.group(1) if name else platform.processor() or platform.machine()


def measure() -> str:
    """The table, with the machine and the date."""
    load = os.getloadavg()[0]
    walk = footfall.simulate("walk", SAMPLES / 1000.0)
    assert len(walk) == SAMPLES

    def estimate(preset: footfall.Preset) -> Callable[[], Any]:
        return lambda: footfall.estimate(walk.acc, walk.gyr, walk.t, preset=preset)

    rows = []
    for title, preset in (("default preset", "default"), ("paper preset", "paper")):
        work = estimate("paper" if preset == "paper" else "default")
        for threads in (1, 2):
            seconds = best(lambda: on_threads(threads, work))
            unit = "one thread" if threads == 1 else "two threads, a million each"
            rows.append((f"`footfall.estimate`, {title}, {unit}", seconds, threads * SAMPLES / seconds))
    linear = walk.estimate().linear_acceleration[4000 : 4000 + SLICE + WINDOW]
    axes = np.hstack([linear, walk.gyr[4000 : 4000 + SLICE + WINDOW]]).astype(np.float64)
    seconds = best(lambda: as_published(axes), runs=3)
    rate = SLICE / seconds
    title = f"the paper's method with scikit-learn, one thread; from {SLICE} samples"
    rows.append((title, SAMPLES / rate, rate))

    lines = ["| a million samples | s | samples/s |", "|---|---|---|"]
    lines += [f"| {name} | {seconds:.2f} | {rate:,.0f} |" for name, seconds, rate in rows]
    scaling = rows[1][2] / rows[0][2]
    today = datetime.date.today().isoformat()
    lines += [
        "",
        f"Two threads estimate {scaling:.2f} times as many samples a second as one. Measured by"
        " [`benchmarks/throughput.py`](benchmarks/throughput.py) on"
        f" {machine()}, {os.cpu_count()} cores, CPython {platform.python_version()}, on {today}; before it began,"
        f" the load average was {load:.1f}.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Measures, and writes the block of README.md."""
    arguments = argparse.ArgumentParser(description="Measures the package's throughput.")
    arguments.add_argument("--print", action="store_true", help="print the table, write nothing")
    table = measure()
    if arguments.parse_args().print:
        print(table)
        return
    begin, end = "<!-- begin throughput -->\n", "<!-- end throughput -->"
    text = README.read_text(encoding="utf-8")
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(end)
    README.write_text(f"{before}{begin}{table}\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
