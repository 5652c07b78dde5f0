"""Flexible manipulators as FMUs, anybody's FMUs, and what recordings say of them.

Quantities are in SI; times are in s.
"""

from ._errors import Error
from ._fmpy import simulate_fmu
from ._model import Model, models
from ._program import program
from ._result import Result
from ._system import Fmu, System, Variable, Variables

__version__ = "0.1.0"

__all__ = [
    "Error",
    "Fmu",
    "Model",
    "Result",
    "System",
    "Variable",
    "Variables",
    "models",
    "program",
    "simulate_fmu",
]
