"""Motions of the robots of the bench, and their floors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .humanoid import Walk
from .quadruped import Command
from .world import GRAVITY

STANDS_FIRST = 1.2
"""Duration of the stand with which each plan begins, s."""


@dataclass(frozen=True)
class Motion:
    name: str
    floor: str
    seconds: float
    plan: Callable[[float, float], Command]
    """Command at a time, s, of a robot with a height, m."""
    ripple: float = 0.006
    """Ripple of the motors: standard deviation of the torque, as a share of 0.6 · weight · height."""

    def at(self, height: float) -> Callable[[float], Command]:
        return lambda t: Command() if t < STANDS_FIRST else self.plan(t, height)


def _trot(t: float, h: float, froude: float, since: float = STANDS_FIRST, **other: float) -> Command:
    speed = froude * np.sqrt(GRAVITY * h) * min(1.0, (t - since) / 2.0)
    return replace(Command("trot", speed, period=0.5 * np.sqrt(h / 0.32)), **other)  # type: ignore[arg-type]


def _fast(t: float, h: float) -> Command:
    return _trot(t, h, 0.36, period=0.42 * np.sqrt(h / 0.32), duty=0.54)


def _turns(t: float, h: float) -> Command:
    return _trot(t, h, 0.12, turn=0.6 * np.sin(2.0 * np.pi * t / 12.0) / np.sqrt(h / 0.32))


def _slippery(t: float, h: float) -> Command:
    push = 0.1 * np.sign(np.sin(2.1 * t)) if t > 3.0 and (t / 0.83) % 1.0 < 0.2 else 0.0
    faster = 1.0 + 0.35 * np.sin(2.0 * np.pi * t / 2.6)
    command = _trot(t, h, 0.2, push=push)
    return replace(command, speed=command.speed * faster, harness=True)


def _crawl(t: float, h: float) -> Command:
    k = np.sqrt(h / 0.32)
    return Command("crawl", 0.03 * np.sqrt(GRAVITY * h), period=4.0 * 0.95 * k, clearance=0.25)


def _moves(t: float, _: float) -> Command:
    """Moves the body by a tenth of its height, at 0.3 to 0.8 Hz."""

    def wave(size: float, hertz: float, phase: float = 0.0) -> float:
        return float(size * np.sin(2.0 * np.pi * hertz * t + phase))

    grows = min(1.0, (t - STANDS_FIRST) / 2.0)
    offset = (wave(0.07, 0.4) * grows, wave(0.09, 0.3, 0.5) * grows, wave(0.05, 0.61) * grows)
    return Command(offset=offset, tilt=(wave(0.07, 0.5, 1.0) * grows, wave(0.05, 0.83) * grows))


def _mixed(t: float, h: float) -> Command:
    """Trots, stands, moves its body, stands, and trots again."""
    if t < 7.0 or t >= 19.0:
        return _trot(t, h, 0.15, since=STANDS_FIRST if t < 7.0 else 19.0)
    return _moves(t - 8.0 + STANDS_FIRST, h) if 8.0 <= t < 16.0 else Command()


def _carried(t: float, begins: float, ends: float, lift: float, rise: float, shake: float) -> Command:
    """Lifted by `lift` m within `rise` s, and put down as slowly."""
    if not begins <= t < ends:
        return Command()
    up = min(_smooth((t - begins) / rise), _smooth((ends - t) / rise))
    # Tremor and sway of a hand, or the swing of a crane's load.
    sway = [shake * np.sin(2.0 * np.pi * hertz * (t - begins)) for hertz in (0.7, 1.1, 1.7, 0.9, 1.3)]
    return Command(
        carried=(lift * up + sway[2] * 0.2 * up, sway[0] * up, sway[1] * up, sway[3] * 2.0 * up, sway[4] * 2.0 * up)
    )


def _by_hand(t: float, h: float) -> Command:
    if t < 7.0:
        return _trot(t, h, 0.15)
    return _carried(t, 9.0, 16.0, 0.8 * h, 0.7, 0.05)


def _by_crane(t: float, h: float) -> Command:
    if t < 7.0:
        return _trot(t, h, 0.15)
    return _carried(t, 9.0, 19.0, 0.8 * h, 3.5, 0.008)


def _smooth(part: float) -> float:
    part = min(max(part, 0.0), 1.0)
    return part * part * (3.0 - 2.0 * part)


MOTIONS = [
    Motion("trot", "firm", 14.0, lambda t, h: _trot(t, h, 0.15)),
    Motion("fast trot", "firm", 12.0, _fast),
    Motion("turns", "firm", 14.0, _turns),
    Motion("rough", "rough", 14.0, lambda t, h: _trot(t, h, 0.12, clearance=0.35)),
    Motion("steps", "steps", 14.0, lambda t, h: _trot(t, h, 0.1, clearance=0.4)),
    Motion("soft", "soft", 12.0, lambda t, h: _trot(t, h, 0.15, clearance=0.25)),
    Motion("slippery", "slippery", 16.0, _slippery),
    Motion("crawl", "firm", 20.0, _crawl),
    Motion("stand", "firm", 8.0, lambda t, h: Command()),
    Motion("stand, ripple", "firm", 8.0, lambda t, h: Command(), ripple=0.02),
    Motion("stand and move", "firm", 16.0, _moves),
    Motion("trot, stand and move, trot", "firm", 24.0, _mixed),
    Motion("picked up by hand", "firm", 18.0, _by_hand),
    Motion("lifted by a crane", "firm", 20.0, _by_crane),
    Motion("a minute on firm and slippery ground", "slippery", 61.0, _slippery),
]

WALKS: dict[str, tuple[str, Walk, float]] = {
    "walk": ("firm", Walk(14.0, 0.04), 0.05),
    "fast walk": ("firm", Walk(12.0, 0.06, 0.45), 0.05),
    "turns": ("firm", Walk(14.0, 0.03, turn=0.08), 0.05),
    "soft": ("soft", Walk(12.0, 0.04), 0.05),
    "stand": ("firm", Walk(8.0), 0.05),
    "stand, ripple": ("firm", Walk(8.0), 0.15),
    "stand and move": ("firm", Walk(16.0, moves=0.1), 0.05),
    "walk, stand and move, walk": ("firm", Walk(24.0, 0.04, moves=0.1, pause=(7.0, 17.0)), 0.05),
    "picked up by hand": ("firm", Walk(18.0, 0.04, lifted=(9.0, 15.0, 0.2, 0.7, 0.04)), 0.05),
    "lifted by a crane": ("firm", Walk(20.0, 0.04, lifted=(9.0, 18.0, 0.2, 3.5, 0.006)), 0.05),
}
"""Floor, walk and ripple of each motion of the humanoid."""
