"""Positions of a shoe from its IMU with the zero-velocity measurements of each detector, against an optical truth.

The filter, its noise and the measure of error are those of B. Wagstaff, V. Peretroukhin and J. Kelly, *Robust
Data-Driven Zero-Velocity Detection for Foot-Mounted Inertial Navigation* (PyShoe), IEEE Sensors Journal 20(2), 2020,
whose recordings these are: an error-state Kalman filter with nine states.

    R ← R exp(ω T)      v ← v + T (R f − g)      p ← p + T v
    error: position, velocity, attitude; F has T between position and velocity, −T [R f]× between velocity and
    attitude; noise (σ_a T)² and (σ_ω T)² in each step
    measured: v = 0, standard deviation σ per axis
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from . import peers
from .sets import DATASETS, SHOE, Array, load

NOISE = (0.5, np.radians(0.5))
"""Standard deviation of acceleration, m/s², and angular rate, rad/s, per axis and sample (PyShoe's `INS.py`)."""

START = (1e-5, np.radians(0.1))
"""Initial standard deviation of position and velocity, m and m/s, and of attitude, rad."""

START_SAMPLES = 20
"""Number of initial samples at rest that determine the vertical and g."""

YES = 0.01
"""Standard deviation of the velocity where a detector reports zero velocity, m/s."""

NO_MEASUREMENT = 1e6
"""Standard deviation so large that the measurement changes nothing, m/s."""

PYSHOE_NOISE = (0.00098, 8.7266463e-5)
"""Noise of SHOE in PyShoe's `process_error_vicon.py`, m/s² and rad/s."""

PYSHOE_THRESHOLD = 5e7
"""Threshold of `ins_demos.py`, within the grid of `run_threshold_optimization.py`."""

SPEEDS = (0.03, 0.05, 0.07, 0.1, 0.2)
LEVERS = (0.05, 0.1, 0.15, 0.2)
"""Candidates for the constants of `sigma_v`, m/s and m."""

NIS = (0.2, 4.0)
"""Range of the mean NIS for chosen constants. A mean of 3 says that σ is right, and a higher one that the filter trusts
the foot too much. Errors that last for a whole stance, as of a rolling foot, lower the mean, and so do the samples of
swings, whose σ is huge."""


@dataclass(frozen=True)
class Odometry:
    detectors: dict[str, tuple[float, float, float]]
    """Mean and largest error of the walks, m, and the mean normalised innovation squared."""
    halves: list[tuple[float, float, float, float]]
    """Speed and lever that are best on every second walk; on the others the mean error with them, and with the default, m."""


def run() -> Odometry:
    best = [f"best {k}" for k in range(25)]
    candidates = list(product(SPEEDS, LEVERS))
    errors, nis = [], []
    for path, file in zip(SHOE, load(["shoe"]), strict=True):
        recording = file.recording
        result = recording.estimate()
        of_pyshoe = peers.shoe(file, 5, PYSHOE_NOISE)
        measured = {
            "footfall, sigma_v": result.sigma_v.astype(np.float64),
            "footfall, P > 0.9": _yes(result.p_stable > 0.9),
            "footfall, P > 0.5": _yes(result.p_stable > 0.5),
            "footfall, decision": _yes(result.decision),
            "SHOE, constants of PyShoe": _yes(of_pyshoe < PYSHOE_THRESHOLD),
            "SHOE, constants of OpenShoe": _yes(peers.published_shoe(file) > -peers.OPENSHOE_THRESHOLD),
            "ARED, constants of OpenShoe": _yes(peers.published_ared(file) > -peers.OPENSHOE_THRESHOLD),
        }
        names = list(measured)
        measured |= {
            name: _yes(of_pyshoe < limit) for name, limit in zip(best, np.geomspace(1e6, 1e9, 25), strict=True)
        }
        for speed, lever in candidates:
            config = {"velocity": {"speed_m_s": speed, "lever_m": lever}}
            measured[f"{speed}, {lever}"] = recording.estimate(config=config).sigma_v.astype(np.float64)
        positions, of_walk = navigate(
            file.acc, file.gyr, 1.0 / recording.rate, np.stack(list(measured.values()), axis=1)
        )
        # The optical frame is left-handed with z up.
        truth = np.loadtxt(DATASETS / path.replace("pyshoe", "pyshoe-positions"), delimiter=",", skiprows=1)[:, 1:]
        errors.append(position_errors(positions, truth * [1.0, -1.0, 1.0]))
        nis.append(of_walk)
    error, square = np.array(errors), np.array(nis)
    least = len(names)
    shoe = least + np.argmin(error[:, least : least + 25], axis=1)
    walks = np.arange(len(SHOE))
    columns = {name: (error[:, k], square[:, k]) for k, name in enumerate(names)}
    columns["SHOE, best threshold of each walk"] = (error[walks, shoe], square[walks, shoe])
    return Odometry(
        detectors={name: (float(e.mean()), float(e.max()), float(s.mean())) for name, (e, s) in columns.items()},
        halves=[_chosen(candidates, error[:, least + 25 :], square[:, least + 25 :], half) for half in (0, 1)],
    )


def _chosen(
    candidates: list[tuple[float, float]], error: Array, nis: Array, half: int
) -> tuple[float, float, float, float]:
    """Chooses constants on every second walk, from `half` on; the errors are measured on the other walks."""
    of_half = nis[half::2].mean(axis=0)
    is_acceptable = (NIS[0] <= of_half) & (of_half <= NIS[1])
    chosen = int(np.argmin(np.where(is_acceptable, error[half::2].mean(axis=0), np.inf)))
    others, default = error[1 - half :: 2].mean(axis=0), candidates.index((0.05, 0.15))
    return *candidates[chosen], float(others[chosen]), float(others[default])


def _yes(is_standing: npt.NDArray[np.bool_]) -> Array:
    return np.where(is_standing, YES, NO_MEASUREMENT)


def navigate(acc: Array, gyr: Array, period: float, sigmas: Array) -> tuple[Array, Array]:
    """Runs one filter for each column of `sigmas`, the standard deviation of the velocity at each sample.

    Returns the positions, shape (N, B, 3), z up, and the mean normalised innovation squared, vᵀ S⁻¹ v, of each."""
    count = sigmas.shape[1]
    up = acc[:START_SAMPLES].mean(axis=0)
    gravity = np.array([0.0, 0.0, np.linalg.norm(up)])
    level, _ = Rotation.align_vectors([gravity], [up])
    turns = Rotation.from_rotvec(gyr * period).as_matrix()
    attitude = np.repeat(level.as_matrix()[None], count, axis=0)
    position, velocity = np.zeros((count, 3)), np.zeros((count, 3))
    covariance = np.repeat(np.diag(np.repeat([START[0], START[0], START[1]], 3) ** 2)[None], count, axis=0)
    noise = np.diag(np.repeat([0.0, *NOISE], 3) * period) ** 2
    advance = np.repeat(np.eye(9)[None], count, axis=0)
    advance[:, :3, 3:6] = np.eye(3) * period
    is_measured = sigmas < NO_MEASUREMENT
    positions, squares = np.zeros((len(acc), count, 3)), np.zeros(count)
    for k in range(1, len(acc)):
        x, y, z = (attitude @ acc[k] * period).T
        advance[:, 3, 7], advance[:, 3, 8], advance[:, 4, 8] = z, -y, x
        advance[:, 4, 6], advance[:, 5, 6], advance[:, 5, 7] = -z, y, -x
        covariance = advance @ covariance @ advance.transpose(0, 2, 1) + noise
        attitude = attitude @ turns[k]
        velocity = velocity + (attitude @ acc[k] - gravity) * period
        position = position + velocity * period

        innovation = covariance[:, 3:6, 3:6] + np.eye(3) * sigmas[k, :, None, None] ** 2
        weighted = np.linalg.solve(innovation, np.concatenate([velocity[:, :, None], covariance[:, 3:6]], axis=2))
        squares += np.where(is_measured[k], np.sum(velocity * weighted[:, :, 0], axis=1), 0.0)
        change = -(covariance[:, :, 3:6] @ weighted[:, :, :1])[:, :, 0]
        covariance = covariance - covariance[:, :, 3:6] @ weighted[:, :, 1:]
        covariance = 0.5 * (covariance + covariance.transpose(0, 2, 1))
        position, velocity = position + change[:, :3], velocity + change[:, 3:6]
        attitude = Rotation.from_rotvec(change[:, 6:]).as_matrix() @ attitude
        positions[k] = position
    return positions, squares / is_measured[1:].sum(axis=0)


def position_errors(positions: Array, truth: Array) -> Array:
    """Position error of each track, m, as PyShoe defines it: the RMS over the three axes, averaged over the samples.

    The tracks are shifted to a common origin, and each estimated track is rotated about the vertical to the best
    least-squares fit, because an IMU does not know its heading."""
    at, true = positions - positions[0], (truth - truth[0])[:, None]
    sine = np.sum(at[..., 0] * true[..., 1] - at[..., 1] * true[..., 0], axis=0)
    cosine = np.sum(at[..., 0] * true[..., 0] + at[..., 1] * true[..., 1], axis=0)
    heading = np.exp(1j * np.arctan2(sine, cosine))
    ground = (at[..., 0] + 1j * at[..., 1]) * heading - (true[..., 0] + 1j * true[..., 1])
    return np.asarray(np.sqrt((np.abs(ground) ** 2 + (at[..., 2] - true[..., 2]) ** 2) / 3.0).mean(axis=0))
