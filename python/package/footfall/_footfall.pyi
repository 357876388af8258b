from typing import Any, final

from ._settings import ReadDict, RecordingDict, SettingsDict

__version__: str
STATES: list[str]
FLAGS: list[str]
AXES: list[str]

@final
class Estimator:
    def __new__(cls, settings: SettingsDict) -> Estimator: ...
    def update(
        self,
        acc: tuple[float, float, float],
        gyr: tuple[float, float, float],
        t: float | None,
        load: float | None,
    ) -> tuple[
        float,
        tuple[float, float, float],
        list[float],
        list[float],
        list[float],
        tuple[str, bool, list[str]],
    ]: ...

def toml_of(json: str) -> str: ...
def estimate(recording: RecordingDict, settings: SettingsDict) -> dict[str, Any]: ...
def calibrate(recordings: list[RecordingDict], settings: SettingsDict) -> tuple[str, str]: ...
def read(path: str, options: ReadDict) -> list[dict[str, Any]]: ...
def simulate(gait: str, ground: str, seconds: float, seed: int) -> dict[str, Any]: ...
