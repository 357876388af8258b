"""Recordings of a tree on the cores of this machine."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .fleet import Report
    from .fleet._sources import Recordings


def batch(recordings: Recordings, out: str | os.PathLike[str], *, jobs: int | None = None, **options: Any) -> Report:
    """Estimates the recordings whose results are missing or of something else, as ``footfall batch`` does.

    It is :func:`footfall.fleet.estimate` on threads of this process, and needs no Ray: ``footfall[batch]``.

    Parameters
    ----------
    recordings : path, URL, Source, or several of them
        A recording, a folder of recordings, or a pattern.
    out : path or URL
        The folder of the tables.
    jobs : int, 1 or more, optional
        Number of threads; else that of the cores.
    **options
        Further arguments of :func:`footfall.fleet.estimate`.

    Returns
    -------
    footfall.fleet.Report
        What became of each recording.
    """
    from . import fleet

    return fleet.estimate(recordings, out, jobs=jobs or os.cpu_count() or 1, **options)
