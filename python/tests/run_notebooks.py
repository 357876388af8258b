"""Runs every notebook as a reader would, and reports the cell that fails; `--write` keeps the outputs in the files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"


def without_the_machine(notebook: Any) -> Any:
    """Removes the traces of a run from a notebook: times of cells, versions, and log output of libraries."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if output.get("name") != "stderr"]
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def main() -> int:
    failed = []
    paths = sorted(NOTEBOOKS.glob("*.ipynb"))
    for path in paths:
        notebook = nbformat.read(path, as_version=4)
        try:
            where = {"metadata": {"path": str(NOTEBOOKS)}}
            client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources=where)
            client.execute()
            if "--write" in sys.argv[1:]:
                nbformat.write(without_the_machine(notebook), path)
        except CellExecutionError as error:
            print(f"{path.name}: {error}", file=sys.stderr)
            failed.append(path.name)
    print(f"{len(paths) - len(failed)} passed, {len(failed)} failed")
    return 1 if failed or not paths else 0


if __name__ == "__main__":
    sys.exit(main())
