"""Inclination errors on trials of BROAD, hand-held with optical truth: this attitude filter, VQF and Madgwick.

BROAD: D. Laidig, M. Caruso, A. Cereatti, T. Seel, *BROAD — A Benchmark for Robust Inertial Orientation Estimation*,
2021. The error is the angle between the vertical of the estimate and that of the truth, over the samples that move
and have a truth; no magnetometer is used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import footfall
import numpy as np
import numpy.typing as npt
from ahrs.filters import Madgwick
from vqf import VQF, BasicVQF

from .sets import DATASETS, Array

TRIALS = [
    "02_undisturbed_slow_rotation_B",
    "07_undisturbed_fast_rotation_B",
    "11_undisturbed_slow_translation_B",
    "15_undisturbed_fast_translation_A",
    "24_disturbed_tapping_A",
    "27_disturbed_phone_vibration_B",
]

CONSTANTS = {
    "motion_time_constant_s": 5.0,
    "quiet_gain": 200.0,
    "quiet_acceleration_m_s2": 0.025 * 9.80665,
    "quiet_rate_rad_s": np.radians(3.0),
    "rest.duration_s": 1.5,
    "rest.acceleration_m_s2": 0.5,
    "rest.rate_rad_s": np.radians(2.0),
    "rest.bias_time_constant_s": 4.0,
}
"""Constants of the preset, by their keys in the configuration."""

GRID = list(product((2.5, 3.5, 5.0, 7.0), (30.0, 80.0, 200.0, 500.0)))
"""Candidate time constants, s, and quiet gains: far to either side of the preset."""

MADGWICK_GAINS = (0.04, 0.05, 0.06)
"""Candidates, of which the best is taken. It must be neither the first nor the last."""


@dataclass(frozen=True, eq=False)
class Trial:
    name: str
    t: Array
    acc: Array
    gyr: Array
    truth: Array
    """Quaternions from the sensor to the world where `is_scored`."""
    is_scored: npt.NDArray[np.bool_]

    @property
    def period(self) -> float:
        return float((self.t[-1] - self.t[0]) / (len(self.t) - 1))

    def errors(self, quaternions: Array) -> Array:
        """Inclination errors, degrees."""
        estimated, true = up(quaternions[self.is_scored]), up(self.truth)
        sine = np.linalg.norm(np.cross(estimated, true), axis=1)
        return np.asarray(np.degrees(np.arctan2(sine, np.sum(estimated * true, axis=1))))

    def rms(self, quaternions: Array) -> float:
        return float(np.sqrt(np.mean(self.errors(quaternions) ** 2)))

    def estimate(self, constants: Mapping[str, float | str] | None = None) -> Array:
        """Orientations by this filter, with other constants than the preset's."""
        attitude: dict[str, Any] = {"rest": {}}
        for key, value in (constants or {}).items():
            table, _, name = key.rpartition(".")
            (attitude[table] if table else attitude)[name] = value
        config = {"attitude": attitude}
        return footfall.estimate(self.acc, self.gyr, self.t, config=config).quaternion.astype(np.float64)


@dataclass(frozen=True)
class Attitude:
    """RMS inclination errors, degrees."""

    by_trial: dict[str, tuple[float, float]]
    """Mean error with the preset, and the limit below which 95 % of the errors lie."""
    perturbed: tuple[float, float]
    """Least and largest mean with one of the constants 20 % off."""
    held_out: list[float]
    """Means of three trials with the constants of `GRID` that are best on the other three, for each choice."""
    without_timing: float
    """Mean with a gyroscope that is not late."""
    peers: dict[str, tuple[float, float]]
    """Mean and worst trial of this filter and of published ones."""


def run() -> Attitude:
    all_trials = _trials()

    def rms(constants: Mapping[str, float | str] | None = None) -> Array:
        return np.array([trial.rms(trial.estimate(constants)) for trial in all_trials])

    preset = rms()
    assert np.array_equal(rms(CONSTANTS), preset), "CONSTANTS are not the preset's"
    perturbed = [rms({key: factor * CONSTANTS[key]}).mean() for factor in (0.8, 1.2) for key in CONSTANTS]
    grid = np.array([rms({"motion_time_constant_s": time, "quiet_gain": gain}) for time, gain in GRID])
    held_out = []
    for half in combinations(range(len(TRIALS)), 3):
        best = grid[np.argmin(grid[:, half].mean(axis=1))]
        held_out.append(float(np.delete(best, half).mean()))
    p95 = [np.percentile(trial.errors(trial.estimate()), 95, method="inverted_cdf") for trial in all_trials]
    published = {
        "VQF": [_vqf(trial, VQF) for trial in all_trials],
        "BasicVQF": [_vqf(trial, BasicVQF) for trial in all_trials],
    }
    gains = np.array([[_madgwick(trial, gain) for trial in all_trials] for gain in MADGWICK_GAINS])
    best_gain = int(np.argmin(gains.mean(axis=1)))
    assert 0 < best_gain < len(gains) - 1, f"no gain of {MADGWICK_GAINS} is best: {gains.mean(axis=1)}"
    published[f"Madgwick, its best gain ({MADGWICK_GAINS[best_gain]})"] = gains[best_gain].tolist()
    return Attitude(
        by_trial={name: (float(of), float(most)) for name, of, most in zip(TRIALS, preset, p95, strict=True)},
        perturbed=(float(min(perturbed)), float(max(perturbed))),
        held_out=held_out,
        without_timing=float(rms({"gyro_timing": "0ms"}).mean()),
        peers={
            name: (float(np.mean(of)), float(np.max(of)))
            for name, of in {"this one": preset.tolist(), **published}.items()
        },
    )


def _vqf(trial: Trial, variant: type) -> float:
    return trial.rms(variant(trial.period).updateBatch(trial.gyr, trial.acc)["quat6D"])


def _madgwick(trial: Trial, gain: float) -> float:
    return trial.rms(Madgwick(gyr=trial.gyr, acc=trial.acc, Dt=trial.period, gain=gain).Q)


def up(quaternions: Array) -> Array:
    """Up in the frame of the sensor, of quaternions w, x, y, z from the sensor to the world."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    return np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)


def _trials() -> list[Trial]:
    return [_read(name) for name in TRIALS]


def _read(name: str) -> Trial:
    rows = np.genfromtxt(DATASETS / "broad" / f"{name}.csv", delimiter=",", names=True)

    def columns(*names: str) -> Array:
        return np.stack([rows[of] for of in names], axis=1)

    truth = columns("qw", "qx", "qy", "qz")
    is_scored = (rows["movement"] == 1) & np.isfinite(truth).all(axis=1)
    acc, gyr = columns("ax", "ay", "az"), columns("wx", "wy", "wz")
    return Trial(name, rows["t"], acc, gyr, truth[is_scored], is_scored)
