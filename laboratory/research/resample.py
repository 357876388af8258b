"""Conversion of a recording to another sample rate.

| to | values | label |
|---|---|---|
| a higher rate | linear interpolation between the samples on both sides | of the sample before |
| a lower rate | weighted mean, Hann window two new periods long | of the sample before |

The window attenuates by 6 dB at half the new rate and has a zero at the new rate. It has no negative weights, so a
landing does not ring in the samples before it. Times may be uneven; a gap is bridged like any other step.
"""

from __future__ import annotations

from dataclasses import replace

import footfall
import numpy as np

SAME_RATE = 0.01
"""Relative difference below which rates are treated as equal."""


def resample(recording: footfall.Recording, rate: float) -> footfall.Recording:
    """Converts a recording to `rate`, Hz, from its first sample to its last."""
    if abs(rate / recording.rate - 1.0) < SAME_RATE:
        return recording
    assert recording.label is not None
    # Times are whole microseconds.
    old = np.round((recording.t - recording.t[0]) * 1e6)
    period = 1e6 / rate
    new = np.round(np.arange(int(old[-1] / period) + 1) * period)
    before = np.searchsorted(old, new, side="right") - 1
    readings = np.hstack([recording.acc, recording.gyr]).astype(np.float64)
    values = np.stack([np.interp(new, old, column) for column in readings.T], axis=1)
    if rate < recording.rate:
        first = np.searchsorted(old, new - period, side="right")
        count = np.searchsorted(old, new + period, side="left") - first
        near = first[:, None] + np.arange(count.max())
        is_near = near < (first + count)[:, None]
        near = np.minimum(near, len(old) - 1)
        away = np.abs(old[near] - new[:, None]) / period
        weight = np.where(is_near, 0.5 + 0.5 * np.cos(np.pi * away), 0.0)
        total = weight.sum(axis=1)
        means = np.einsum("nk,nka->na", weight, readings[near]) / np.maximum(total, 1e-300)[:, None]
        values = np.where(total[:, None] > 0.0, means, values)
        # A doubtful sample makes the mean doubtful.
        validity = np.where(weight > 0.0, recording.validity[near], 0).max(axis=1)
    else:
        after = np.minimum(before + (old[before] < new), len(old) - 1)
        validity = np.maximum(recording.validity[before], recording.validity[after])
    return replace(
        recording,
        rate=rate,
        t=new / 1e6,
        acc=values[:, :3].astype(np.float32),
        gyr=values[:, 3:].astype(np.float32),
        load=None,
        label=recording.label[before],
        validity=validity.astype(np.uint8),
    )
