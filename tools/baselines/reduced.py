"""Cases reduced to a small regression problem and features, kept from run to run."""

import hashlib
import os
from pathlib import Path

import numpy as np

from arm import Arm
from cases import Case
from evidence import Evidence
from joint import Joint
from plant import TooLittle

PLANTS = {"TwoMassJoint": Joint, "PlanarManipulator": Arm}
SOURCES = ("arm", "cases", "evidence", "joint", "plant", "reduced", "signals")


def _digest(folder):
    """Of the case and of the code that reduces it."""
    files = sorted(folder.iterdir()) + [Path(__file__).with_name(f"{name}.py") for name in SOURCES]
    return hashlib.sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


def reduced(folder, cache=None):
    """The problem as a dictionary; nothing where too little is measured for balances."""
    path = cache and cache / f"{folder.name}-{_digest(folder)}.npz"
    if path and path.is_file():
        return _read(path)
    case = Case.read(folder)
    _, channels = case.recording(case.train[0])
    arrays = {}
    try:
        evidence = Evidence(case, PLANTS[case.model](case, list(channels)))
        arrays = evidence.arrays | {
            "names": np.array([effect for effect, _ in evidence.names]),
            "feature": np.array(list(evidence.features)),
            "value": np.array(list(evidence.features.values()), float),
        }
    except TooLittle:
        pass
    if path:
        cache.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}.part")
        with open(part, "wb") as file:
            np.savez(file, **arrays)
        part.rename(path)
    return _problem(arrays)


def _read(path):
    with np.load(path) as arrays:
        return _problem(dict(arrays))


def _problem(arrays):
    if not arrays:
        return None
    features = dict(zip(arrays["feature"].tolist(), arrays["value"].tolist()))
    return arrays | {"names": arrays["names"].tolist(), "features": features}
