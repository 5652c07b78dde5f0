"""Makes the recordings of this folder: python3 make.py PATH-OF-TRUEUP

A joint with play in its gear is simulated; the model in case.toml has none. What the program computes is read by coarse
sensors with noise, 125 readings a second.
"""

import csv
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
RATE = 125  # readings a second
FINE = 8  # communication steps a reading
SECONDS = 8
GAP = 0.08  # rad, at the motor: what the model lacks
TRUE = {
    "motorInertia": 2e-5,
    "loadInertia": 0.5,
    "gearRatio": 100.0,
    "torqueConstant": 0.05,
    "stiffness": 0.11,
    "damping": 1e-4,
    "coulombFriction": 0.005,
    "staticFriction": 0.005,
    "viscousFriction": 5e-5,
}
# Reading: step of a count, standard deviation of noise.
SENSORS = {"motorAngle": (2 * math.pi / 4096, 4e-4), "loadAngle": (2e-5, 1e-5), "motorCurrent": (None, 2e-4)}
# Frequencies in Hz, amplitudes in A, of each run.
RUNS = {
    "train-1": [(0.4, 0.35), (1.1, 0.3)],
    "train-2": [(0.6, 0.45), (1.7, 0.25)],
    "train-3": [(0.3, 0.3), (2.3, 0.35)],
    "holdout-1": [(0.5, 0.35), (1.4, 0.35)],
}


def read(value, sensor, chance):
    step, noise = SENSORS[sensor]
    value += chance.gauss(0.0, noise)
    return value if step is None else step * round(value / step)


def main(trueup):
    chance = random.Random(7)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        subprocess.run([trueup, "fmu", "pack", "TwoMassJoint", "--effect", "backlash", "--fmi", "3", "-o", folder], check=True, capture_output=True)
        (fmu,) = folder.glob("*.fmu")
        for name, waves in RUNS.items():
            phases = [chance.uniform(0, 2 * math.pi) for _ in waves]
            times = [k / (RATE * FINE) for k in range(SECONDS * RATE * FINE + 1)]
            # From rest: the current grows within half a second.
            current = [min(1.0, 2 * t) * sum(a * math.sin(2 * math.pi * f * t + p) for (f, a), p in zip(waves, phases)) for t in times]
            with open(folder / "in.csv", "w") as file:
                file.write("time,motorCurrent\n")
                file.writelines(f"{t!r},{i!r}\n" for t, i in zip(times, current))
            values = [x for pair in (TRUE | {"backlashGap": GAP}).items() for x in ("--set", "{}={!r}".format(*pair))]
            subprocess.run(
                [trueup, "simulate", fmu, "--input", folder / "in.csv", "--stop", str(SECONDS), "--step", repr(1 / (RATE * FINE)),
                 "--outputs", "motorAngle,loadAngle", "--interface", "me", "-o", folder / "out.csv", *values],
                check=True, capture_output=True)
            # Rows at events are between those of the grid.
            rows = {round(float(r["time"]) * RATE * FINE, 4): r for r in csv.DictReader(open(folder / "out.csv"))}
            with open(HERE / f"{name}.csv", "w") as file:
                file.write("time,motorCurrent,motorAngle,loadAngle\n")
                for k in range(0, len(times), FINE):
                    motor, load = (read(float(rows[k][c]), c, chance) for c in ("motorAngle", "loadAngle"))
                    file.write(f"{times[k]:.3f},{read(current[k], 'motorCurrent', chance):.5f},{motor:.5f},{load:.6f}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
