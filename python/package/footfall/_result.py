"""Estimates of a recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from ._footfall import AXES, FLAGS, STATES

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Finding:
    """An implausible property of a recording, such as wrong units."""

    name: str
    """Name for programs, from the list in ``docs/reference/formats.md``."""
    message: str
    """Sentence for people."""


@dataclass(frozen=True)
class Event:
    """A touch-down, a lift-off, or the start or end of a slip or of a stance that is never stable, as listed by
    ``footfall replay --events``."""

    kind: Literal["touch_down", "lift_off", "slip_start", "slip_end", "unstable_start", "unstable_end"]
    """Kind of the event."""
    t: float
    """Time of the event, s."""
    duration: float | None
    """Duration of the stance or slip that begins or ends here, s; ``None`` if its other end is unknown."""
    p_peak: float
    """Largest probability in that stance or slip, in [0, 1]."""
    distance: float | None
    """Distance of the slip along the ground, m; ``None`` for stances, if the slip has not ended, and if a sample in it
    was missing or doubtful."""


@dataclass(frozen=True, eq=False)
class Result:
    """One estimate for each of N samples. The caller owns all arrays."""

    t: npt.NDArray[np.float64]
    """Time of the sample, s, shape (N,)."""
    p_stable: npt.NDArray[np.float32]
    """Stable contact: the foot moves as little as in its stances. In [0, 1], shape (N,)."""
    p_tangential: npt.NDArray[np.float32]
    """No motion along the ground; with the preset ``"paper"`` also no turn about up. In [0, 1], shape (N,)."""
    p_vertical: npt.NDArray[np.float32]
    """No lifting; with the preset ``"paper"`` also no tilting. In [0, 1], shape (N,)."""
    p_axes: npt.NDArray[np.float32]
    """No motion along or about each axis of :data:`AXES`. In [0, 1], shape (N, 6)."""
    quaternion: npt.NDArray[np.float32]
    """Orientation w, x, y, z, Hamilton, foot → world, z up, heading arbitrary. Shape (N, 4)."""
    linear_acceleration: npt.NDArray[np.float32]
    """Acceleration without gravity in the frame of the foot, m/s², shape (N, 3)."""
    angular_rate: npt.NDArray[np.float32]
    """Angular rate without bias in the frame of the foot, rad/s, shape (N, 3)."""
    gyro_bias: npt.NDArray[np.float32]
    """Bias of the gyroscope in the frame of the foot, rad/s, shape (N, 3)."""
    sigma_v: npt.NDArray[np.float32]
    """Standard deviation of the foot's velocity about zero, each axis, m/s, above 0 and at most 100: a
    zero-velocity measurement of each sample. Shape (N,)."""
    state: npt.NDArray[np.uint8]
    """Index into :data:`STATES`; ``unknown`` without a load. Shape (N,)."""
    decision: npt.NDArray[np.bool_]
    """The debounced decision: stable or not. Shape (N,)."""
    flags: npt.NDArray[np.uint8]
    """Reasons to doubt: bit k is ``FLAGS[k]``. Shape (N,)."""
    rate: float
    """Sample rate, Hz."""
    findings: tuple[Finding, ...]
    """Implausible properties of the recording."""
    learnt: npt.NDArray[np.float32]
    """State learnt by the end; see :func:`calibrate` for a warm start. Empty if the estimates are recorded
    contacts."""
    edge: float
    """Learnt acceleration below which the foot is still, at the end, m/s². NaN if half-widths are set, or nothing is
    learnt."""
    first_gyro_bias: npt.NDArray[np.float32]
    """Bias of the gyroscope when it was first known, rad/s, shape (3,); empty if the foot was never at rest."""
    recording: str | None = None
    """Name of the recording, if any."""
    foot: str | None = None
    """Foot, if the file names it."""
    notices: tuple[str, ...] = ()
    """One sentence on everything in the file that was omitted or reinterpreted."""
    _events: tuple[Event, ...] = field(default=(), repr=False)

    @classmethod
    def _of(cls, arrays: dict[str, Any]) -> Result:
        findings = tuple(Finding(*finding) for finding in arrays.pop("findings"))
        for name in ("learnt", "first_gyro_bias"):
            arrays[name] = np.asarray(arrays[name], dtype=np.float32)
        events = tuple(Event(*event) for event in arrays.pop("events"))
        arrays["notices"] = tuple(arrays.get("notices", ()))
        return cls(**arrays, findings=findings, _events=events)

    def __len__(self) -> int:
        return len(self.p_stable)

    def __repr__(self) -> str:
        stable = 100.0 * float(np.mean(self.decision))
        return f"<footfall.Result: {len(self)} samples at {self.rate:g} Hz, {stable:.1f} % stable>"

    def has_flag(self, name: str) -> npt.NDArray[np.bool_]:
        """Returns a mask of the samples with a flag of :data:`FLAGS`, shape (N,)."""
        if name not in FLAGS:
            raise ValueError(f"flag is {name!r}, but one of {', '.join(FLAGS)} is expected")
        return np.asarray((self.flags >> FLAGS.index(name)) & 1, dtype=np.bool_)

    def state_names(self) -> npt.NDArray[np.str_]:
        """Returns the name of the state of each sample, shape (N,)."""
        return np.array(STATES)[self.state]

    def _columns(self) -> dict[str, npt.NDArray[Any]]:
        """Returns the columns of the program's table of estimates by their names there. The last one differs: flags are
        bits, and are named `flag_bits` because `flags` is an attribute of every pandas table."""
        columns: dict[str, npt.NDArray[Any]] = {
            "t": self.t,
            "p_stable": self.p_stable,
            "p_tangential": self.p_tangential,
            "p_vertical": self.p_vertical,
        }
        columns |= {f"p_{axis}": self.p_axes[:, k] for k, axis in enumerate(AXES)}
        for prefix, names, table in (
            ("q", "wxyz", self.quaternion),
            ("la", "xyz", self.linear_acceleration),
            ("bw", "xyz", self.gyro_bias),
        ):
            columns |= {prefix + name: table[:, k] for k, name in enumerate(names)}
        columns["sigma_v"] = self.sigma_v
        return columns | {"state": self.state, "decision": self.decision, "flag_bits": self.flags}

    def to_structured(self) -> npt.NDArray[np.void]:
        """Returns one structured array with the columns of the program's table, shape (N,)."""
        columns = self._columns()
        dtype = [(name, column.dtype) for name, column in columns.items()]
        structured = np.empty(len(self), dtype=dtype)
        for name, column in columns.items():
            structured[name] = column
        return structured

    def to_arrow(self) -> pyarrow.Table:
        """Returns an Arrow table with the columns of the program's table; needs ``footfall[arrow]``."""
        import pyarrow

        columns: dict[str, Any] = dict(self._columns())
        columns["state"] = pyarrow.DictionaryArray.from_arrays(self.state, list(STATES))
        return pyarrow.table(columns)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a pandas table with the columns of :meth:`to_arrow`; needs ``pandas``."""
        import pandas

        columns: dict[str, Any] = dict(self._columns())
        columns["state"] = pandas.Categorical.from_codes(self.state, categories=list(STATES))
        return pandas.DataFrame(columns)

    def to_polars(self) -> polars.DataFrame:
        """Returns a Polars table with the columns of :meth:`to_arrow`; needs ``polars``."""
        import polars

        columns: dict[str, Any] = dict(self._columns())
        columns["state"] = polars.Series(self.state_names(), dtype=polars.Enum(list(STATES)))
        return polars.DataFrame(columns)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the probability over time, and shades where the decision is stable; needs ``matplotlib``.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw in; by default a new figure.
        """
        if ax is None:
            from matplotlib import pyplot

            _, ax = pyplot.subplots(figsize=(10, 3), layout="constrained")
        ax.plot(self.t, self.p_stable, color="#009e73", linewidth=1.0, label="P stable")
        ax.fill_between(self.t, self.decision, step="post", alpha=0.15, color="k", linewidth=0.0, label="decision")
        ax.set(xlabel="time (s)", ylabel="probability", ylim=(-0.02, 1.02), title=self.foot or self.recording or "")
        ax.legend(loc="upper right")
        return ax

    def events(self) -> tuple[Event, ...]:
        """Returns touch-downs, lift-offs, and starts and ends of slips and unstable stances, in order of time."""
        return self._events
