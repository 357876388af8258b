"""Recordings of many robots on many machines, with Ray: ``pip install 'footfall[fleet]'``.

>>> import footfall.fleet
>>> report = footfall.fleet.estimate("s3://robots/2026-11", "s3://robots-contact")  # doctest: +SKIP

:func:`estimate` makes a Ray task of each recording, and of each foot where a recording has several. A task
takes its recording to a folder of its own, does what ``footfall batch`` does with it, and writes the tables to
the destination: the bytes are those that the program writes on one machine. Ray distributes the tasks, starts
them again where a worker or a machine is lost, and keeps their memory apart; nothing of that is here.

==========================  ================================================================
:func:`estimate`            estimates what is missing or has changed
:func:`rows`                what all recordings come to, as a table of Arrow
:func:`samples`             the estimates of recordings, some columns or all, as a table of Arrow
:func:`robots`              steps, slips and half-widths of each robot, from the rows
:func:`drifts`              the change of each gyroscope's bias, from the rows
:func:`drifting`            those that change unlike the fleet
:class:`Source`             a recording of which robot, foot or day are known
:class:`Report`             what became of each recording
==========================  ================================================================

``docs/fleet.md`` describes the tables, what is measured, and where it stops scaling.
"""

from .._footfall import FEATURES

if "parquet" not in FEATURES:
    raise ImportError(
        "footfall.fleet needs the feature parquet, and this footfall is built without it; build it with:"
        " pip install './python[fleet]' --config-settings build-args='--features all'"
    )

from ._figures import Drift, RobotFigures, drifting, drifts, robots
from ._report import Outcome, Report, rows, samples
from ._run import estimate
from ._sources import Source

__all__ = [
    "Drift",
    "Outcome",
    "Report",
    "RobotFigures",
    "Source",
    "drifting",
    "drifts",
    "estimate",
    "robots",
    "rows",
    "samples",
]
