"""The estimator with the interface of a scikit-learn classifier; scikit-learn is not required."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import floats
from ._calibration import learn
from ._estimate import estimate
from ._settings import Config, Gravity, Preset, RecordingDict, settings


class ContactClassifier:
    """Classifies the samples of one foot: 1 stable contact, 0 not.

    A matrix X holds one recording: rows in order of time, with the specific force in m/s² and the angular rate in
    rad/s in six columns. Samples are not independent, so X must never be shuffled.

    Parameters
    ----------
    rate : float, Hz
        The sample rate, 20 to 10 000 Hz.
    preset, config, gravity, axes
        As in :func:`footfall.estimate`.

    Examples
    --------
    >>> import footfall, numpy as np
    >>> walk = footfall.simulate("walk", seconds=10.0)
    >>> X = np.hstack([walk.acc, walk.gyr])
    >>> footfall.ContactClassifier(rate=1000.0).fit(X).predict_proba(X).shape
    (10000, 2)
    """

    _NAMES = ("rate", "preset", "config", "gravity", "axes")

    def __init__(
        self,
        rate: float = 1000.0,
        *,
        preset: Preset = "default",
        config: Config | None = None,
        gravity: Gravity | None = None,
        axes: str | None = None,
    ) -> None:
        self.rate = rate
        self.preset = preset
        self.config = config
        self.gravity = gravity
        self.axes = axes

    def __repr__(self) -> str:
        return f"ContactClassifier({', '.join(f'{name}={value!r}' for name, value in self.get_params().items())})"

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns the present arguments of the constructor."""
        return {name: getattr(self, name) for name in self._NAMES}

    def set_params(self, **params: Any) -> ContactClassifier:
        """Sets arguments of the constructor.

        Raises
        ------
        ValueError
            There is no such argument; the message lists all.
        """
        for name in params:
            if name not in self._NAMES:
                raise ValueError(f"{name!r} is unknown, but one of {', '.join(self._NAMES)} is expected")
        for name, value in params.items():
            setattr(self, name, value)
        return self

    def fit(self, X: npt.ArrayLike, y: npt.ArrayLike | None = None) -> ContactClassifier:
        """Learns a foot in advance, as :func:`footfall.calibrate` does. Labels are not used.

        Raises
        ------
        ValueError
            The recording holds too little stance or swing, or rest and motion do not differ in it.
        """
        acc, gyr = _halves(X)
        recording: RecordingDict = {
            "acc": acc,
            "gyr": gyr,
            "t": np.arange(len(acc)) / float(self.rate),
            "load": None,
            "validity": None,
        }
        chosen = settings(
            self.preset, self.config, gravity=self.gravity, rate=None, axes=self.axes, format="csv"
        )
        self.calibration_ = learn([recording], chosen)
        self.classes_ = np.array([0, 1])
        return self

    def predict_proba(self, X: npt.ArrayLike) -> npt.NDArray[np.float32]:
        """Returns the probabilities of 0 and of 1, shape (N, 2); without :meth:`fit`, from a cold start."""
        acc, gyr = _halves(X)
        calibration = getattr(self, "calibration_", None)
        config = self.config if calibration is None else calibration.config
        stable = estimate(
            acc, gyr, rate=self.rate, preset=self.preset, config=config, gravity=self.gravity, axes=self.axes
        ).p_stable
        return np.column_stack([1.0 - stable, stable])

    def predict(self, X: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Returns 1 where stable contact is more probable than not, otherwise 0, shape (N,)."""
        return np.asarray(self.predict_proba(X)[:, 1] > 0.5, dtype=np.int64)

    def score(self, X: npt.ArrayLike, y: npt.ArrayLike) -> float:
        """Returns the share of samples with a label 0 or 1 that :meth:`predict` classifies correctly."""
        label = floats("y", y)
        is_known = (label == 0.0) | (label == 1.0)
        if not is_known.any():
            raise ValueError("y is known for no sample: no label is 0 or 1")
        return float(np.mean(self.predict(X)[is_known] == label[is_known]))


def _halves(X: npt.ArrayLike) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    array = floats("X", X)
    if array.ndim != 2 or array.shape[1] != 6:
        raise ValueError(f"X has the shape {array.shape}, but (N, 6) is expected: ax, ay, az, wx, wy, wz")
    return array[:, :3], array[:, 3:]
