"""An LSM6DSOX with its errors, at 1 kHz and at 416 Hz.

Source: the data sheet of the LSM6DSOX. The offset after soldering is up to ±40 mg, that of the gyroscope ±1 °/s.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from ..sets import Array
from .world import GRAVITY, STEP

OFFSET = (0.5, 1.0)
"""Least and largest offset of an axis, as a share of `LARGEST_OFFSET`."""

LARGEST_OFFSET = (0.040 * GRAVITY, np.radians(1.0))
"""Largest offset of the accelerometer, m/s², and of the gyroscope, rad/s."""

NOISE = (70e-6 * GRAVITY, np.radians(3.8e-3))
"""Density of the noise, m/s² and rad/s per √Hz."""

CODE = (16.0 * GRAVITY / 32768.0, np.radians(0.07))
"""Size of one code, m/s² and rad/s."""

RANGE = (16.0 * GRAVITY, np.radians(2000.0))

CUTOFF = 1.0 / 3.0
"""Cutoff of the filter of second order, as a share of the sample rate."""


def readings(
    ideal: tuple[Array, Array], rate: float, seed: list[int], offset: float = 1.0, step: float = STEP
) -> tuple[Array, Array, Array]:
    """Times, accelerations and angular rates of ideal values at each `step`, s.

    `offset` scales the constant errors, which depend on `seed` alone, not on the rate."""
    random = np.random.default_rng(seed)
    filters = butter(2, CUTOFF * rate, fs=1.0 / step, output="sos")
    steps = np.arange(len(ideal[0]))
    t = np.arange(int(len(steps) * step * rate + 0.5)) / rate
    found = []
    for values, largest, noise, code, limit in zip(ideal, LARGEST_OFFSET, NOISE, CODE, RANGE, strict=True):
        error = largest * random.uniform(*OFFSET, 3) * random.choice([-1.0, 1.0], 3) * offset
        noisy = values + error + random.normal(0.0, noise * np.sqrt(0.5 / step), values.shape)
        noisy = np.clip(noisy, -limit, limit)
        state = sosfilt_zi(filters)[:, :, None] * noisy[0]
        smooth, _ = sosfilt(filters, noisy, axis=0, zi=state)
        at = np.stack([np.interp(t, steps * step, axis) for axis in smooth.T], axis=1)
        found.append(np.clip(np.round(at / code) * code, -limit, limit))
    return t, found[0], found[1]
