"""A run of an FMU for Model Exchange by SciPy's DOP853 from event to event, about as exact as doubles allow."""

import bisect
import ctypes

import numpy as np
from low_level import Opened
from scipy.integrate import solve_ivp

# Longest step, s: an indicator that changes its sign twice within one would not be seen to do so.
LONGEST = 0.01
# So far beyond a root that was located the event is handled, s: at the root itself it may not be due, by rounding.
BEYOND = 1e-12


class Signal:
    """Straight between knots (time, value), constant after the last one."""

    def __init__(self, *knots):
        self.times, self.values = ([float(v) for v in column] for column in zip(*knots, strict=True))

    def __call__(self, t):
        i = bisect.bisect(self.times, t)
        if i in (0, len(self.times)):
            return self.values[max(i - 1, 0)]
        (t0, t1), (a, b) = self.times[i - 1 : i + 1], self.values[i - 1 : i + 1]
        return a + (b - a) / (t1 - t0) * (t - t0)

    def modelica(self):
        """The same as an expression of Modelica."""
        t, y = self.times, self.values
        pieces = zip(t, y, t[1:], y[1:], strict=False)
        text = (f"if time < {t1!r} then {a!r} + ({(b - a) / (t1 - t0)!r}) * (time - {t0!r}) else " for t0, a, t1, b in pieces)
        return "".join(text) + repr(y[-1])


class Exchange:
    """The calls of Model Exchange on plain arrays."""

    def __init__(self, opened, inputs):
        self.opened, self.fmu, self.inputs = opened, opened.fmu, inputs
        description = opened.description
        third = opened.version == 3
        self.rates_of = self.fmu.getContinuousStateDerivatives if third else self.fmu.getDerivatives
        states = sum(opened._size(v) for v in description.modelVariables if v.derivative is not None)
        self.states = np.zeros(states)
        self.indicators = np.zeros(len(description.eventIndicators) if third else description.numberOfEventIndicators)
        self.filled = np.zeros(states)
        self.references = [opened.variables[name].valueReference for name in inputs]
        self.set_inputs = self.fmu.setFloat64 if third else self.fmu.setReal
        # Made once: what a call costs here is Python.
        self.pointers = {
            id(a): a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (self.states, self.filled, self.indicators)
        }

    def _call(self, call, array):
        call(self.pointers[id(array)], len(array))
        return array

    def put(self, t, states=None):
        """Sets the time, the inputs of that time, and the states."""
        self.fmu.setTime(t)
        if states is not None:
            self.states[:] = states
            self._call(self.fmu.setContinuousStates, self.states)
        if self.references:
            self.set_inputs(self.references, [signal(t) for signal in self.inputs.values()])

    def rates(self, t, states):
        self.put(t, states)
        return self._call(self.rates_of, self.filled).copy()

    def event(self, t, states=None):
        """Handles what is due at `t`; the states from there on."""
        self.put(t, states)
        self.opened.event()
        return self._call(self.fmu.getContinuousStates, self.filled).copy()

    def roots(self):
        """The indicators as functions of time and states that end a step of SciPy's."""

        def root(i):
            def value(t, states):
                self.put(t, states)
                return self._call(self.fmu.getEventIndicators, self.indicators)[i]

            value.terminal = True
            return value

        return [root(i) for i in range(len(self.indicators))]


def run(path, start, inputs, grid, names, watch=(), times=(), rtol=1e-12):
    """Values of `names` at the times of `grid`, the last of which ends the run, and the times at which an output of `watch`
    (Booleans) changed. `inputs` has a Signal for each input that is not 0, `start` values of parameters; at `times` there are
    events that no indicator shows.

    Values between the ends of steps are interpolated, and what that leaves no tolerance bounds: where a law has a kink (bristles
    whose velocity turns) up to 2e-6 at a tolerance of 1e-10, 1e-9 at that of here."""
    with Opened(path, "ME") as opened:
        opened.initialize(start | {name: signal(0.0) for name, signal in inputs.items()})
        fmu = Exchange(opened, inputs)
        references = [opened.variables[name].valueReference for name in watch]

        def look():
            return tuple(map(bool, fmu.fmu.getBoolean(references))) if references else ()

        t, states, changes, rows = 0.0, fmu.event(0.0), [], []
        seen = look()
        left = list(grid)
        knots = {float(k) for s in inputs.values() for k in s.times if 0 < k < grid[-1]}
        for end in sorted(knots | {float(t) for t in times if 0 < t < grid[-1]} | {float(grid[-1])}):
            while t < end:
                step = solve_ivp(fmu.rates, (t, end), states, "DOP853", events=fmu.roots(), dense_output=True,
                                 rtol=rtol, atol=1e-3 * rtol, max_step=LONGEST if watch else np.inf)  # fmt: skip
                assert step.success, step.message
                t, states = step.t[-1], step.y[:, -1]
                while left and left[0] < t or left and left[0] == grid[-1] == t:
                    fmu.put(left[0], step.sol(left[0]))
                    rows.append([opened.get(name) for name in names])
                    left.pop(0)
                if step.status == 1:
                    states = states + BEYOND * fmu.rates(t, states)
                    t += BEYOND
                states = fmu.event(t, states)
                if look() != seen:
                    changes.append(t)
                    seen = look()
        return np.array(rows), np.array(changes)
