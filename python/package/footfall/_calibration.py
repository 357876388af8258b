"""What a foot teaches, for a warm start."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from . import _footfall
from ._recording import Recording
from ._settings import Config, Preset, settings
from ._words import arguments_in_errors


@dataclass(frozen=True)
class Calibration:
    """What recordings of a foot teach."""

    config: dict[str, Any]
    """The keys of a configuration that starts warm: give it as `config` to an estimate."""
    report: dict[str, Any]
    """What it rests on: amplitudes at rest and in motion, time in stance and swing."""


def calibrate(
    recordings: Recording | Iterable[Recording],
    *,
    preset: Preset = "default",
    config: Config | None = None,
) -> Calibration:
    """Lets the estimator learn a foot in advance, as ``footfall calibrate`` does.

    Neither labels nor the load are used.

    Parameters
    ----------
    recordings : Recording or several
        Of one foot that walks.
    preset, config
        As of :func:`footfall.estimate`.

    Raises
    ------
    ValueError
        The recordings show too little, or rest and motion do not differ in them.
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
    chosen = settings(preset, config, first.gravity, None, first.axes, first.format)
    arrays = [recording._arrays() for recording in several]
    with arguments_in_errors():
        keys, report = _footfall.calibrate(arrays, chosen)
    return Calibration(config=json.loads(keys), report=json.loads(report))
