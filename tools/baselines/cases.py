"""Cases, keys and results of blind trials, read from their files."""

import hashlib
import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas


def _flat(table):
    """Arrays as single elements under the names that FMI 2.0 gives them: `linkMass[1]`, `linkCenterOfMass[2,1]`."""
    flat = {}
    for name, value in table.items():
        if isinstance(value, list):
            for index in np.ndindex(np.shape(value)):
                element = np.array(value, dtype=object)[index]
                flat[f"{name}[{','.join(str(i + 1) for i in index)}]"] = element
        else:
            flat[name] = value
    return flat


@dataclass
class Case:
    """What a method may see of a case."""

    folder: Path
    model: str
    parameters: dict
    sensors: dict
    train: list
    holdout: list
    rest: list

    @classmethod
    def read(cls, folder):
        with open(folder / "case.toml", "rb") as file:
            table = tomllib.load(file)
        return cls(
            folder,
            table["model"],
            _flat(table.get("parameters", {})),
            table.get("channels", {}),
            table["train"],
            table.get("holdout", []),
            table.get("rest", []),
        )

    def recording(self, name):
        """Time and channels of one recording; missing samples are nan."""
        columns = pandas.read_csv(self.folder / name)
        return columns.pop("time").to_numpy(float), {c: columns[c].to_numpy(float) for c in columns}

    def deviation(self, channel):
        """Standard deviation of a reading as declared: noise and the steps of its resolution."""
        sensor = self.sensors.get(channel, {})
        return np.hypot(sensor.get("noise", 0.0), sensor.get("resolution", 0.0) / np.sqrt(12))

    def held(self, channel):
        """An input that stays as it is until the next sample."""
        return self.sensors.get(channel, {}).get("interpolation") == "hold"


@dataclass
class Key:
    """The truth of a case."""

    plant: str
    split: str
    effects: list
    ratio: float

    @classmethod
    def read(cls, trial, name):
        """Refuses a key that is not the one that was sealed."""
        path = trial / "keys" / f"{name}.toml"
        data = path.read_bytes()
        if f"{name},{hashlib.sha256(data).hexdigest()}" not in (trial / "seals.csv").read_text().splitlines():
            raise SystemExit(f"{path} is not the key that was sealed")
        table = tomllib.loads(data.decode())
        return cls(table["plant"], table["split"], table["effects"], table["ratio"])


@dataclass
class Answer:
    """The result of a method for a case."""

    verdict: str
    effects: list = field(default_factory=list)  # claimed, first the most important one
    ranked: list = field(default_factory=list)  # all candidates, likeliest first
    closed: float | None = None
    classes: list = field(default_factory=list)  # sets of ids that are declared to be indistinguishable

    def first(self):
        return self.effects[0] if self.verdict == "effects" and self.effects else None

    def alike(self, effect):
        """What counts as `effect`: its set, unless that has more than three members (as in score.rs)."""
        alike = [effect] + [m for s in self.classes if effect in s for m in s if m != effect]
        return set(alike) if len(set(alike)) <= 3 else {effect}


def diagnosis(trial, name):
    """diagnosis.json of a case; nothing where there is none yet, {} where the diagnosis failed."""
    path = trial / "results" / name / "diagnosis.json"
    if path.is_file():
        return json.loads(path.read_text())
    return {} if (trial / "results" / f"{name}.error").is_file() else None


def trueup(said):
    """The product's own answer."""
    if not said:
        return Answer("failed")
    claims = [e["id"] for e in said["effects"]]
    ranked = [c["id"] for c in said.get("candidates") or said["effects"]]
    return Answer(
        said["verdict"],
        claims,
        list(dict.fromkeys(ranked)),
        said["gap"]["overall"]["closed"],
        said["indistinguishable"],
    )


def refit(said, near=2.0):
    """What follows from a refit of all parameters alone: near the floor is within `near` times the floor."""
    if not said:
        return Answer("failed")
    gap = said["gap"]["overall"]
    before, tuned, floor = gap["before"], gap["tuned"], gap["floor"]
    closed = (before - tuned) / (before - floor) if before > floor else None
    if before <= near * floor:
        return Answer("no-gap", closed=closed)
    return Answer("parameters" if tuned <= near * floor else "unknown", closed=closed)


def names(trial):
    """Names of the cases of a trial."""
    return sorted(p.name for p in (trial / "cases").iterdir() if p.is_dir() and not p.name.startswith("."))
