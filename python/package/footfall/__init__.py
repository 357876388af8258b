"""How probable it is that a robot's foot stands firmly, from the IMU on it.

The estimator is that of the firmware and of the program ``footfall``, to the bit.

>>> import footfall
>>> walk = footfall.simulate("walk", seconds=10.0, seed=1)
>>> result = walk.estimate()
>>> result.p_stable.shape
(10000,)

========================  ==================================================================
:func:`estimate`          probabilities of a whole recording that is in arrays
:class:`Estimator`        the same, sample by sample
:func:`read`              recordings from files of every format that the program reads
:func:`simulate`          a recording of a simulated foot, with the truth about it
:func:`calibrate`         what a foot teaches, for a warm start
========================  ==================================================================
"""

from ._calibration import Calibration, calibrate
from ._estimate import estimate
from ._footfall import AXES, FLAGS, STATES, __version__
from ._recording import Recording, read, simulate
from ._result import Event, Finding, Result
from ._stream import Estimate, Estimator

__all__ = [
    "AXES",
    "FLAGS",
    "STATES",
    "Calibration",
    "Estimate",
    "Estimator",
    "Event",
    "Finding",
    "Recording",
    "Result",
    "__version__",
    "calibrate",
    "estimate",
    "read",
    "simulate",
]
