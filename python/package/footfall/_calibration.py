"""Calibration of a foot from recordings, for a warm start."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from . import _footfall
from ._recording import Recording
from ._settings import Config, Preset, RecordingDict, SettingsDict, settings


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration."""

    config: dict[str, Any]
    """Keys of the given configuration with the learnt ones, for a warm start: pass it as `config` to an estimate."""
    report: dict[str, Any]
    """Basis of the result: amplitudes at rest and in motion, time in stance and swing."""


def calibrate(
    recordings: Recording | Iterable[Recording],
    *,
    preset: Preset = "default",
    config: Config | None = None,
) -> Calibration:
    """Learns a foot in advance, as ``footfall calibrate`` does. Labels and load are not used.

    Parameters
    ----------
    recordings : Recording or several
        Recordings of one walking foot.
    preset, config
        As in :func:`footfall.estimate`.

    Raises
    ------
    ValueError
        The recordings hold too little stance or swing, or rest and motion do not differ in them.
    """
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not several:
        raise ValueError("recordings is empty: there is nothing to learn from")
    gravities = {recording.gravity for recording in several}
    if len(gravities) > 1:
        raise ValueError("recordings have gravity included in some and removed in others")
    first = several[0]
    if any(recording.axes != first.axes for recording in several):
        raise ValueError("recordings differ in their axes")
    chosen = settings(
        preset, config, gravity=first.gravity, rate=None, axes=first.axes, format=first.format
    )
    return learn([recording._arrays() for recording in several], chosen)


def learn(recordings: list[RecordingDict], chosen: SettingsDict) -> Calibration:
    """Learns a foot from recordings in the form that the Rust part takes."""
    keys, report = _footfall.calibrate(recordings, chosen)
    return Calibration(config=json.loads(keys), report=json.loads(report))
