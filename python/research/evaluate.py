"""Writes the tables of README.md and docs/evaluation.md, and docs/reliability.svg; with --check, compares them.

`python -m research.evaluate [--check]`, in the folder `python`. A figure beyond its bound is an error in both cases.
"""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from difflib import unified_diff
from io import StringIO
from pathlib import Path

import footfall
import matplotlib as mpl
from matplotlib.figure import Figure

from . import attitude, bounds, methods, odometry
from .methods import AUTHORS, DEFAULT, FUZZY, OTHERS, PAPER, RATES, SHOE, TRIGGER
from .score import Answers, Figures, bins
from .sets import AVERAGED, DATASETS, POOLS, ROBOTS, ROOT, SETS, Labelled, load

BY_SET = {
    "default": DEFAULT,
    "paper": PAPER,
    "authors' script": AUTHORS,
    "SHOE": SHOE,
    "SHOE, tuned on others": f"SHOE / GLRT, {OTHERS}",
    "force threshold": f"force threshold, {OTHERS}",
    "force trigger": TRIGGER,
    "fuzzy c-means": FUZZY,
}
"""Columns of the table of RMSE by set."""

BY_RATE = {"native": DEFAULT} | {f"{rate:.0f} Hz": f"{DEFAULT}, at {rate:.0f} Hz" for rate in RATES}
"""Columns of the table of RMSE by sample rate."""

COLOURS = ["#0072b2", "#d55e00", "#009e73"]


class Evaluation:
    """Figures of all methods on any sets."""

    def __init__(self, files: list[Labelled]) -> None:
        self.files = files
        self.runs = methods.run(files)

    def answers(self, method: str, sets: Sequence[str]) -> list[Answers] | None:
        runs = [run for file, run in zip(self.files, self.runs[method], strict=True) if file.set in sets]
        answers = [run for run in runs if run is not None]
        return answers if len(answers) == len(runs) else None

    def pooled(self, method: str, sets: Sequence[str]) -> Figures | None:
        """Figures over all samples of sets; none if the method cannot run on one."""
        answers = self.answers(method, sets)
        return None if answers is None else Figures.of(answers)

    def mean(self, method: str, sets: Sequence[str]) -> Figures | None:
        """Mean of the figures of sets; none if the method cannot run on one."""
        figures = [self.pooled(method, [name]) for name in sets]
        known = [of for of in figures if of is not None]
        return Figures.mean(known) if len(known) == len(figures) else None


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [" | ".join(row) for row in (head, *rows)]
    lines.insert(1, "---|" * len(head))
    return "".join(f"|{line}\n" if k == 1 else f"| {line} |\n" for k, line in enumerate(lines))


def cells(figures: Figures | None, *names: str) -> list[str]:
    """RMSE with four decimals, other figures with three; a dash where there are no figures."""
    return ["–" if figures is None else f"{getattr(figures, name):.{4 if name == 'rmse' else 3}f}" for name in names]


def readme_block(evaluation: Evaluation) -> str:
    def row(method: str) -> list[str]:
        mean, robots = (evaluation.mean(method, sets) for sets in (AVERAGED, ROBOTS))
        assert mean is not None and robots is not None
        figures = (mean.rmse, mean.roc_auc, mean.calibration_error, robots.rmse)
        return [method, *(f"{figure:.3f}" for figure in figures)]

    head = ["method", "RMSE", "ROC-AUC", "calibration error", "real robots"]
    return table(head, map(row, (DEFAULT, PAPER, SHOE)))


def evaluation_block(evaluation: Evaluation) -> str:
    figures = ("rmse", "roc_auc", "calibration_error", "f1", "false_stable")

    def row(method: str) -> list[str]:
        mean = evaluation.mean(method, AVERAGED)
        robots = evaluation.mean(method, ROBOTS)
        return [method, *cells(mean, *figures), *cells(robots, "rmse", "roc_auc")]

    everywhere = [
        method
        for method in evaluation.runs
        if method == DEFAULT or method not in BY_RATE.values()
        if evaluation.mean(method, AVERAGED) is not None
    ]
    head = ["method", "RMSE", "ROC-AUC", "calibration error", "F1", "false stable", "robots' RMSE", "robots' ROC-AUC"]
    return table(head, map(row, everywhere))


def sets_block(evaluation: Evaluation, columns: Mapping[str, str]) -> str:
    """RMSE of methods by set."""

    def row(name: str, of: Sequence[str], is_mean: bool) -> list[str]:
        figures = evaluation.mean if is_mean else evaluation.pooled
        return [name, *(cell for method in columns.values() for cell in cells(figures(method, of), "rmse"))]

    rows = [row("mean", AVERAGED, True), row("real robots", ROBOTS, True)]
    rows += [row(f"{name} pooled", sets, False) for name, sets in POOLS.items()]
    rows += [row(name, [name], False) for name in SETS]
    return table(["RMSE", *columns], rows)


def slips_block(evaluation: Evaluation) -> str:
    """Slips that are reported on floors without known slips."""

    def row(name: str) -> list[str]:
        seconds, touch_downs, slips = 0.0, 0, 0
        for recording in (file.recording for file in evaluation.files if file.set == name):
            # Without the load.
            result = footfall.estimate(recording.acc, recording.gyr, recording.t, gravity=recording.gravity)
            kinds = [event.kind for event in result.events()]
            seconds += float(recording.t[-1] - recording.t[0])
            touch_downs += kinds.count("touch_down")
            slips += kinds.count("slip_start")
        return [name, f"{seconds:.0f}", str(touch_downs), str(slips)]

    return table(["set", "s", "touch-downs", "slips"], map(row, ("shoe", "TALOS", "real NAO", "GO1")))


