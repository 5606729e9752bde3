"""Running an FMU tick by tick in the tests."""

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave


class Unit:
    """One instance of an FMU, its variables by name."""

    def __init__(self, path, folder, name="one", start=None, start_time=0.0):
        self.description = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.messages = []
        common = {
            # A library that is loaded must not be written over.
            "unzipDirectory": fmpy.extract(str(path), str(folder / name)),
            "modelIdentifier": self.description.coSimulation.modelIdentifier,
            "instanceName": name,
        }
        self.two = self.description.fmiVersion == "2.0"
        slave = FMU2Slave if self.two else FMU3Slave
        self.fmu = slave(guid=self.description.guid, **common)
        self.start_time, self.time = start_time, start_time
        if self.two:
            self.fmu.instantiate()
        else:
            self.fmu.instantiate(logMessage=lambda _, status, category, text: self.messages.append(text.decode()))
        self.begin(start or {})

    def begin(self, start):
        self.time = self.start_time
        if self.two:
            self.fmu.setupExperiment(startTime=self.start_time)
            self.set(start)
            self.fmu.enterInitializationMode()
        else:
            self.set(start)
            self.fmu.enterInitializationMode(startTime=self.start_time)
        self.fmu.exitInitializationMode()

    def set(self, values):
        if values:
            write = self.fmu.setReal if self.two else self.fmu.setFloat64
            write([self.references[name] for name in values], [float(value) for value in values.values()])

    def get(self, names):
        read = self.fmu.getReal if self.two else self.fmu.getFloat64
        return np.array(read([self.references[name] for name in names]))

    def step(self, length):
        self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=length)
        self.time += length

    def run(self, inputs, period, names):
        """Outputs before each step, the inputs of that step set: inputs are arrays over the ticks by name."""
        rows = []
        for k in range(len(next(iter(inputs.values())))):
            self.set({name: values[k] for name, values in inputs.items()})
            rows.append(self.get(names))
            self.step(period)
        return np.array(rows)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()
