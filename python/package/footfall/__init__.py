"""Estimates the probability that a robot's foot is in stable contact with the ground, from the IMU on it.

The estimator gives the same bits as the estimators of the firmware and of the program ``footfall``.

>>> import footfall
>>> walk = footfall.simulate("walk", seconds=10.0, seed=1)
>>> result = walk.estimate()
>>> result.p_stable.shape
(10000,)

==========================  ==================================================================
:func:`estimate`            probabilities of a whole recording in arrays
:func:`estimate_file`       probabilities of each foot in a file, in every format that the program reads
:class:`Estimator`          probabilities sample by sample
:func:`read`                the recordings in such a file, as arrays
:func:`decode`              output of feet over CAN or a serial line, as arrays
:func:`simulate`            a recording of a simulated foot, with its ground truth
:func:`simulate_robot`      the same of four feet, with the robot's base and joints
:func:`calibrate`           learns a foot in advance, for a warm start
:func:`score`               RMSE, ROC-AUC and calibration error against labels
:func:`select`              parameters that fit the labels of recordings best
:mod:`footfall.fleet`       all recordings of a tree, on one machine or many
:class:`ContactClassifier`  the estimator in the form of scikit-learn's classifiers
==========================  ==================================================================
"""

from ._calibration import Calibration, calibrate
from ._classifier import ContactClassifier
from ._decoded import Decoded, decode
from ._estimate import estimate, estimate_file
from ._footfall import AXES, FLAGS, SENT_FLAGS, STATES, __version__
from ._recording import Recording, Simulation, read, simulate
from ._result import Event, Finding, Result
from ._robot import Base, Leg, Robot, RobotLeg, simulate_robot
from ._score import Score, score
from ._select import Candidate, Figure, LeftOut, Selection, select
from ._settings import Config, Gravity, Preset, Times, TimeUnit
from ._stream import Estimate, Estimator

__all__ = [
    "AXES",
    "FLAGS",
    "SENT_FLAGS",
    "STATES",
    "Base",
    "Calibration",
    "Candidate",
    "Config",
    "ContactClassifier",
    "Decoded",
    "Estimate",
    "Estimator",
    "Event",
    "Figure",
    "Finding",
    "Gravity",
    "LeftOut",
    "Leg",
    "Preset",
    "Recording",
    "Result",
    "Robot",
    "RobotLeg",
    "Score",
    "Selection",
    "Simulation",
    "TimeUnit",
    "Times",
    "__version__",
    "calibrate",
    "decode",
    "estimate",
    "estimate_file",
    "read",
    "score",
    "select",
    "simulate",
    "simulate_robot",
]
