"""The arguments that set the estimator, in the form that the Rust part takes."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, Literal, TypedDict, Union

import numpy as np
import numpy.typing as npt

from . import _footfall

Preset = Literal["default", "paper"]
Gravity = Literal["included", "removed"]
Config = Union[Mapping[str, Any], str, "os.PathLike[str]"]


class SettingsDict(TypedDict):
    """The arguments that set the estimator."""

    preset: str
    config: tuple[str, str] | None
    gravity: str | None
    rate: float | None
    format: str | None


class RecordingDict(TypedDict):
    """The arrays of a recording."""

    acc: npt.NDArray[np.floating]
    gyr: npt.NDArray[np.floating]
    t: npt.NDArray[np.floating] | None
    load: npt.NDArray[np.floating] | None
    validity: npt.NDArray[np.uint8] | None

class ReadDict(TypedDict):
    """The options of reading a file."""

    format: str | None
    rate: float | None
    gravity: str | None
    map: str | None
    units: str | None
    time_unit: str | None
    times: str | None


def settings(
    preset: str,
    config: Config | None,
    gravity: str | None,
    rate: float | None,
    format: str | None = None,
) -> SettingsDict:
    """Collects the arguments; the Rust part checks them."""
    return {
        "preset": preset,
        "config": _text(config),
        "gravity": gravity,
        "rate": None if rate is None else float(rate),
        "format": format,
    }


def _text(config: Config | None) -> tuple[str, str] | None:
    if config is None:
        return None
    if isinstance(config, Mapping):
        return "config", _footfall.toml_of(json.dumps(config))
    path = os.fspath(config)
    with open(path, encoding="utf-8") as file:
        return path, file.read()
