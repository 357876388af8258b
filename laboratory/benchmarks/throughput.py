"""Measures how many samples a second the package estimates, and writes the result that README.md shows.

    pip install './python[benchmarks]'
    cd laboratory && python -m benchmarks.throughput [--print]

A million samples of a simulated walk go through `footfall.estimate` in one call, and on two threads at
once. It is compared with the paper's method as its authors compute it: for each sample and each axis, a kernel
density estimate of scikit-learn over the window of 50 samples is evaluated at 50 points in the half-width and
summed up by the rectangle rule. This method is written here from the paper, because the authors' script is not
part of this repository, and runs on a small slice. Times are the best of several runs.
"""

from __future__ import annotations

import argparse
import os
import platform
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from research.results import Result, machine, write

import footfall

SAMPLES = 1_000_000
RUNS = 5

# Parameters of the paper for ATLAS: window in samples, bandwidths and half-widths in m/s² and rad/s.
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
    """Runs the work once on each of several threads."""
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


def measure() -> Result:
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

    return Result(
        "throughput",
        "Samples that the Python package estimates in a second, beside the method of the paper with scikit-learn.",
        "python -m benchmarks.throughput",
        values={
            "two_threads_to_one": round(rows[1][2] / rows[0][2], 2),
            "cpython": platform.python_version(),
            "load_average_before": round(load, 1),
        },
        rows=[
            {"work": work, "seconds_per_million_samples": round(seconds, 2), "samples_per_s": round(rate)}
            for work, seconds, rate in rows
        ],
        machine=machine(),
    )


def main() -> None:
    """Measures, and writes the result."""
    arguments = argparse.ArgumentParser(description="Measures the package's throughput.")
    arguments.add_argument("--print", action="store_true", help="print the figures, write nothing")
    only_printed = arguments.parse_args().print
    result = measure()
    if only_printed:
        print(*result.rows, result.values, sep="\n")
    else:
        write([result])


if __name__ == "__main__":
    main()
