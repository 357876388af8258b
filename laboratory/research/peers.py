"""Methods by other authors: detectors that compare a statistic with a threshold, fuzzy c-means, and the script of the
paper.

A statistic is small if the foot rests. It is computed over a trailing window on the acceleration as recorded, which
may contain gravity; AMVD and MBGTD do not distinguish the two cases. A score is a statistic with the opposite sign,
so that a larger score means "more likely at rest".

Sources:

* SHOE, ARED, AMVD: I. Skog, P. Händel, J.-O. Nilsson, J. Rantakokko, *Zero-Velocity Detection — An Algorithm
  Evaluation*, IEEE Trans. Biomedical Engineering 57(11), 2010.
* MBGTD: Z. Wang, H. Zhao, S. Qiu, Q. Gao, *Stance-Phase Detection for ZUPT-Aided Foot-Mounted Pedestrian Navigation
  System*, IEEE/ASME Trans. Mechatronics 20(6), 2015; weights as in github.com/utiasSTARS/pyshoe.
* Schmitt trigger: S. Kuindersma et al., *Optimization-based locomotion planning, estimation, and control design for
  the Atlas humanoid robot*, Autonomous Robots 40, 2016.
* Fuzzy c-means: N. Rotella, S. Schaal, L. Righetti, *Unsupervised Contact Learning for Humanoid Estimation and
  Control*, ICRA 2018.
* SHOE with an adaptive threshold: J. Wahlström, I. Skog, F. Gustafsson, A. Markham, N. Trigoni, *Zero-Velocity
  Detection — A Bayesian Approach to Adaptive Thresholding*, IEEE Sensors Letters 3(6), 2019 (arXiv 1903.07929).
* Hidden Markov model: L. R. Rabiner, *A Tutorial on Hidden Markov Models and Selected Applications in Speech
  Recognition*, Proceedings of the IEEE 77(2), 1989; learnt by hmmlearn.
* Authors' script: `offline/src` of github.com/MichaelMarav/ProbabilisticContactEstimation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from hmmlearn.hmm import GaussianHMM

from .sets import Array, Labelled

GRAVITY = 9.80665

PAPER_WINDOW = 0.05
"""Duration of the paper's window, s: 50 samples at 1 kHz. At other rates the duration is kept, not the number of
samples, for the paper's preset and for all detectors with a tuned threshold."""

PAPER_BANDWIDTH = (0.02467, 0.01653)
"""Standard deviation of the kernel of the paper's parameters, m/s² and rad/s."""

PAPER_HALF_WIDTH = (0.4, 0.04)
"""Half of the paper's interval of integration, m/s² and rad/s."""

OPENSHOE_NOISE = (0.01, np.radians(0.1))
"""Noise in OpenShoe's `settings.m`, m/s² and rad/s."""

OPENSHOE_THRESHOLD = 0.3e5
"""γ in OpenShoe's `settings.m`: for ARED it is an angular rate of 17 °/s."""


