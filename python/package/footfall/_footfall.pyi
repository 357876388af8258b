from typing import Any, final

import numpy as np
import numpy.typing as npt

from ._settings import ReadDict, RecordingDict, SettingsDict, WalkDict

__version__: str
FEATURES: list[str]
STATES: list[str]
FLAGS: list[str]
SENT_FLAGS: list[str]
AXES: list[str]
VALIDITIES: list[str]

@final
class Estimator:
    def __new__(cls, settings: SettingsDict) -> Estimator: ...
    def update(
        self,
        acc: tuple[float, float, float],
        gyr: tuple[float, float, float],
        t: float | None,
        load: float | None,
        validity: int,
    ) -> tuple[
        float,
        tuple[float, float, float],
        list[float],
        list[float],
        list[float],
        float,
        tuple[str, bool, list[str]],
    ]: ...
    def copy(self) -> Estimator: ...
    def batch_times(self, t: float, count: int) -> list[float]: ...
    def implausible_force(self) -> float | None: ...
    def events(self, ended: bool) -> list[tuple[str, float, float | None, float, float | None]]: ...
    def gyro_bias(self) -> tuple[float, float, float] | None: ...
    def learnt(self) -> list[float]: ...

def constants() -> list[tuple[str, float]]: ...
def p_stable(
    acc: npt.NDArray[np.float32],
    gyr: npt.NDArray[np.float32],
    rate: float,
    gravity_removed: bool,
    changed: list[tuple[str, float]],
) -> npt.NDArray[np.float32]: ...
def toml_of(json: str) -> str: ...
def estimate(recording: RecordingDict, settings: SettingsDict) -> dict[str, Any]: ...
def calibrate(recordings: list[RecordingDict], settings: SettingsDict) -> tuple[str, str]: ...
def decode_file(
    path: str, nodes: list[int], names: dict[int, str]
) -> tuple[dict[str, Any], str]: ...
def estimate_file(
    path: str, options: ReadDict, settings: SettingsDict, foot: str | None
) -> list[dict[str, Any]]: ...
def read(path: str, options: ReadDict) -> list[dict[str, Any]]: ...
def simulate(walk: WalkDict) -> dict[str, Any]: ...
def simulate_robot(walk: WalkDict) -> dict[str, Any]: ...
