"""Sets of recordings with labels, and their families.

A set is scored as one: the samples of its recordings together. Sets of a family share robots, sensors or the
definition of their label, so a constant tuned on one of them says little about others.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import footfall
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
DATASETS = ROOT / os.environ.get("FOOTFALL_DATASETS", "../shared/datasets")

WEIGHT_QUANTILE = 0.95
"""Quantile of the load that is taken as the robot's weight: in single support a foot bears all of it, and the load
exceeds the weight at every bounce. It is computed without labels."""

SHOE = [
    f"pyshoe/2017-11-22-11-{time}.csv"
    for time in (
        "22-03", "22-46", "23-25", "25-20", "26-05", "26-46", "27-30", "28-03", "28-39", "30-14", "35-59", "36-45",
    )
]  # fmt: skip

SETS: dict[str, tuple[str, list[str]]] = {
    "ground": ("ATLAS", ["pce/ATLAS_01ground.csv"]),
    "3 steps": ("ATLAS", ["pce/ATLAS_01ground_3steps.csv"]),
    "slip": ("ATLAS", ["pce/ATLAS_01ground_003slip.csv"]),
    "ATLAS 7k": ("LCD", ["lcd/ATLAS_7k_04ground.csv"]),
    "NAO": ("LCD", ["lcd/NAO_05ground.csv"]),
    "shoe": ("shoe", SHOE),
    "demo": ("simulated", ["demo"]),
    "walk": ("simulated", ["walk"]),
    "trot": ("simulated", ["trot"]),
    "run": ("simulated", ["run"]),
    "ATLAS 500 Hz": (
        "ATLAS",
        ["robots/atlas500/atlas_500hz_01ground.csv", "robots/atlas500/atlas_500hz_03ground.csv"],
    ),
    "TALOS": ("robots", ["robots/talos/talos1.csv"]),
    "real NAO": ("robots", ["robots/nao/nao_L.csv"]),
    "GO1": ("robots", ["robots/go1/REALgo1.csv", "robots/go1/normal_surface.csv"]),
    # The force of the left leg is doubtful.
    "pushed NAO": ("robots", ["robots/nao_gem/1_r.csv", "robots/nao_gem/2_r.csv"]),
}
"""Family and recordings of each set: files in the folder of datasets, and gaits of the simulated foot."""

FURTHER: dict[str, tuple[str, list[str]]] = {
    "TALOS in Gazebo": (
        "robots", ["more/gazebo_talos/talos_training_l.csv", "more/gazebo_talos/talos_training_r.csv"],
    ),
    "ATLAS 500 Hz, 0.2": ("ATLAS", ["more/atlas500_02/atlas_500hz_02ground.csv"]),
    "GO1 on WD-40": ("robots", ["more/go1_wd40/wd40_extra.csv"]),
    "NAO in place": ("robots", ["more/nao_walk_in_place/walkInPlaceLong_nao_r.csv"]),
}  # fmt: skip
"""Sets that the search of the constants did not use. Parts and alternatives were judged by them."""

WALKERS: dict[str, tuple[str, list[str]]] = {
    "walkers with motion capture": ("walkers", ["walkers/mocap/left.csv", "walkers/mocap/right.csv"]),
}
"""Sets of a person's feet that the search of the constants did not use. Parts and alternatives were judged by them."""

AVERAGED = ["ground", "3 steps", "slip", "ATLAS 7k", "NAO", "shoe", "demo"]
"""Sets in the mean. More gaits of the simulated foot would outweigh all other recordings."""

ROBOTS = ["TALOS", "real NAO", "GO1", "pushed NAO"]
"""Sets of real robots, which have a mean of their own."""

POOLS = {"ATLAS": ["ground", "3 steps", "slip"], "LCD": ["ATLAS 7k", "NAO"]}
"""Sets whose samples are also scored together."""

NO_TEACHER = {"ATLAS 500 Hz", *ROBOTS}
"""Sets whose labels tune no method for other families: those of real robots mean "loaded", and the runs at 500 Hz
have spikes in their stances."""


@dataclass(frozen=True, eq=False)
class Labelled:
    """A recording with labels."""

    set: str
    family: str
    recording: footfall.Recording
    wrench: Array | None = None
    """Force in N and torque in N m in the ankle, shape (N, 6), where there is a sensor for them."""

    @property
    def acc(self) -> Array:
        """The acceleration as recorded, with gravity if the recording includes it."""
        return self.recording.acc.astype(np.float64)

    @property
    def gyr(self) -> Array:
        return self.recording.gyr.astype(np.float64)

    @property
    def label(self) -> npt.NDArray[np.int8]:
        """1 stable, 0 not, -1 not known."""
        assert self.recording.label is not None
        return self.recording.label

    @property
    def load_share(self) -> Array | None:
        """Vertical force as a share of the robot's weight."""
        if self.wrench is None:
            return None
        force = self.wrench[:, 2]
        return np.asarray(force / np.sort(force)[int(WEIGHT_QUANTILE * len(force))])

    def samples_in(self, seconds: float) -> int:
        return max(1, int(seconds * self.recording.rate + 0.5))


def load(names: Iterable[str] = SETS) -> list[Labelled]:
    """Reads or simulates the recordings of sets."""
    return [Labelled(name, SETS[name][0], *_read(source)) for name in names for source in SETS[name][1]]


def _read(source: str) -> tuple[footfall.Recording, Array | None]:
    """Returns a recording, and the wrench of a simulated robot."""
    if not source.endswith(".csv"):
        return footfall.simulate(source, seconds=30.0, seed=1), None
    path = DATASETS / source
    robot = {"pce": "pce-atlas", "lcd": "lcd"}.get(source.split("/")[0])
    if robot is not None:
        [recording] = footfall.read(path, format=robot)
        return recording, np.loadtxt(path, delimiter=",", usecols=range(6))
    removed = (path.parent / "gravity_removed").exists()
    [recording] = footfall.read(path, format="csv", gravity="removed" if removed else "included")
    return recording, None
