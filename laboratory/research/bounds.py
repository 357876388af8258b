"""Bounds on the figures, and agreement with independent computations; a change may not exceed them unnoticed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .attitude import Attitude
from .methods import AUTHORS, DEFAULT, FAMILY, FUZZY, PAPER, SHOE, TRIGGER, Evaluation
from .odometry import Odometry
from .score import Answers, bins
from .sets import POOLS

Bound = tuple[str, float, float, float]
"""What is bounded, its value, and the least and the largest that are allowed."""

RMSE = {
    # The authors' script itself, in Python.
    AUTHORS: {"ground": (0.2440, 5e-5), "3 steps": (0.2438, 5e-5), "slip": (0.3538, 5e-5)},
    # Computed from the formula in double precision, on whole files.
    PAPER: {"ground": (0.2493, 5e-4), "3 steps": (0.2566, 5e-4), "slip": (0.3472, 5e-4)},
    # Computed by an independent program in double precision. Its thresholds gave the best F1 on ground, so the RMSE
    # of tuned detectors may differ a little more.
    SHOE: {
        "ground": (0.408, 6e-4),
        "3 steps": (0.415, 6e-4),
        "slip": (0.557, 6e-4),
        "ATLAS 7k": (0.327, 6e-4),
        "NAO": (0.415, 6e-4),
        "shoe": (0.380, 6e-4),
    },
    f"SHOE / GLRT, {FAMILY}": {"slip": (0.343, 3e-3)},
    f"AMVD, {FAMILY}": {"slip": (0.359, 3e-3)},
    f"ARED, {FAMILY}": {"slip": (0.429, 3e-3)},
    TRIGGER: {"slip": (0.667, 1e-3)},
}
"""RMSE of methods by set, and how far it may differ."""

POSITION_ERRORS = {"SHOE, constants of PyShoe": 0.106, "SHOE, constants of OpenShoe": 0.091}
"""Mean errors as computed independently, m."""


def exceeded(evaluation: Evaluation, odometry: Odometry, attitude: Attitude) -> list[str]:
    bounds = [*_of_methods(evaluation), *_of_odometry(odometry), *_of_attitude(attitude)]
    return [
        f"{name} is {value:.4f}, not {least:g} to {most:g}"
        for name, value, least, most in bounds
        if not least <= value <= most
    ]


def _of_methods(evaluation: Evaluation) -> Iterator[Bound]:
    for method, sets in RMSE.items():
        for name, (expected, distance) in sets.items():
            figures = evaluation.pooled(method, [name])
            value = np.nan if figures is None else figures.rmse
            yield f"RMSE of {method} on {name}", value, expected - distance, expected + distance
    # The simulated ATLAS has no noise, and some of its slides are too slow for any real sensor.
    for pool, most, most_of_bin in (("ATLAS", 0.14, 0.45), ("LCD", 0.095, 0.45)):
        of = Answers.together(evaluation.answers(DEFAULT, POOLS[pool]) or [])
        probability, stable, samples = bins(of.label, of.p)
        distances = np.abs(probability - stable)
        yield f"calibration error on {pool}", float(np.average(distances, weights=samples)), 0.0, most
        yield f"distance of a bin on {pool}", float(distances[samples >= 1000].max()), 0.0, most_of_bin
    ours, fuzzy = (
        np.abs(of.p - of.label)
        for of in (Answers.together(evaluation.answers(method, ["slip"]) or []) for method in (DEFAULT, FUZZY))
    )
    far, of_fuzzy = (float(np.mean(errors > 0.5)) for errors in (ours, fuzzy))
    yield "median error on slip", float(np.median(ours)), 0.0, 0.06
    yield "share of errors above 0.5 on slip", far, 0.0, min(0.236, of_fuzzy)


def _of_odometry(odometry: Odometry) -> Iterator[Bound]:
    error, _, nis = odometry.detectors["footfall, sigma_v"]
    yield "NIS of sigma_v", nis, 0.2, 4.0
    decision, nine_tenths = (odometry.detectors[f"footfall, {name}"][0] for name in ("decision", "P > 0.9"))
    yield "position error by sigma_v", error, 0.0, min(0.09, 0.8 * decision, 0.9 * nine_tenths)
    for *_, of_half, _ in odometry.halves:
        yield "position error by chosen constants", of_half, 0.0, 0.1
    for name, expected in POSITION_ERRORS.items():
        yield f"position error by {name}", odometry.detectors[name][0], expected - 0.002, expected + 0.002


def _of_attitude(attitude: Attitude) -> Iterator[Bound]:
    yield "inclination error with constants 20 % off", attitude.perturbed[1], 0.0, 0.60
    yield "inclination error of held-out trials", float(np.mean(attitude.held_out)), 0.0, 0.65
