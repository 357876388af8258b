"""Packages of the extra ``fleet``, which are imported where they are used."""

from __future__ import annotations

import importlib
from typing import Any


def need(module: str) -> Any:
    """Imports a package of the extra.

    Raises
    ------
    ImportError
        It is not installed; the message names the extra.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(
            f"footfall.fleet needs {package}, which cannot be imported ({error}):"
            f" pip install 'footfall[{'fleet' if package == 'ray' else 'batch'}]'"
        ) from error
