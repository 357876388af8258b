"""The page about a fleet: one file that needs no network."""

from __future__ import annotations

import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from footfall import fleet

STYLE = """body { font: 16px/1.5 system-ui, sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse } td, th { padding: .2em .8em; border-bottom: 1px solid #ddd; text-align: right }
td:first-child, th:first-child { text-align: left } svg { max-width: 100%; height: auto }"""


def page(rows: Sequence[dict[str, Any]]) -> str:
    """The page, as HTML."""
    robots = fleet.robots(rows)
    drifting = fleet.drifting(rows)
    failed = [row for row in rows if row["status"] != "done"]
    hours = sum(row["duration_s"] or 0.0 for row in rows) / 3600.0
    steps = sum(robot.steps for robot in robots)
    slips = sum(robot.slips for robot in robots)
    parts = [
        f"<p>{len(robots)} robots, {len(rows)} feet, {hours:.1f} hours: {steps} steps, {slips} slips."
        f" {len(failed)} recordings could not be estimated.</p>",
        "<h2>Sensors that drift</h2>",
        "<p>The gyroscope's bias changes from the first rest to the last unlike that of the fleet.</p>",
        _table(
            ["foot", "change (rad/s)"],
            [[f"{drift.robot} {drift.foot}", f"{drift.change:.4f}"] for drift in drifting],
        ),
        _drawing(rows, robots),
        "<h2>Robots, by slips</h2>",
        _table(
            ["robot", "slips per 1000 steps", "steps", "half-width (m/s²)", "half-width (rad/s)"],
            [
                [
                    robot.name,
                    f"{robot.slips_per_thousand_steps:.0f}",
                    str(robot.steps),
                    f"{robot.acceleration_half_width:.2f}",
                    f"{robot.rate_half_width:.3f}",
                ]
                for robot in robots
            ],
        ),
    ]
    if failed:
        parts.append("<h2>Recordings that could not be estimated</h2>")
        parts.append(_table(["recording", "why"], [[row["recording"], row["error"]] for row in failed]))
    body = "\n".join(parts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>A fleet</title>'
        f"<style>{STYLE}</style></head>\n<body><h1>A fleet</h1>\n{body}\n</body></html>\n"
    )


def write(rows: Sequence[dict[str, Any]], path: str | Path) -> None:
    """Writes the page."""
    Path(path).write_text(page(rows), encoding="utf-8")


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    lines = [line(header, "th"), *(line(row, "td") for row in rows)]
    return "<table>\n" + "\n".join(lines) + "\n</table>"


def _drawing(rows: Sequence[dict[str, Any]], robots: Sequence[fleet.RobotFigures]) -> str:
    """The fleet's distributions, as SVG."""
    import matplotlib
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.2), layout="constrained")
    slips, widths, drift = figure.subplots(1, 3)
    slips.hist([robot.slips_per_thousand_steps for robot in robots], bins=20, color="#0072b2")
    slips.set(xlabel="slips per 1000 steps", ylabel="robots")
    widths.hist([robot.acceleration_half_width for robot in robots], bins=20, color="#009e73")
    widths.set(xlabel="half-width of stillness (m/s²)", ylabel="robots")
    changes = [change.change for change in fleet.drifts(rows) if change.change > 0.0]
    drift.hist(np.log10(changes), bins=30, color="#d55e00")
    drift.set(xlabel="change of the gyroscope's bias (lg rad/s)", ylabel="feet")
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "footfall"}):
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    return text.getvalue()[text.getvalue().index("<svg") :]
