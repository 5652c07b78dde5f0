"""Flexible manipulators as FMUs, FMUs of any tool, and diagnoses from recordings.

Quantities are in SI; times are in s.
"""

from ._case import Case, Problem
from ._diagnosis import Diagnosis, diagnose
from ._errors import Error
from ._fit import Fit, identify
from ._fmpy import simulate_fmu
from ._instance import Derivatives, Instance
from ._model import Model, models
from ._program import program
from ._result import Result
from ._sweep import sweep
from ._system import Fmu, Linear, System, Variable, Variables

__all__ = [
    "Case",
    "Derivatives",
    "Diagnosis",
    "Error",
    "Fit",
    "Fmu",
    "Instance",
    "Linear",
    "Model",
    "Problem",
    "Result",
    "System",
    "Variable",
    "Variables",
    "diagnose",
    "identify",
    "models",
    "program",
    "simulate_fmu",
    "sweep",
]
