"""What the estimator says of a recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from ._footfall import AXES, FLAGS, STATES
from ._words import with_arguments

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Finding:
    """One thing about a recording that is not plausible, such as wrong units."""

    name: str
    """Its name, for programs: one of the list in ``docs/formats.md``."""
    message: str
    """The sentence for people."""


@dataclass(frozen=True)
class Event:
    """A touch-down, a lift-off, or where a slip or a stance that is never stable begins or ends, as ``footfall replay --events`` has it."""

    kind: Literal["touch_down", "lift_off", "slip_start", "slip_end", "unstable_start", "unstable_end"]
    """What it was."""
    t: float
    """When it was, s."""
    duration: float | None
    """Of the stance or slip that begins or ends here, s; ``None`` where its other end is not known."""
    p_peak: float
    """The largest probability in that stance or slip, in [0, 1]."""
    distance: float | None
    """Of the slip, along the ground, m; ``None`` for stances, where the slip has not ended, and where a
    sample in it was missing or in doubt."""


@dataclass(frozen=True, eq=False)
class Result:
    """One estimate for each of N samples. All arrays belong to the caller."""

    t: npt.NDArray[np.float64]
    """Time of the sample, s, shape (N,)."""
    p_stable: npt.NDArray[np.float32]
    """The foot does not move at all: stable contact. In [0, 1], shape (N,)."""
    p_tangential: npt.NDArray[np.float32]
    """No motion along the ground and no turn about up. In [0, 1], shape (N,)."""
    p_vertical: npt.NDArray[np.float32]
    """No lifting and no tilting. In [0, 1], shape (N,)."""
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
    """Reasons to doubt: bit k stands for ``FLAGS[k]``. Shape (N,)."""
    rate: float
    """Sample rate, Hz."""
    findings: tuple[Finding, ...]
    """What is not plausible about the recording."""
    learnt: npt.NDArray[np.float32]
    """What the estimator has learnt by the end; see :func:`calibrate` for a warm start. Empty where the
    estimates are recorded contacts."""
    edge: float
    """Acceleration below which this foot is still by the end, as learnt, m/s². Not a number where half-widths are
    set, or nothing is learnt."""
    first_gyro_bias: npt.NDArray[np.float32]
    """Bias of the gyroscope when it was first known, rad/s, shape (3,); empty where the foot never was at rest."""
    recording: str | None = None
    """The name of the recording, where it has one."""
    foot: str | None = None
    """The foot, where the file names it."""
    notices: tuple[str, ...] = ()
    """One sentence on each thing of the file that was left out or reinterpreted."""
    _events: tuple[Event, ...] = field(default=(), repr=False)

    @classmethod
    def _of(cls, arrays: dict[str, Any]) -> Result:
        findings = tuple(
            Finding(name, with_arguments(message)) for name, message in arrays.pop("findings")
        )
        for name in ("learnt", "first_gyro_bias"):
            arrays[name] = np.asarray(arrays[name], dtype=np.float32)
        events = tuple(Event(*event) for event in arrays.pop("events"))
        arrays["notices"] = tuple(map(with_arguments, arrays.get("notices", ())))
        return cls(**arrays, findings=findings, _events=events)

    def __len__(self) -> int:
        return len(self.p_stable)

    def __repr__(self) -> str:
        stable = 100.0 * float(np.mean(self.decision))
        return f"<footfall.Result: {len(self)} samples at {self.rate:g} Hz, {stable:.1f} % stable>"

    def has_flag(self, name: str) -> npt.NDArray[np.bool_]:
        """Where a flag of :data:`FLAGS` is raised, shape (N,)."""
        if name not in FLAGS:
            raise ValueError(f"flag is {name!r}, but one of {', '.join(FLAGS)} is expected")
        return np.asarray((self.flags >> FLAGS.index(name)) & 1, dtype=np.bool_)

    def state_names(self) -> npt.NDArray[np.str_]:
        """The state of each sample by its name, shape (N,)."""
        return np.array(STATES)[self.state]

    def _columns(self) -> dict[str, npt.NDArray[Any]]:
        """The columns of the program's table of estimates, by their names there, but for the
        last: flags are bits here, and `flags` is an attribute of every table of pandas."""
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
        """One structured array with the columns of the program's table, shape (N,)."""
        columns = self._columns()
        dtype = [(name, column.dtype) for name, column in columns.items()]
        structured = np.empty(len(self), dtype=dtype)
        for name, column in columns.items():
            structured[name] = column
        return structured

    def to_arrow(self) -> pyarrow.Table:
        """A table of Arrow with the columns of the program's table; needs ``footfall[arrow]``."""
        import pyarrow

        columns: dict[str, Any] = dict(self._columns())
        columns["state"] = pyarrow.DictionaryArray.from_arrays(self.state, list(STATES))
        return pyarrow.table(columns)

    def to_pandas(self) -> pandas.DataFrame:
        """A table of pandas with the columns of :meth:`to_arrow`; needs ``pandas``."""
        import pandas

        columns: dict[str, Any] = dict(self._columns())
        columns["state"] = pandas.Categorical.from_codes(self.state, categories=list(STATES))
        return pandas.DataFrame(columns)

    def to_polars(self) -> polars.DataFrame:
        """A table of Polars with the columns of :meth:`to_arrow`; needs ``polars``."""
        import polars

        columns: dict[str, Any] = dict(self._columns())
        columns["state"] = polars.Series(self.state_names(), dtype=polars.Enum(list(STATES)))
        return polars.DataFrame(columns)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the probability over time, and shades where the decision is stable; needs ``matplotlib``.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; else a new figure.
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
        """Touch-downs, lift-offs, and where slips begin and end, in order of time."""
        return self._events
