"""Flexible manipulators as FMUs, FMUs of any tool, and diagnoses from recordings.

Quantities are in SI; times are in s.
"""

from ._case import Case, Diagnosis, Fit, Problem, diagnose, identify
from ._errors import Error
from ._fmpy import simulate_fmu
from ._model import Model, models
from ._program import program
from ._result import Result
from ._sweep import sweep
from ._system import Fmu, Linear, System, Variable, Variables

__all__ = [
    "Case",
    "Diagnosis",
    "Error",
    "Fit",
    "Fmu",
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
