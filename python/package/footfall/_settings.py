"""Arguments in the form that the Rust part reads."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, Union

import numpy as np
import numpy.typing as npt

from . import _footfall

Preset = Literal["default", "paper"]
Gravity = Literal["included", "removed"]
TimeUnit = Literal["s", "ms", "100us", "us", "ns"]
Times = Literal["auto", "keep", "drop-bad", "smooth", "rate"]
Config = Union[Mapping[str, Any], str, "os.PathLike[str]"]


class SettingsDict(TypedDict):
    """Settings of the estimator."""

    preset: str
    config: tuple[str, str] | None
    gravity: str | None
    rate: float | None
    axes: str | None
    format: str | None
    units: str | None


class RecordingDict(TypedDict):
    """Arrays of a recording."""

    acc: npt.NDArray[np.floating]
    gyr: npt.NDArray[np.floating]
    t: npt.NDArray[np.floating] | None
    load: npt.NDArray[np.floating] | None
    validity: npt.NDArray[np.uint8] | None


class ReadDict(TypedDict):
    """Options of reading a file."""

    format: str | None
    rate: float | None
    gravity: str | None
    topic: list[str]
    not_topic: list[str]
    frame: list[str]
    load_topic: list[str]
    rename: list[str]
    map: str | None
    units: str | None
    scale: str | None
    decimal: str | None
    time_unit: str | None
    times: str | None
    estimate_again: bool


class WalkDict(TypedDict):
    """Simulated walk."""

    gait: str
    seconds: float
    seed: int
    ground: str
    greased: float
    step_length: float
    shaking: float
    rests: tuple[float, float] | None
    warming: float
    gyro_drift: tuple[float, float, float]


def settings(
    preset: str,
    config: Config | None,
    *,
    gravity: str | None,
    rate: float | None,
    axes: str | None,
    format: str | None = None,
    units: str | None = None,
) -> SettingsDict:
    """Collects the arguments; the Rust part checks them."""
    return {
        "preset": preset,
        "config": config_text(config),
        "gravity": gravity,
        "rate": None if rate is None else float(rate),
        "axes": axes,
        "format": format,
        "units": units,
    }


def read_options(
    *,
    format: str | None,
    rate: float | None,
    gravity: str | None,
    topic: str | Sequence[str] | None,
    not_topic: str | Sequence[str] | None,
    frame: str | Sequence[str] | None,
    load_topic: str | Sequence[str] | None,
    rename: str | Mapping[str, str] | None,
    map: str | Mapping[str, str] | None,
    units: str | None,
    scale: tuple[float, float] | tuple[float, float, float] | None,
    decimal: str | None,
    time_unit: str | None,
    times: str | None,
    estimate_again: bool = False,
) -> ReadDict:
    """Collects the options of reading a file; the Rust part checks them."""
    if isinstance(map, Mapping):
        map = _pairs(map)
    if isinstance(rename, Mapping):
        rename = _pairs(rename)
    return {
        "format": format,
        "rate": None if rate is None else float(rate),
        "gravity": gravity,
        "topic": _several(topic),
        "not_topic": _several(not_topic),
        "frame": _several(frame),
        "load_topic": _several(load_topic),
        "rename": [] if rename is None else rename.split(","),
        "map": map,
        "units": units,
        "scale": None if scale is None else ",".join(repr(float(factor)) for factor in scale),
        "decimal": decimal,
        "time_unit": time_unit,
        "times": times,
        "estimate_again": estimate_again,
    }


def _pairs(mapping: Mapping[str, str]) -> str:
    return ",".join(f"{ours}={theirs}" for ours, theirs in mapping.items())


def _several(names: str | Sequence[str] | None) -> list[str]:
    if names is None:
        return []
    return [names] if isinstance(names, str) else list(names)


def config_text(config: Config | tuple[str, str] | None) -> tuple[str, str] | None:
    """Returns the name of a configuration and its text; a configuration that was read before is returned unchanged."""
    if config is None or isinstance(config, tuple):
        return config
    if isinstance(config, Mapping):
        return "config", _footfall.toml_of(json.dumps(config))
    path = os.fspath(config)
    with open(path, encoding="utf-8") as file:
        return path, file.read()
