"""Messages speak of options of the program; here they are arguments."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator

ARGUMENTS = {
    name: name.replace("-", "_")
    for name in (
        "axes config decimal estimate-again format frame gravity load-topic map not-topic preset scale time-unit "
        "times topic units window"
    ).split()
} | {"sample-rate": "rate"}
"""The arguments of the package by the options of the program."""

FLAGS = {"estimate-again"}
"""Options without a value."""

NO_VALUES = "and are computes does for in is leaves lists of once or say says to was were with"
"""What follows an option in a sentence that does not give it a value."""

OPTION = re.compile(
    rf"(?<![\w-])--({'|'.join(sorted(ARGUMENTS, key=len, reverse=True))})(?![\w-])"
    rf"(?: (?!(?:{'|'.join(NO_VALUES.split())})\b)([\w/{{`-][^\s;]*?)(?=[.,;:)]*(?:\s|$)))?"
)


def with_arguments(message: str) -> str:
    """A message of the Rust part in which ``--units g,dps`` is ``units="g,dps"``."""

    def argument(option: re.Match[str]) -> str:
        name, value = ARGUMENTS[option[1]], option[2]
        if option[1] in FLAGS:
            return f"{name}=True"
        if value is None or value.isupper():
            return f"{name}="
        return f'{name}="{value}"'

    return OPTION.sub(argument, message)


@contextlib.contextmanager
def arguments_in_errors() -> Iterator[None]:
    """Raises errors of the Rust part with arguments in their messages."""
    try:
        yield
    except (ValueError, OSError, ImportError) as error:
        message = str(error)
        if with_arguments(message) == message:
            raise
        raise type(error)(with_arguments(message)) from None
