"""A fleet from end to end: simulate it, estimate it, estimate it again with other parameters, report.

    pip install './python[fleet,notebooks]' --config-settings build-args='--features all'
    python python/examples/fleet/run.py fleet-demo --seconds 36      # 200 feet, 36 s each
    python python/examples/fleet/run.py fleet-demo --seconds 3600    # an hour each: 200 hours of a foot
"""

from __future__ import annotations

import argparse
from pathlib import Path

import report
import robots

import footfall.fleet


def main() -> None:
    """Runs it and prints what was found."""
    parser = argparse.ArgumentParser(description="Simulates and estimates a fleet of robots.")
    parser.add_argument("folder", type=Path, help="where recordings, tables and the page go")
    parser.add_argument("--seconds", type=float, default=36.0, help="of each foot")
    parser.add_argument("--robots", type=int, default=50, help="with four feet each")
    arguments = parser.parse_args()
    recordings, out = arguments.folder / "recordings", arguments.folder / "tables"
    robots.simulate(recordings, arguments.seconds, arguments.robots)
    for config in (None, {"decision": {"on_delay_s": 0.03}}):
        print(
            footfall.fleet.estimate(
                recordings, out, config=config, path_pattern=robots.PATH_PATTERN
            )
        )
    rows = footfall.fleet.rows(str(out)).to_pylist()
    report.write(rows, arguments.folder / "fleet.html")
    for robot in footfall.fleet.robots(rows)[:5]:
        print(f"{robot.name}: {robot.slips_per_thousand_steps:.0f} slips per thousand steps")
    for drift in footfall.fleet.drifting(rows):
        print(f"{drift.robot} {drift.foot}: the gyroscope's bias changed by {drift.change:.4f} rad/s")


if __name__ == "__main__":
    main()
