"""What the two plants have in common: columns of a regression from their balances.

A plant's balances are what is left of its equations of motion with measured angles and nominal parameters. A column
is the change of the balances by a parameter, by a signal at a port (a place where torque, force or deflection can be
added) or by a signal in a reading.
"""

from dataclasses import dataclass
from typing import Any, Callable

import numpy as np


class TooLittle(Exception):
    """Not enough is measured for balances."""


@dataclass
class Term:
    """A candidate: columns that together represent an effect at a place. Of several shapes the best one is taken."""

    effect: str
    place: str
    # (run, shape) -> list of {port or "reading:<channel>": signal at all samples}
    build: Callable[[Any, Any], list]
    shapes: tuple = (None,)


@dataclass
class Push:
    """A candidate for impulses at unknown times: together at these ports."""

    effect: str
    place: str
    ports: list


@dataclass
class Wave:
    """A candidate for what repeats with an angle: sine and cosine of the order that a periodogram shows best."""

    effect: str
    place: str
    port: str
    angle: Callable[[Any], Any]  # run -> angle at all samples
    orders: tuple


class Plant:
    """Balances of one case; the plants fill in `balances`, `parameters`, `rows`, `terms`."""

    slow = False  # rows that remember what happened before

    def __init__(self, case):
        self.case, self.p = case, case.parameters

    def ready(self, run, x):
        """A signal of all samples as `balances` requires it: value and two derivatives."""
        return run.at(x)

    def points(self, run, rows):
        """Balances at the samples that take part in the regression."""
        return rows

    def left(self, run, p=None, y=None, f={}):
        """What is left of the balances."""
        return self.points(run, self.balances(p or self.p, y or run.y, f))

    def nuisance(self, run):
        """Rows that say nothing, per recording."""
        return []

    def valid(self, run):
        """Where the balances hold: (rows, points)."""
        return np.ones_like(run.r, bool)

    def by_parameter(self, run, name):
        """Change of the balances for a change of a parameter by its own value."""
        h = 1e-4
        return (self.left(run, {**self.p, name: self.p[name] * (1 + h)}) - run.r) / h

    def by_signals(self, run, signals):
        """Change of the balances by signals at ports and in readings."""
        ports = {k: self.ready(run, x) for k, x in signals.items() if not k.startswith("reading:")}
        column = self.left(run, f=ports) - run.r if ports else np.zeros_like(run.r)
        for key in signals.keys() - ports.keys():
            channel, change = key.removeprefix("reading:"), self.ready(run, signals[key])
            # A small change: readings of angles enter the arm's balances nonlinearly.
            h = 1e-4 / (np.abs(change[0]).max() + 1e-300)
            column = column + (self.left(run, y={**run.y, channel: run.y[channel] + h * change}) - run.r) / h
        return column
