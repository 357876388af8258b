"""Decoded output of feet, as arrays."""

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
    """One row for each of N contacts sent by feet, in the order of the file.

    Values that were not sent with a contact are NaN.
    """

    t: npt.NDArray[np.float64]
    """Time of the sample, s: on a serial line the foot's own time; on CAN in steps of 10 µs, counted from the
    last overflow of the foot's 16-bit clock before the log begins. Shape (N,)."""
    t_received: npt.NDArray[np.float64]
    """On CAN, time of reception of the frame on the log's clock, s. Shape (N,)."""
    t_common: npt.NDArray[np.float64]
    """On CAN, time on the log's clock, which all feet share, s. Shape (N,)."""
    by_sync: npt.NDArray[np.bool_]
    """Whether `t_common` is the time of the sample, by a SYNC; else it is `t_received`. Shape (N,)."""
    interface: npt.NDArray[np.int16]
    """CAN interface that received the frame: index into `interfaces`, -1 without one. Shape (N,)."""
    interfaces: tuple[str, ...]
    """The interfaces of the log."""
    foot: npt.NDArray[np.int16]
    """Foot: index into `feet`, -1 if it has no name. Shape (N,)."""
    feet: tuple[str, ...]
    """The names of feet."""
    node: npt.NDArray[np.uint8]
    """Node id of the foot, 1 to 127; 0 if unknown. Shape (N,)."""
    segment: npt.NDArray[np.uint32]
    """Number of restarts of the foot so far; a restart resets `t` and `sequence`. Shape (N,)."""
    sequence: npt.NDArray[np.uint16]
    """The frame's sequence number, modulo 2⁸ on CAN, 2¹⁶ on the serial line. Shape (N,)."""
    p_stable: npt.NDArray[np.float32]
    """Stable contact: the foot moves as little as in its stances. In [0, 1], shape (N,)."""
    p_tangential: npt.NDArray[np.float32]
    """No motion along the ground; with the preset ``"paper"`` also no turn about up. In [0, 1], shape (N,)."""
    p_vertical: npt.NDArray[np.float32]
    """No lifting; with the preset ``"paper"`` also no tilting. In [0, 1], shape (N,)."""
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
    """Temperature of the sensor, °C, shape (N,)."""
    state: npt.NDArray[np.uint8]
    """Index into :data:`footfall.STATES`, shape (N,)."""
    decision: npt.NDArray[np.bool_]
    """The debounced decision: stable or not. Shape (N,)."""
    flags: npt.NDArray[np.uint16]
    """Reasons to doubt: bit k is flag k of :data:`footfall.SENT_FLAGS`. Shape (N,)."""
    report: dict[str, Any]
    """Counts of frames, missing frames and problems, as in ``footfall decode --json``; ``docs/reference/formats.md``
    describes the fields."""
    notices: tuple[str, ...]
    """One sentence on everything that was skipped or assumed."""

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        feet = ", ".join(self.feet) or "a foot without a name"
        return f"<footfall.Decoded: {len(self)} rows of {feet}, {self.report['missing']} missing>"

    def of(self, foot: str) -> npt.NDArray[np.bool_]:
        """Returns a mask of the rows of a foot, shape (N,).

        Raises
        ------
        ValueError
            No row is of a foot of this name; the message lists the names that occur.
        """
        if foot not in self.feet:
            raise ValueError(f"foot is {foot!r}, but one of {', '.join(self.feet)} is expected")
        return np.asarray(self.foot == self.feet.index(foot), dtype=np.bool_)

    def has_flag(self, name: str) -> npt.NDArray[np.bool_]:
        """Returns a mask of the rows in which a flag of :data:`footfall.SENT_FLAGS` is raised, shape (N,).

        Raises
        ------
        ValueError
            There is no such flag; the message lists all.
        """
        if name not in SENT_FLAGS:
            raise ValueError(f"flag is {name!r}, but one of {', '.join(SENT_FLAGS)} is expected")
        return np.asarray((self.flags >> SENT_FLAGS.index(name)) & 1, dtype=np.bool_)

    def state_names(self) -> npt.NDArray[np.str_]:
        """Returns the name of the state of each row, shape (N,)."""
        return np.asarray(STATES)[self.state]


def decode(
    path: str | os.PathLike[str],
    *,
    nodes: Iterable[int] = (),
    names: Mapping[int, str] | None = None,
) -> Decoded:
    """Decodes the output of feet, as ``footfall decode`` does.

    Parameters
    ----------
    path : path
        A log of candump or the bytes of a serial line, plain or compressed with gzip or zstd; the format is
        recognised by the contents.
    nodes : several int, 1 to 127
        On CAN, nodes that are feet in addition to ids 0x11 to 0x16.
    names : mapping from int to str
        Names of feet by node id, of 1 to 32 letters, digits, hyphens and underscores, such as
        ``{1: "FL"}``; these nodes count as feet.

    Raises
    ------
    ValueError
        The file has neither format, or an argument is out of its range. Damage within a file is counted in
        the report and is not an error.
    OSError
        The file cannot be read.
    """
    arrays, report = _footfall.decode_file(os.fspath(path), list(nodes), dict(names or {}))
    for name in ("interfaces", "feet", "notices"):
        arrays[name] = tuple(arrays[name])
    return Decoded(**arrays, report=json.loads(report))
