"""Writes the results shown in README.md and docs/reference/evaluation.md, and docs/pictures/reliability.svg.

With --check, compares them with the stored results instead. Either way, a figure beyond its bound is an error.

`python -m research.evaluate [--check]`, in the folder `laboratory`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from io import StringIO
from typing import Any

import footfall
import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from . import attitude, bounds, odometry
from .delays import Stances
from .methods import AUTHORS, DEFAULT, FUZZY, HMM, OTHERS, PAPER, RATES, SHOE, TRIGGER, Evaluation
from .results import Result, write
from .score import Answers, Figures, bins, shares
from .sets import AVERAGED, DATASETS, POOLS, ROBOTS, ROOT, SETS, load

BY_SET = {
    "default": DEFAULT,
    "paper": PAPER,
    "authors' script": AUTHORS,
    "SHOE": SHOE,
    "SHOE, tuned on others": f"SHOE / GLRT, {OTHERS}",
    "hidden Markov model": HMM,
    "force threshold": f"force threshold, {OTHERS}",
    "force trigger": TRIGGER,
    "fuzzy c-means": FUZZY,
}
"""Columns of the table of RMSE by set."""

BY_RATE = {"native": DEFAULT} | {f"{rate:.0f} Hz": f"{DEFAULT}, at {rate:.0f} Hz" for rate in RATES}
"""Columns of the table of RMSE by sample rate."""

COMMAND = "python -m research.evaluate"

RELIABILITY = ROOT / "docs/pictures/reliability.svg"

COLOURS = ["#0072b2", "#d55e00", "#009e73"]


def rmse(figures: Figures | None) -> float | None:
    return None if figures is None else round(figures.rmse, 4)


def of_methods(evaluation: Evaluation) -> Result:
    def row(method: str) -> dict[str, Any]:
        mean, robots = (evaluation.mean(method, sets) for sets in (AVERAGED, ROBOTS))
        assert mean is not None and robots is not None
        return {
            "method": method,
            "rmse": rmse(mean),
            "roc_auc": round(mean.roc_auc, 3),
            "calibration_error": round(mean.calibration_error, 3),
            "f1": round(mean.f1, 3),
            "false_stable": round(mean.false_stable, 3),
            "robots_rmse": rmse(robots),
            "robots_roc_auc": round(robots.roc_auc, 3),
        }

    everywhere = [
        method
        for method in evaluation.runs
        if method == DEFAULT or method not in BY_RATE.values()
        if evaluation.mean(method, AVERAGED) is not None
    ]
    what = "Scores of all methods: means over seven labelled sets, and over four sets of real robots, whose labels say"
    return Result("methods", f'{what} "loaded".', COMMAND, rows=[row(method) for method in everywhere])


def of_sets(evaluation: Evaluation, name: str, what: str, columns: Mapping[str, str]) -> Result:
    """RMSE of methods by set."""

    def row(name: str, of: Sequence[str], is_mean: bool) -> dict[str, Any]:
        figures = evaluation.mean if is_mean else evaluation.pooled
        return {"set": name, "rmse": {column: rmse(figures(method, of)) for column, method in columns.items()}}

    rows = [row("mean", AVERAGED, True), row("real robots", ROBOTS, True)]
    rows += [row(f"{name} pooled", sets, False) for name, sets in POOLS.items()]
    rows += [row(name, [name], False) for name in SETS]
    return Result(name, what, COMMAND, rows=rows)


def of_slips(evaluation: Evaluation) -> Result:
    def row(name: str) -> dict[str, Any]:
        seconds, touch_downs, slips = 0.0, 0, 0
        for recording in (file.recording for file in evaluation.files if file.set == name):
            # Without the load.
            result = footfall.estimate(recording.acc, recording.gyr, recording.t, gravity=recording.gravity)
            kinds = [event.kind for event in result.events()]
            seconds += float(recording.t[-1] - recording.t[0])
            touch_downs += kinds.count("touch_down")
            slips += kinds.count("slip_start")
        return {"set": name, "duration_s": round(seconds), "touch_downs": touch_downs, "slips": slips}

    what = "Slips that are reported from the IMU alone on floors without known slips."
    return Result("false-slips", what, COMMAND, rows=[row(name) for name in ("shoe", "TALOS", "real NAO", "GO1")])


DELAYS = ("TALOS", "real NAO", "GO1", "pushed NAO", "shoe", "demo")
"""Sets whose labels begin and end with a contact. On ATLAS and LCD a stance ends when the foot slips."""


def of_delays(evaluation: Evaluation) -> Result:
    """Delays after changes of the label."""

    def row(name: str, sets: Sequence[str]) -> dict[str, Any]:
        stances, seconds, rates = Stances(), 0.0, []
        for file in evaluation.files:
            if file.set in sets:
                recording = file.recording
                result = footfall.estimate(recording.acc, recording.gyr, recording.t, gravity=recording.gravity)
                p = result.p_stable.astype(np.float64)
                stances.add(file.label == 1, p, result.decision, recording.rate)
                seconds += float(recording.t[-1] - recording.t[0])
                rates.append(recording.rate)
        of_rates = {"least_rate_hz": round(min(rates), 1), "largest_rate_hz": round(max(rates), 1)}
        return {"set": name, "duration_s": round(seconds), **of_rates, **stances.figures()}

    rows = [row(name, [name]) for name in DELAYS] + [row("real robots", ROBOTS)]
    what = "Delays from touch-down and lift-off by the label, and stances that are never reported stable."
    return Result("delays", what, COMMAND, rows=rows)


def of_reliability(evaluation: Evaluation) -> Result:
    """How often a foot is labelled stable, by P."""
    rows = []
    for name, sets in {**POOLS, "real robots": ROBOTS}.items():
        answers = Answers.together(evaluation.answers(DEFAULT, sets) or [])
        rows.append({"sets": name} | shares(answers))
    what = "Share of the samples that are labelled stable, in ten ranges of P, and their share of all samples."
    return Result("reliability", what, COMMAND, rows=rows)


def of_odometry(result: odometry.Odometry) -> Result:
    rows = [
        {"measurement": name, "mean_error_m": round(mean, 3), "largest_error_m": round(largest, 3), "nis": round(nis, 1)}
        for name, (mean, largest, nis) in result.detectors.items()
    ]
    halves = [
        {
            "speed_m_s": speed,
            "lever_m": lever,
            "mean_error_m": round(error, 3),
            "default_mean_error_m": round(default, 3),
        }
        for speed, lever, error, default in result.halves
    ]
    what = "Position errors of twelve walks of a shoe, tracked with the zero-velocity measurements of each detector."
    return Result("odometry", what, COMMAND, values={"halves": halves}, rows=rows)


def of_attitude(result: attitude.Attitude) -> Result:
    rows = [
        {"recording": name, "rms_deg": round(rms, 2), "percentile_95_deg": round(p95, 2)}
        for name, (rms, p95) in result.by_trial.items()
    ]
    rms, p95 = (sum(column) / len(rows) for column in zip(*result.by_trial.values(), strict=True))
    rows.append({"recording": "mean", "rms_deg": round(rms, 2), "percentile_95_deg": round(p95, 2)})
    least, largest = result.perturbed
    held_out = result.held_out
    values = {
        "least_mean_with_a_constant_20_percent_off_deg": round(least, 2),
        "largest_mean_with_a_constant_20_percent_off_deg": round(largest, 2),
        "held_out_choices": len(held_out),
        "held_out_mean_deg": round(sum(held_out) / len(held_out), 2),
        "held_out_worst_deg": round(max(held_out), 2),
        "mean_without_gyro_timing_deg": round(result.without_timing, 2),
    }
    what = "Inclination errors of the attitude filter on six hand-held trials of BROAD with optical truth."
    return Result("attitude", what, COMMAND, values, rows)


def of_peers(result: attitude.Attitude) -> Result:
    rows = [
        {"filter": name, "mean_deg": round(mean, 2), "worst_deg": round(worst, 2)}
        for name, (mean, worst) in result.peers.items()
    ]
    what = "RMS inclination errors of this filter and of published ones on the same six trials of BROAD."
    return Result("attitude-peers", what, COMMAND, rows=rows)


def reliability(evaluation: Evaluation) -> str:
    """How often P comes true: the share of stable samples over the probability, in bins."""
    mpl.rcParams |= {"svg.hashsalt": "footfall", "svg.fonttype": "none", "font.size": 11}
    figure = Figure(figsize=(15, 5.5), layout="constrained")
    for axes, (name, sets) in zip(figure.subplots(1, 3), (POOLS | {"real robots": ROBOTS}).items(), strict=True):
        axes.plot([0, 1], [0, 1], color="black", linewidth=0.8)
        for method, colour in zip((DEFAULT, PAPER, FUZZY), COLOURS, strict=True):
            answers = evaluation.answers(method, sets)
            if answers is None:
                # The method needs a force.
                continue
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


def results(evaluation: Evaluation, of_shoe: odometry.Odometry, up: attitude.Attitude) -> list[Result]:
    by_set = "RMSE of methods on each set of labelled recordings, on sets whose samples are pooled, and means of sets."
    by_rate = "RMSE of the default preset on each set of labelled recordings at its own and at other sample rates."
    return [
        of_methods(evaluation),
        of_sets(evaluation, "rmse-by-set", by_set, BY_SET),
        of_sets(evaluation, "rmse-by-rate", by_rate, BY_RATE),
        of_slips(evaluation),
        of_delays(evaluation),
        of_reliability(evaluation),
        of_odometry(of_shoe),
        of_attitude(up),
        of_peers(up),
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="fail where stored figures differ, and write nothing")
    is_check = parser.parse_args().check
    if not DATASETS.is_dir():
        parser.error(f"{DATASETS} is not there: FOOTFALL_DATASETS names the folder of recordings")
    computed = Evaluation(load()), odometry.run(), attitude.run()
    problems = bounds.exceeded(*computed)
    measured, picture = results(*computed), reliability(computed[0])
    differences = [difference for result in measured for difference in result.differences()]
    if not RELIABILITY.exists() or RELIABILITY.read_text(encoding="utf-8") != picture:
        differences.append(f"{RELIABILITY} differs")
    for difference in differences:
        print(difference)
    if is_check:
        problems += differences
    else:
        write(measured)
        RELIABILITY.write_text(picture, encoding="utf-8")
    for problem in problems:
        print(problem, file=sys.stderr)
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