def trailing(values: Array, length: int) -> Array:
    """The last `length` rows up to each row, shape (N, length, ...); not a number before the first."""
    before = np.full((length - 1, *values.shape[1:]), np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(np.concatenate([before, values]), length, axis=0)
    return np.moveaxis(windows, -1, 1)


def moving_mean(values: Array, length: int) -> Array:
    """Mean over each trailing window; at the start, over the samples so far."""
    return np.asarray(np.nanmean(trailing(values, length), axis=1))


def shoe(file: Labelled, length: int, noise: tuple[float, float]) -> Array:
    """1/N Σ (‖a_k − g ā/‖ā‖‖² / σ_a² + ‖ω_k‖² / σ_ω²), ā the window's mean; g is 0 if gravity is removed."""
    gravity = GRAVITY if file.recording.gravity == "included" else 0.0
    force = np.linalg.norm(moving_mean(file.acc, length), axis=1)
    energy = moving_mean(np.sum(file.acc**2, axis=1), length)
    # This is the mean of ‖a_k − g ā/‖ā‖‖², multiplied out.
    off_gravity = energy - 2.0 * gravity * force + gravity**2
    return np.asarray(off_gravity / noise[0] ** 2 + ared(file, length) / noise[1] ** 2)


def ared(file: Labelled, length: int) -> Array:
    """1/N Σ ‖ω_k‖². This statistic and the next two are not divided by the variance of the noise, because that only
    scales the threshold."""
    return moving_mean(np.sum(file.gyr**2, axis=1), length)


def amvd(file: Labelled, length: int) -> Array:
    """1/N Σ ‖a_k − ā‖²."""
    return np.asarray(np.nanvar(trailing(file.acc, length), axis=1).sum(axis=1))


def mbgtd(file: Labelled, length: int) -> Array:
    """Largest weight of a cut through the window: of all edges between the samples 0…s and t…N−1, where an edge is as
    long as its accelerations differ, over (t − s)(N − t + 1)."""
    acc, chunk = file.acc, 256
    starts = [heaviest_cut(acc[None, : k + 1]) for k in range(min(length - 1, len(acc)))]
    full = np.lib.stride_tricks.sliding_window_view(acc, length, axis=0)
    chunks = [heaviest_cut(np.moveaxis(full[k : k + chunk], -1, 1)) for k in range(0, len(full), chunk)]
    return np.concatenate([*starts, *chunks])


def heaviest_cut(windows: Array) -> Array:
    """The statistic of MBGTD of each window, shape (M, N, 3)."""
    n = windows.shape[1]
    # Single precision is enough, because the recordings have no more and it does not change the order of the answers.
    windows = windows.astype(np.float32)
    squares = [(windows[:, :, None, axis] - windows[:, None, :, axis]) ** 2 for axis in range(3)]
    across = np.sqrt(sum(squares))
    across = across.cumsum(axis=1)[:, :, ::-1].cumsum(axis=2)[:, :, ::-1]
    s, t = np.triu_indices(n, 1)
    weights = across[:, s, t] / ((t - s) * (n - t + 1)).astype(np.float32)
    return np.asarray(weights.max(axis=1, initial=0.0), dtype=np.float64)


def _tuned(statistic: Callable[[Labelled, int], Array]) -> Callable[[Labelled], Array | None]:
    return lambda file: -statistic(file, file.samples_in(PAPER_WINDOW))


TUNED: dict[str, Callable[[Labelled], Array | None]] = {
    "SHOE / GLRT": _tuned(lambda file, length: shoe(file, length, PAPER_BANDWIDTH)),
    "ARED": _tuned(ared),
    "AMVD": _tuned(amvd),
    "MBGTD": _tuned(mbgtd),
    "force threshold": lambda file: file.load_share,
}
"""Score of each detector whose threshold is tuned on labels; none if the recording lacks its signal."""


def published_window(file: Labelled) -> int:
    """25 ms, at least five samples: `INS.py` of PyShoe has five samples at 200 Hz."""
    return max(5, file.samples_in(0.025))


def published_shoe(file: Labelled) -> Array:
    """Score of SHOE with OpenShoe's constants: "stable" above −γ."""
    return -shoe(file, published_window(file), OPENSHOE_NOISE)


def published_ared(file: Labelled) -> Array:
    """Score of ARED with OpenShoe's constants: "stable" above −γ."""
    return np.asarray(-ared(file, published_window(file)) / OPENSHOE_NOISE[1] ** 2)


def threshold(groups: Sequence[tuple[Array, npt.NDArray[np.int8]]]) -> float:
    """The threshold above which the answer is "stable" with the fewest wrong answers, each group of scores and labels
    having equal weight; the highest of equally good ones, halfway between two scores that occur."""
    scores = np.concatenate([scores for scores, _ in groups])
    # Whole numbers, so that equally good thresholds are equal.
    signs = [np.where(labels == 1, 1, -1) * (2**48 // len(labels)) for _, labels in groups]
    order = np.argsort(-scores, kind="stable")
    ranked, gained = scores[order], np.cumsum(np.concatenate(signs)[order])
    ends = np.flatnonzero(np.append(np.diff(ranked) != 0.0, True))
    best = ends[np.argmax(gained[ends])]
    if gained[best] <= 0:
        return float(ranked[0])
    value = ranked[best]
    below = ranked[best + 1] if best + 1 < len(ranked) else value - 2.0 * max(1.0, abs(value))
    return float(0.5 * (value + below))


ADAPTIVE_GROWTHS = np.array([0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0])
"""Candidates for the growth of the adaptive threshold, 1/s. With 0 it is SHOE with a fixed threshold."""

ADAPTIVE_THRESHOLDS = np.geomspace(1.0, 1.0e7, 36)
"""Candidates for the threshold of SHOE right after a stance."""


def adaptive_shoe(statistic: Array, period: float, threshold: Array, growth: Array) -> tuple[npt.NDArray[np.bool_], Array]:
    """Answers of SHOE with an adaptive threshold, and the threshold at each sample; a column for each pair of
    constants.

    The cost of a missed stance grows exponentially with the time since the last one, Δt. So the logarithm of the
    likelihood ratio that is required falls linearly, and the threshold of the statistic is γ (1 + growth Δt). The
    original has a prior from the velocity of a navigation filter as well, which none of the recordings' feet has."""
    stable = np.empty((len(statistic), len(threshold)), np.bool_)
    limits = np.empty(stable.shape)
    since = np.zeros(len(threshold))
    for k, value in enumerate(statistic):
        limits[k] = threshold * (1.0 + growth * since)
        stable[k] = value < limits[k]
        since = np.where(stable[k], 0.0, since + period)
    return stable, limits


def adaptive_mistakes(file: Labelled) -> Array:
    """Share of wrong answers of SHOE with each pair of `ADAPTIVE_THRESHOLDS` and `ADAPTIVE_GROWTHS`."""
    statistic = shoe(file, file.samples_in(PAPER_WINDOW), PAPER_BANDWIDTH)
    pairs = np.meshgrid(ADAPTIVE_THRESHOLDS, ADAPTIVE_GROWTHS, indexing="ij")
    stable, _ = adaptive_shoe(statistic, 1.0 / file.recording.rate, *(of.ravel() for of in pairs))
    known = file.label >= 0
    wrong = stable[known] != (file.label[known] == 1)[:, None]
    return np.asarray(wrong.mean(axis=0).reshape(pairs[0].shape))


HMM_FLOOR = 0.17
"""Acceleration that is added to each amplitude, m/s²: that of the default preset."""


def hidden_markov(learnt_on: Labelled, file: Labelled) -> Array:
    """Probability of the quieter of two hidden states, given the samples so far."""
    return quiet_state(two_states(learnt_on), file)


def two_states(learnt_on: Labelled) -> GaussianHMM:
    """Hidden Markov model of the log amplitude, with a quiet and a loud state. The normal distributions and the
    transition probabilities are fitted without labels, by expectation maximisation."""
    amplitudes = log_amplitude(learnt_on)
    quiet, loud = np.quantile(amplitudes, [0.25, 0.75])
    model = GaussianHMM(2, "diag", init_params="", n_iter=30, random_state=1)
    model.startprob_ = np.array([0.5, 0.5])
    model.transmat_ = np.array([[0.99, 0.01], [0.01, 0.99]])
    model.means_ = np.array([[quiet], [loud]])
    model.covars_ = np.full((2, 1), max(0.25 * (loud - quiet) ** 2, 0.01))
    return model.fit(amplitudes[:, None])


def quiet_state(model: GaussianHMM, file: Labelled) -> Array:
    """Probability of the quieter state, given the samples so far."""
    means, variances = model.means_[:, 0], model.covars_[:, 0, 0]
    u = log_amplitude(file)[:, None]
    likelihoods = np.exp(-0.5 * (u - means) ** 2 / variances) / np.sqrt(variances)
    return filtered(likelihoods + 1.0e-12, model.startprob_, model.transmat_)[:, int(np.argmin(means))]


def log_amplitude(file: Labelled) -> Array:
    """½ ln(‖a − g ā/‖ā‖‖² + floor²), with the mean ā over a trailing window; g is 0 if gravity is removed."""
    a = file.acc
    if file.recording.gravity == "included":
        mean = moving_mean(a, file.samples_in(PAPER_WINDOW))
        a = a - GRAVITY * mean / np.linalg.norm(mean, axis=1, keepdims=True)
    return np.asarray(0.5 * np.log(np.sum(a**2, axis=1) + HMM_FLOOR**2))


def filtered(likelihoods: Array, start: Array, transitions: Array) -> Array:
    """Probability of each hidden state, given the samples so far."""
    states = np.empty(likelihoods.shape)
    state = start
    for k, likelihood in enumerate(likelihoods):
        state = state * likelihood
        state = state / state.sum()
        states[k] = state
        state = state @ transitions
    return states


def schmitt_trigger(share: Array, on: float = 0.10, off: float = 0.05) -> Array:
    """1 while loaded: from a share `on` of the weight until it falls below `off`."""
    loaded = False
    states = np.zeros(len(share))
    for k, value in enumerate(share):
        loaded = bool(value >= (off if loaded else on))
        states[k] = loaded
    return states


def fuzzy_c_means(learnt_on: Labelled, file: Labelled) -> Array | None:
    """Membership in the cluster of contact (J. C. Bezdek, 1981; two clusters, fuzzifier 2), found without labels.

    The original has a probability for each degree of freedom; here one clustering uses the lengths of force, torque,
    acceleration and angular rate, each over its standard deviation, which does best of the features tried."""
    share = learnt_on.load_share
    features, scored = _features(learnt_on), _features(file)
    if share is None or features is None or scored is None:
        return None
    mean, deviation = features.mean(axis=0), features.std(axis=0)
    points, scored = (features - mean) / deviation, (scored - mean) / deviation
    # The first guess: more than 30 % of the weight is contact. The centres converge within fifty rounds.
    memberships = (share > 0.3).astype(np.float64)
    for _ in range(100):
        weights = np.stack([memberships, 1.0 - memberships]) ** 2
        centres = weights @ points / weights.sum(axis=1, keepdims=True)
        memberships = _membership(points, centres)
    return _membership(scored, centres)


def _features(file: Labelled) -> Array | None:
    if file.wrench is None:
        return None
    vectors = [file.wrench[:, :3], file.wrench[:, 3:], file.acc, file.gyr]
    return np.stack([np.linalg.norm(vector, axis=1) for vector in vectors], axis=1)


def _membership(points: Array, centres: Array) -> Array:
    contact, other = (np.sum((points - centre) ** 2, axis=1) for centre in centres)
    return np.asarray(other / (contact + other))


def authors_script(file: Labelled) -> Array | None:
    """The method as its authors' script computes it, without the samples of the last window.

    The window begins with its sample and looks ahead; the first result is used for all samples of the first window.
    The density is summed at 50 points over the interval, both ends in full, which is more than the integral; each axis
    is rounded to four decimals. It cannot remove gravity."""
    if file.recording.gravity == "included":
        return None
    length = file.samples_in(PAPER_WINDOW)
    bandwidth, half_width = (np.repeat(of, 3) for of in (PAPER_BANDWIDTH, PAPER_HALF_WIDTH))
    readings = np.hstack([file.acc, file.gyr])
    mass = np.zeros_like(readings)
    for point in np.linspace(-half_width, half_width, 50):
        mass += np.exp(-0.5 * ((point - readings) / bandwidth) ** 2)
    mass *= 2.0 * half_width / 49.0 / (bandwidth * np.sqrt(2.0 * np.pi))
    means = np.lib.stride_tricks.sliding_window_view(mass[:-1], length, axis=0).mean(axis=-1)
    p = np.round(means, 4).prod(axis=1)
    p[:length] = p[0]
    return np.asarray(p)
