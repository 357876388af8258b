"""Delays of an answer after touch-down and lift-off, and stances in which the answer is never "stable"."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from .sets import Array

Mask = npt.NDArray[np.bool_]

CHATTER = 0.01
"""Duration below which gaps in a contact are closed, s."""

STANCE = 0.1
"""Duration from which a contact is a stance, s."""

SWING = 0.05
"""Duration from which a gap between stances is a swing, s."""


@dataclass
class Stances:
    """Delays of any number of feet. A stance is lost if the answer is never "stable" in it."""

    count: int = 0
    lost: int = 0
    """By P > ½."""
    lost_decisions: int = 0
    rises: list[float] = field(default_factory=list)
    """Times from touch-down to P > ½, s; 0 if P is high already."""
    decides: list[float] = field(default_factory=list)
    """Times from touch-down to the decision, s."""
    falls: list[float] = field(default_factory=list)
    """Times from lift-off to P < ½, s; the whole swing if P stays high."""

    def add(self, contact: Mask, p: Array, decision: Mask, rate: float, since: float = 0.0) -> None:
        """Adds the stances that begin at `since`, s, or later."""
        high, first = p > 0.5, max(round(since * rate), 1)
        contacts = runs(closed(contact, rate))
        for k, (begin, end) in enumerate(contacts):
            if end - begin < STANCE * rate or begin < first:
                continue
            self.count += 1
            for answer, delays, is_decision in ((high, self.rises, False), (decision, self.decides, True)):
                where = np.flatnonzero(answer[begin:end])
                if len(where):
                    delays.append(float(where[0]) / rate)
                elif is_decision:
                    self.lost_decisions += 1
                else:
                    self.lost += 1
            following = contacts[k + 1][0] if k + 1 < len(contacts) else len(p)
            if high[begin:end].any() and following - end > SWING * rate:
                low = np.flatnonzero(~high[end:following])
                self.falls.append(float(low[0] if len(low) else following - end) / rate)

    def figures(self) -> dict[str, int | None]:
        """Counts, and medians and 90 % quantiles of the delays in whole milliseconds."""
        found: dict[str, int | None] = {"stances": self.count, "lost": self.lost, "lost_decisions": self.lost_decisions}
        for name, delays in (("rise", self.rises), ("decision", self.decides), ("fall", self.falls)):
            for key, quantile in ((f"{name}_ms", 0.5), (f"{name}_90_ms", 0.9)):
                found[key] = round(1e3 * float(np.quantile(delays, quantile))) if delays else None
        return found


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Begin and end of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def closed(mask: Mask, rate: float) -> Mask:
    """Contacts without the gaps that are shorter than `CHATTER`."""
    result = mask.copy()
    for begin, end in runs(~mask):
        if begin > 0 and end < len(mask) and end - begin < CHATTER * rate:
            result[begin:end] = True
    return result
