"""Inclination errors of published attitude filters, by their own packages.

The arguments are recordings with the true orientation, as `footfall attitude` reads them. One line
per filter: its name, the mean of the recordings' RMS errors and the largest of them, in degrees,
with tabs in between. Scored as `footfall::attitude` does: the angle between where estimate and
truth have up, over the rows that move and have a truth.
"""

import sys
from multiprocessing import Pool

import numpy as np
from ahrs.filters import Madgwick
from vqf import VQF, BasicVQF

# The best of them is taken, and must not be the first or the last.
MADGWICK_GAINS = [0.04, 0.05, 0.06]


def up(orientation):
    """Where up is in the sensor frame, for quaternions sensor -> world."""
    w, x, y, z = (orientation / np.linalg.norm(orientation, axis=1, keepdims=True)).T
    return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)


def rms(estimate, truth):
    a, b = up(estimate), up(truth)
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    errors = np.degrees(np.arctan2(sine, np.sum(a * b, axis=1)))
    return np.sqrt(np.mean(errors**2))


def vqf(variant, period, force, rate):
    return variant(period).updateBatch(rate, force)["quat6D"]


def madgwick(gain, period, force, rate):
    return Madgwick(gyr=rate, acc=force, Dt=period, gain=gain).Q


FILTERS = [(vqf, VQF), (vqf, BasicVQF)] + [(madgwick, gain) for gain in MADGWICK_GAINS]


def errors(path):
    """The RMS error of each filter on one recording."""
    names = open(path, encoding="utf-8").readline().strip().split(",")
    rows = np.genfromtxt(path, delimiter=",", skip_header=1)

    def columns(*wanted):
        return np.ascontiguousarray(rows[:, [names.index(name) for name in wanted]])

    time, moving = columns("t", "movement").T
    force, rate = columns("ax", "ay", "az"), columns("wx", "wy", "wz")
    truth = columns("qw", "qx", "qy", "qz")
    period = (time[-1] - time[0]) / (len(time) - 1)
    counts = (moving == 1) & np.isfinite(truth).all(axis=1)
    return [
        rms(run(setting, period, force, rate)[counts], truth[counts])
        for run, setting in FILTERS
    ]


if __name__ == "__main__":
    with Pool() as pool:
        vqfs, basics, *madgwicks = np.array(pool.map(errors, sys.argv[1:])).T
    means = [of_gain.mean() for of_gain in madgwicks]
    best = means.index(min(means))
    assert 0 < best < len(means) - 1, f"no gain of {MADGWICK_GAINS} is best: {means}"
    named = {
        "VQF": vqfs,
        "BasicVQF": basics,
        f"Madgwick, its best gain ({MADGWICK_GAINS[best]})": madgwicks[best],
    }
    for name, of_filter in named.items():
        print(f"{name}\t{of_filter.mean():.4f}\t{of_filter.max():.4f}")
