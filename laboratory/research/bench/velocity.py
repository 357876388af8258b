"""Velocity of a base from its legs, with four ways to trust a foot.

The filter is that of the notebook `base_velocity.ipynb`: orientation R, velocity v and the biases of the base's IMU. A
foot that moves with u against the base, in the frame of the base, measures Rᵀ v = −u with the covariance
(noise of the joints)² + σ². The ways differ only in σ. Each constant σ is the best one for this robot, chosen with the
truth that scores it, except that the σ of the truth itself is fixed. The way `sigma_v` has no such constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import footfall
import numpy as np
from scipy.spatial.transform import Rotation

from .. import peers
from ..sets import Array
from .recorded import RATES, Foot, Motions, load, load_base
from .sensor import readings
from .world import GRAVITY, QUADRUPEDS, Robot

MOTION = "a minute on firm and slippery ground"

JOINTS = 0.05
"""Noise of the rates of joints, rad/s. Times h it is the noise of the velocity of a foot."""

OFFSET = 0.1
"""Offset of the IMU of the base, as a share of that of a foot."""

CONSTANTS = (0.02, 0.05, 0.15, 0.5)
"""Candidates for σ, m/s."""

NOT_USED = 50.0
"""Largest σ that is used, m/s."""

EVERY = 5
"""Samples between two measurements: 200 Hz."""

WALK = np.repeat([3e-3, 5e-2, 1e-5, 1e-4], 3) ** 2
START = np.repeat([2e-2, 1e-2, 1e-3, 2e-1], 3) ** 2
"""Variances of orientation, velocity and biases: per second, and at the start."""

STILL = 0.5
"""Duration of the stand at the start, s, from which the filter takes the vertical."""


def of_base(robot: Robot) -> tuple[str, dict[str, Any]]:
    """Name and figures of a quadruped."""
    feet = [foot for foot in load(robot, MOTION) if foot.recorded.recording.rate == RATES[0]]
    return robot.name, of_robot(robot, feet, QUADRUPEDS.index(robot))


def forms(feet: Sequence[Foot]) -> dict[str, Array]:
    """σ of each foot at each sample by each way, shape (N, 4)."""
    estimates = [footfall.estimate(f.recorded.acc, f.recorded.gyr, f.recorded.recording.t) for f in feet]
    uses = {
        "always": [np.ones(len(foot.load), bool) for foot in feet],
        "force": [peers.schmitt_trigger(foot.load.astype(np.float64)) > 0.5 for foot in feet],
        "decision": [estimate.decision for estimate in estimates],
    }
    found = {
        f"{name} {sigma}": np.stack([np.where(used, sigma, 100.0) for used in of], axis=1)
        for name, of in uses.items()
        for sigma in CONSTANTS
    }
    truth = np.stack([np.where(foot.recorded.label == 1, CONSTANTS[0], 100.0) for foot in feet], axis=1)
    return found | {
        "sigma_v": np.stack([of.sigma_v.astype(np.float64) for of in estimates], axis=1),
        f"truth {CONSTANTS[0]}": truth,
    }


def of_robot(robot: Robot, feet: Sequence[Foot], seed: int) -> dict[str, Any]:
    """Error of the velocity, m/s, and of the position at the end, m, of each way."""
    base: Motions = load_base(robot, MOTION)
    period = 1e-3
    _, acc, gyr = readings((base.force, base.rate), 1.0 / period, [3, seed], OFFSET, period)
    truth = Rotation.from_quat(base.quaternion, scalar_first=True).as_matrix()
    seen = np.einsum("nji,knj->nki", truth, base.middles - base.velocity)
    noise = JOINTS * robot.height
    seen = seen + np.random.default_rng([4, seed]).normal(0.0, noise, seen.shape)
    sigmas = forms(feet)
    velocities, positions = navigate(acc, gyr, period, seen, noise, np.stack(list(sigmas.values())))
    own = np.einsum("nji,nj->ni", truth, base.velocity)
    later = np.arange(len(acc)) * period >= 3.0
    errors = np.sqrt(np.mean(np.sum((velocities - own[:, None])[later] ** 2, axis=2), axis=0))
    path = np.cumsum(base.velocity * period, axis=0)
    drifts = np.linalg.norm((positions - path[:, None])[-1], axis=1)
    result: dict[str, Any] = {}
    names = list(sigmas)
    for way in ("always", "force", "decision", "sigma_v", "truth"):
        best = min((k for k, name in enumerate(names) if name.split(" ")[0] == way), key=lambda k: float(errors[k]))
        constant = float(names[best].split(" ")[1]) if " " in names[best] else None
        result[way] = {
            "error_m_s": round(float(errors[best]), 3),
            "drift_m": round(float(drifts[best]), 2),
            "sigma_m_s": constant,
        }
    return result


def navigate(acc: Array, gyr: Array, period: float, seen: Array, noise: float, sigmas: Array) -> tuple[Array, Array]:
    """Velocities in the frame of the base and positions, shape (N, B, 3), of B filters with `sigmas` of shape (B, N, 4)."""
    count, n = len(sigmas), len(acc)
    still = slice(0, round(STILL / period))
    up = acc[still].mean(axis=0)
    level, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up / np.linalg.norm(up)])
    attitude = np.repeat(level.as_matrix()[None], count, axis=0)
    velocity, position = np.zeros((count, 3)), np.zeros((count, 3))
    rate_bias = np.repeat(gyr[still].mean(axis=0)[None], count, axis=0)
    force_bias = np.zeros((count, 3))
    covariance = np.repeat(np.diag(START)[None], count, axis=0)
    advance = np.repeat(np.eye(12)[None], count, axis=0)
    velocities, positions = np.zeros((n, count, 3)), np.zeros((n, count, 3))
    gravity = np.array([0.0, 0.0, GRAVITY])
    for k in range(n):
        turn, force = (gyr[k] - rate_bias) * period, acc[k] - force_bias
        advance[:, 0:3, 0:3] = np.eye(3) - _cross(turn)
        advance[:, 0:3, 6:9] = -period * np.eye(3)
        advance[:, 3:6, 0:3] = -attitude @ _cross(force) * period
        advance[:, 3:6, 9:12] = -attitude * period
        covariance = advance @ covariance @ advance.transpose(0, 2, 1) + np.diag(WALK * period)
        velocity = velocity + (np.einsum("bij,bj->bi", attitude, force) - gravity) * period
        attitude = attitude @ _rotation(turn)
        if k % EVERY == 0:
            for leg in range(seen.shape[1]):
                used = np.flatnonzero(sigmas[:, k, leg] < NOT_USED)
                if not len(used):
                    continue
                expected = np.einsum("bji,bj->bi", attitude[used], velocity[used])
                effect = np.zeros((len(used), 3, 12))
                effect[:, :, 0:3], effect[:, :, 3:6] = _cross(expected), attitude[used].transpose(0, 2, 1)
                variance = noise**2 + sigmas[used, k, leg] ** 2
                spread = effect @ covariance[used] @ effect.transpose(0, 2, 1) + variance[:, None, None] * np.eye(3)
                gain = np.linalg.solve(spread, effect @ covariance[used]).transpose(0, 2, 1)
                change = np.einsum("bij,bj->bi", gain, -seen[k, leg] - expected)
                covariance[used] = covariance[used] - gain @ effect @ covariance[used]
                attitude[used] = attitude[used] @ _rotation(change[:, 0:3])
                velocity[used] += change[:, 3:6]
                rate_bias[used] += change[:, 6:9]
                force_bias[used] += change[:, 9:12]
        position = position + velocity * period
        velocities[k] = np.einsum("bji,bj->bi", attitude, velocity)
        positions[k] = position
    return velocities, positions


def _cross(v: Array) -> Array:
    matrix = np.zeros((len(v), 3, 3))
    matrix[:, 0, 1], matrix[:, 0, 2], matrix[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return matrix - matrix.transpose(0, 2, 1)


def _rotation(turn: Array) -> Array:
    """Rotation by small vectors, to the third order."""
    cross = _cross(turn)
    square = cross @ cross
    return np.asarray(np.eye(3) + cross + 0.5 * square + cross @ square / 6.0)
