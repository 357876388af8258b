"""Repeats what storage refuses for a moment."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

FIRST_PAUSE_S = 0.5
"""Pause before the first repetition, s; each further one is twice as long."""

LONGEST_PAUSE_S = 20.0
"""The longest pause, s."""

FINAL = (
    FileNotFoundError,
    PermissionError,
    IsADirectoryError,
    NotADirectoryError,
    ImportError,
    ValueError,
    TypeError,
)
"""Errors that no repetition changes."""


def patiently(action: Callable[[], T], retries: int) -> T:
    """Returns the value of `action`, which is repeated up to `retries` times after errors that can pass."""
    pause = FIRST_PAUSE_S
    for _ in range(retries):
        try:
            return action()
        except FINAL:
            raise
        except Exception:
            time.sleep(pause)
            pause = min(2.0 * pause, LONGEST_PAUSE_S)
    return action()


def sentence(error: BaseException) -> str:
    """The message of an error in one line, or its type where it has none."""
    return " ".join(str(error).split()) or type(error).__name__
