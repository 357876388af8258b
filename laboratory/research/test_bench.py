"""Figures of the bench that could be wrong without looking wrong."""

from __future__ import annotations

import footfall
import numpy as np

from .bench import humanoid, judged, sensor
from .bench.recorded import Foot
from .bench.world import GRAVITY, STEP
from .delays import Mask, Stances, closed
from .sets import Array, Labelled

RATE = 1000.0


def steps(*seconds: float) -> Mask:
    """Alternately false and true, for these times."""
    return np.concatenate([np.full(round(RATE * s), k % 2 == 1) for k, s in enumerate(seconds)])


def test_delays_are_from_the_touch_down_and_the_lift_off() -> None:
    contact = steps(1.0, 0.3, 0.3, 0.3, 0.3, 0.05, 0.3)
    p = steps(1.03, 0.29, 0.9).astype(float)
    p = np.concatenate([p, np.zeros(len(contact) - len(p))])
    stances = Stances()
    stances.add(contact, p, np.roll(p, 20) > 0.5, RATE)
    # The third contact is too short for a stance, and P misses the second one.
    assert (stances.count, stances.lost) == (2, 1)
    assert np.allclose(stances.rises, [0.03]) and np.allclose(stances.decides, [0.05])
    assert np.allclose(stances.falls, [0.02])


def test_stance_before_the_first_second_is_not_counted() -> None:
    stances = Stances()
    stances.add(steps(0.5, 0.3, 0.4, 0.3, 0.2), np.zeros(1700), np.zeros(1700, bool), RATE, since=1.0)
    assert stances.count == 1


def test_chatter_of_a_contact_is_closed() -> None:
    assert closed(steps(0.1, 0.1, 0.009, 0.1), RATE).sum() == 209
    assert closed(steps(0.1, 0.1, 0.011, 0.1), RATE).sum() == 200


def judgement(slide: Array, p: Array, slips: list[float]) -> judged.Judgement:
    n = len(slide)
    recording = footfall.Recording(
        name="made", foot=None, format="csv", rate=RATE, gravity="included", t=np.arange(n) / RATE,
        acc=np.zeros((n, 3), np.float32), gyr=np.zeros((n, 3), np.float32), load=None, label=(slide < 0.05).astype(np.int8),
        validity=np.zeros(n, np.uint8), notices=(),
    )  # fmt: skip
    load = np.concatenate([np.zeros(100), np.full(n - 100, 0.25)])
    foot = Foot("made", "made", "foot", Labelled("made", "made", recording), load, slide, np.zeros((n, 3)), False)
    return judged.Judgement(foot, p, p, p > 0.5, slips)


def test_slide_is_found_within_the_distance_that_it_went() -> None:
    slide = np.zeros(6000)
    slide[4000:4200] = 0.2
    for delay, early in ((90, 1), (110, 0)):
        p = np.ones(6000)
        p[4000 + delay : 4300] = 0.0
        counts = judged.Counts()
        counts.add(judgement(slide, p, [4.1, 5.0]))
        assert (counts.slides, counts.fast, counts.found, counts.found_early) == (1, 1, 1, early)
        assert (counts.events, counts.slips, counts.false_slips) == (1, 2, 1)


def test_landing_is_no_slide() -> None:
    slide = np.zeros(6000)
    slide[100:150] = 1.0
    assert judged.slides(np.arange(6000) >= 100, slide, RATE) == []


def test_offsets_of_the_sensor_are_the_same_at_each_rate() -> None:
    still = np.tile([0.0, 0.0, GRAVITY], (round(4.0 / STEP), 1)), np.zeros((round(4.0 / STEP), 3))
    means = [sensor.readings(still, rate, [1, 2])[1].mean(axis=0) - [0.0, 0.0, GRAVITY] for rate in (1000.0, 416.0)]
    assert np.allclose(means[0], means[1], atol=0.01)
    assert np.all(np.abs(means[0]) >= 0.019 * GRAVITY) and np.all(np.abs(means[0]) <= 0.041 * GRAVITY)


def test_body_stays_over_a_constant_centre_of_pressure() -> None:
    pressure = np.tile([0.1, -0.2], (500, 1))
    assert np.allclose(humanoid._body_over(pressure, 0.3), pressure)
    pressure[250:, 1] = 0.2
    body = humanoid._body_over(pressure, 0.3)
    # It moves before the pressure does.
    assert -0.2 < body[230, 1] < 0.0 < body[270, 1] < 0.2
