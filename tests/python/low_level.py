"""FMPy's bare FMI calls, alike for both versions."""

import shutil

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave


class Opened:
    """An FMU instance with its description; `with Opened(...) as f`."""

    def __init__(self, path, kind, tolerance=None):
        self.path, self.kind, self.tolerance = str(path), kind, tolerance

    def __enter__(self):
        self.description = read_model_description(self.path)
        self.version = 2 if self.description.fmiVersion.startswith("2") else 3
        self.folder = extract(self.path)
        classes = {(2, "ME"): FMU2Model, (2, "CS"): FMU2Slave, (3, "ME"): FMU3Model, (3, "CS"): FMU3Slave}
        self.fmu = classes[self.version, self.kind](
            guid=self.description.guid,
            unzipDirectory=self.folder,
            # An augmented FMU is called otherwise than its library.
            modelIdentifier=(self.description.coSimulation or self.description.modelExchange).modelIdentifier,
            instanceName="it",
        )
        self.fmu.instantiate()
        self.variables = {v.name: v for v in self.description.modelVariables}
        return self

    def __exit__(self, *_):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def initialize(self, start=None, stop=None):
        if self.version == 2:
            self.fmu.setupExperiment(tolerance=self.tolerance, stopTime=stop)
        for name, value in (start or {}).items():
            self.set(name, value)
        if self.version == 2:
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(tolerance=self.tolerance, stopTime=stop)
        self.fmu.exitInitializationMode()
        if self.kind == "ME":
            self.settle()
            self.fmu.enterContinuousTimeMode()

    def settle(self):
        if self.version == 2:
            while self.fmu.newDiscreteStates()[0]:
                pass
        else:
            while self.fmu.updateDiscreteStates()[0]:
                pass

    def event(self):
        self.fmu.enterEventMode()
        self.settle()
        self.fmu.enterContinuousTimeMode()

    def _size(self, v):
        n = 1
        for d in v.dimensions or []:
            n *= int(d.start)
        return n

    def set(self, name, value):
        v = self.variables[name]
        values = list(value) if hasattr(value, "__len__") else [value]
        if v.type in ("Real", "Float64"):
            (self.fmu.setReal if self.version == 2 else self.fmu.setFloat64)([v.valueReference], values)
        elif v.type == "Enumeration":
            (self.fmu.setInteger if self.version == 2 else self.fmu.setInt64)([v.valueReference], values)
        else:
            raise TypeError(v.type)

    def get(self, name):
        v = self.variables[name]
        if self.version == 2:
            return self.fmu.getReal([v.valueReference])[0]
        values = self.fmu.getFloat64([v.valueReference], nValues=self._size(v))
        return values if v.dimensions else values[0]

    def reals(self, causality):
        """(reference, number of elements) of the real variables with that causality."""
        return [
            (v.valueReference, self._size(v))
            for v in self.description.modelVariables
            if v.causality == causality and v.type in ("Real", "Float64") and v.variability == "continuous"
        ]