def odometry_block(result: odometry.Odometry) -> str:
    rows = [
        [name, f"{mean:.3f}", f"{largest:.3f}", f"{nis:.1f}"] for name, (mean, largest, nis) in result.detectors.items()
    ]
    chosen = " and ".join(
        f"{speed} m/s and {lever} m ({error:.3f} m, default {default:.3f} m)"
        for speed, lever, error, default in result.halves
    )
    text = f"Speed and lever of `sigma_v`, chosen on half of the walks and scored on the others: {chosen}."
    return table(["", "mean error, m", "largest, m", "NIS"], rows) + "\n" + textwrap.fill(text, 120) + "\n"


def attitude_block(result: attitude.Attitude) -> str:
    rows = [[name, f"{rms:.2f}°", f"{p95:.2f}°"] for name, (rms, p95) in result.by_trial.items()]
    means = [sum(column) / len(rows) for column in zip(*result.by_trial.values(), strict=True)]
    rows.append(["mean", *(f"{mean:.2f}°" for mean in means)])
    least, most = result.perturbed
    held_out = result.held_out
    text = (
        "These trials are not a clean test: the filter's constants were chosen on them, on the GO1 and on a simulated "
        f"walk. With any one constant 20 % off, the mean is between {least:.2f}° and {most:.2f}°. With time constant "
        f"and quiet gain chosen from a coarse grid on three trials and scored on the other three, in all "
        f"{len(held_out)} ways, the mean is {sum(held_out) / len(held_out):.2f}°, at worst {max(held_out):.2f}°. Most "
        "depends on when the gyroscope measured: without the half period that `gyro_timing` allows for, the mean is "
        f"{result.without_timing:.2f}°."
    )
    return table(["recording", "RMS inclination error", "95 % within"], rows) + "\n" + textwrap.fill(text, 120) + "\n"


def peers_block(result: attitude.Attitude) -> str:
    rows = [[name, f"{mean:.2f}°", f"{worst:.2f}°"] for name, (mean, worst) in result.peers.items()]
    return table(["filter", "mean", "worst trial"], rows)


def reliability(evaluation: Evaluation) -> str:
    """How often P comes true: the share of stable samples over the probability, in bins."""
    mpl.rcParams |= {"svg.hashsalt": "footfall", "svg.fonttype": "none", "font.size": 11}
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    for axes, (name, sets) in zip(figure.subplots(1, 2), POOLS.items(), strict=True):
        axes.plot([0, 1], [0, 1], color="black", linewidth=0.8)
        for method, colour in zip((DEFAULT, PAPER, FUZZY), COLOURS, strict=True):
            answers = evaluation.answers(method, sets) or []
            of = Answers.together(answers)
            probability, stable, samples = bins(of.label, of.p)
            label = f"{method}: {Figures.of(answers).calibration_error:.3f}"
            axes.plot(probability, stable, color=colour, linewidth=1.2, label=label)
            axes.scatter(probability, stable, s=12.0 + 600.0 * samples / samples.sum(), color=colour, alpha=0.7)
        axes.set(xlabel="P", ylabel="share that is stable", xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
        axes.grid(color="#cdcdcd", linewidth=0.5)
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), title=f"{name}, calibration error", frameon=False)
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue()


def with_block(text: str, name: str, content: str) -> str:
    """Replaces the text between the lines `<!-- begin NAME -->` and `<!-- end NAME -->`."""
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    before, found, rest = text.partition(begin)
    _, ended, after = rest.partition(end)
    assert found and ended, f"there is no block {name}"
    return before + begin + content + end + after


def documents(evaluation: Evaluation, of_shoe: odometry.Odometry, up: attitude.Attitude) -> dict[Path, str]:
    """The generated files as they should be."""
    blocks = {
        ROOT / "README.md": {"evaluate": readme_block(evaluation)},
        ROOT / "docs/evaluation.md": {
            "evaluate": evaluation_block(evaluation),
            "sets": sets_block(evaluation, BY_SET),
            "rates": sets_block(evaluation, BY_RATE),
            "false-slips": slips_block(evaluation),
            "odometry": odometry_block(of_shoe),
            "attitude": attitude_block(up),
            "attitude-peers": peers_block(up),
        },
    }
    files = {ROOT / "docs/reliability.svg": reliability(evaluation)}
    for path, of_file in blocks.items():
        files[path] = path.read_text(encoding="utf-8")
        for name, content in of_file.items():
            files[path] = with_block(files[path], name, content)
    return files


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="fail where the committed files differ, and write nothing")
    is_check = parser.parse_args().check
    if not DATASETS.is_dir():
        parser.error(f"{DATASETS} is not there: FOOTFALL_DATASETS names the folder of recordings")
    results = Evaluation(load()), odometry.run(), attitude.run()
    problems = bounds.exceeded(*results)
    for path, expected in documents(*results).items():
        committed = path.read_text(encoding="utf-8") if path.exists() else ""
        if committed == expected:
            continue
        sys.stdout.writelines(
            unified_diff(committed.splitlines(True), expected.splitlines(True), f"{path} committed", f"{path} computed")
        )
        if is_check:
            problems.append(f"{path} differs")
        else:
            path.write_text(expected, encoding="utf-8")
    for problem in problems:
        print(problem, file=sys.stderr)
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
