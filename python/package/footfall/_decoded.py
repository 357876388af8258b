"""What feet have sent, as arrays."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _footfall
from ._footfall import SENT_FLAGS, STATES


@dataclass(frozen=True, eq=False)
class Decoded:
    """One row for each of N contacts that feet have sent, in the order of the file.

    Not a number stands where nothing was sent with that sample.
    """

    t: npt.NDArray[np.float64]
    """Time of the sample, s: on the serial line as the foot says it; on CAN in steps of 10 µs, from the
    start of the turn of the 16-bit clock in which the log begins. Shape (N,)."""
    t_received: npt.NDArray[np.float64]
    """On CAN, when the log received the frame, s on the log's own clock. Shape (N,)."""
    t_common: npt.NDArray[np.float64]
    """On CAN, one clock for all feet, that of the log, s. Shape (N,)."""
    by_sync: npt.NDArray[np.bool_]
    """Whether `t_common` is the time of the sample, by a SYNC; else it is `t_received`. Shape (N,)."""
    interface: npt.NDArray[np.int16]
    """The CAN interface that received it: index into `interfaces`, -1 without one. Shape (N,)."""
    interfaces: tuple[str, ...]
    """The interfaces of the log."""
    foot: npt.NDArray[np.int16]
    """The foot: index into `feet`, -1 where it has no name. Shape (N,)."""
    feet: tuple[str, ...]
    """The names of feet."""
    node: npt.NDArray[np.uint8]
    """The foot's node id, 1 to 127; 0 where it is not known. Shape (N,)."""
    segment: npt.NDArray[np.uint32]
    """How often the foot has started again before, which sets `t` and `sequence` back. Shape (N,)."""
    sequence: npt.NDArray[np.uint16]
    """The frame's sequence number, modulo 2⁸ on CAN, 2¹⁶ on the serial line. Shape (N,)."""
    p_stable: npt.NDArray[np.float32]
    """The foot does not move at all, in [0, 1], shape (N,)."""
    p_tangential: npt.NDArray[np.float32]
    """No motion along the ground and no turn about up, in [0, 1], shape (N,)."""
    p_vertical: npt.NDArray[np.float32]
    """No lifting and no tilting, in [0, 1], shape (N,)."""
    p_axes: npt.NDArray[np.float32]
    """No motion along or about each axis of :data:`footfall.AXES`, in [0, 1], shape (N, 6)."""
    quaternion: npt.NDArray[np.float32]
    """Orientation w, x, y, z, Hamilton, foot → world, z up. Shape (N, 4)."""
    linear_acceleration: npt.NDArray[np.float32]
    """Acceleration without gravity in the frame of the foot, m/s², shape (N, 3)."""
    angular_rate: npt.NDArray[np.float32]
    """Angular rate without bias in the frame of the foot, rad/s, shape (N, 3)."""
    gyro_bias: npt.NDArray[np.float32]
    """Bias of the gyroscope in the frame of the foot, rad/s, shape (N, 3)."""
    temperature: npt.NDArray[np.float32]
    """The sensor's, °C, shape (N,)."""
    state: npt.NDArray[np.uint8]
    """Index into :data:`footfall.STATES`, shape (N,)."""
    decision: npt.NDArray[np.bool_]
    """The debounced decision: stable or not. Shape (N,)."""
    flags: npt.NDArray[np.uint16]
    """Reasons to doubt: bit k stands for :data:`footfall.SENT_FLAGS` k. Shape (N,)."""
    report: dict[str, Any]
    """What came, what is missing and what could not be understood, as ``footfall decode --json`` says it;
    ``footfall schema decode`` describes it."""
    notices: tuple[str, ...]
    """One sentence on each thing that was passed over or assumed."""

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        feet = ", ".join(self.feet) or "a foot without a name"
        return f"<footfall.Decoded: {len(self)} rows of {feet}, {self.report['missing']} missing>"

    def of(self, foot: str) -> npt.NDArray[np.bool_]:
        """Which rows are of a foot, shape (N,).

        Raises
        ------
        ValueError
            No row is of a foot of this name; the message lists those that are.
        """
        if foot not in self.feet:
            raise ValueError(f"foot is {foot!r}, but one of {', '.join(self.feet)} is expected")
        return np.asarray(self.foot == self.feet.index(foot), dtype=np.bool_)

    def has_flag(self, name: str) -> npt.NDArray[np.bool_]:
        """Where a flag of :data:`footfall.SENT_FLAGS` is raised, shape (N,).

        Raises
        ------
        ValueError
            There is no such flag; the message lists all.
        """
        if name not in SENT_FLAGS:
            raise ValueError(f"flag is {name!r}, but one of {', '.join(SENT_FLAGS)} is expected")
        return np.asarray((self.flags >> SENT_FLAGS.index(name)) & 1, dtype=np.bool_)

    def state_names(self) -> npt.NDArray[np.str_]:
        """The state of each row by its name, shape (N,)."""
        return np.asarray(STATES)[self.state]


def decode(
    path: str | os.PathLike[str],
    *,
    nodes: Iterable[int] = (),
    names: Mapping[int, str] | None = None,
) -> Decoded:
    """Decodes what feet have sent, as ``footfall decode`` does.

    Parameters
    ----------
    path : path
        A log of candump or the bytes of a serial line, plain
        or compressed with gzip or zstd; its contents tell which.
    nodes : several int, 1 to 127
        On CAN, nodes that are feet beside those of the ids 0x11 to 0x16.
    names : mapping from int to str
        Names of feet by node id, of 1 to 32 letters, digits, hyphens and underscores, such as
        ``{1: "FL"}``; these nodes are feet.

    Raises
    ------
    ValueError
        The file is neither of the two, or an argument is out of its range. Damage within either is
        counted in the report and is no error.
    OSError
        It cannot be read.
    """
    arrays, report = _footfall.decode_file(os.fspath(path), list(nodes), dict(names or {}))
    for name in ("interfaces", "feet", "notices"):
        arrays[name] = tuple(arrays[name])
    return Decoded(**arrays, report=json.loads(report))
