"""Fits the logistic models of the innovations engine (crates/hypotheses/src/innovations/levels.rs) to trial cases of development seeds.

    trueup trial generate -o TRIALS --plant joint --split single --count 60 --seed SEED        (every split)
    cargo run --release --example stages -- TRIALS/cases/* >STAGES
    python tools/levels/fit_levels.py STAGES=TRIALS ...

Of arms (--plant manipulator) the stages are those of the example `arms`. A call takes joints or arms.

STAGES has a JSON object a line, or is a folder of such files. The program prints, for the weights as they are and for the fitted ones, how
many cases are on the wrong side of a half, the Brier score, and both again by five folds (fitted without the fold that is judged); then the
fitted weights as Rust source. Weights stay near the present ones as far as the cases do not say otherwise (ridge regression towards them).
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

LEVELS = Path(__file__).parents[2] / "crates/hypotheses/src/innovations/levels.rs"
RIDGE = 0.3
FOLDS = 5

Numbers = dict[str, float]
Rows = list[tuple[str, Numbers, bool]]


def present(name: str) -> Numbers:
    """Weights of a model as levels.rs has them."""
    block = re.search(rf"pub const {name}: LogisticWeights = &\[(.*?)\];", LEVELS.read_text(), re.S)
    if block is None:
        raise SystemExit(f"{LEVELS} has no {name}")
    pairs = re.findall(r'\("(\w+)", (-?[\d._]+)\)', block[1])
    return {key: float(value.replace("_", "")) for key, value in pairs}


def constant(name: str) -> list[float]:
    """Numbers of a constant of levels.rs."""
    found = re.search(rf"pub const {name}: [^=]*= \[?([^;]*?)\]?;", LEVELS.read_text())
    if found is None:
        raise SystemExit(f"{LEVELS} has no {name}")
    return [float(x.replace("_", "")) for x in found[1].split(",")]


def power(q: list[float]) -> float:
    return sum(x * x for x in q)


def cases(source: str) -> Iterator[tuple[str, dict, dict]]:
    """Name, key and stages of every case of `STAGES=TRIALS`."""
    first, equals, second = source.partition("=")
    if not equals:
        raise SystemExit(f"{source}: give STAGES=TRIALS")
    stages, trials = Path(first), Path(second)
    for file in sorted(stages.glob("*.json")) if stages.is_dir() else [stages]:
        for line in file.read_text().splitlines():
            said = json.loads(line)
            name = Path(said["case"]).name
            if "error" in said["stages"]:
                print(f"{name} is left out: {said['stages']['error']}", file=sys.stderr)
                continue
            key = next((trials / "keys").glob(f"*{name}*"), None)
            if key is None:
                raise SystemExit(f"{trials / 'keys'} has no key of {name}: give the trials that {stages} was made of")
            yield name, tomllib.loads((key / "key.toml" if key.is_dir() else key).read_text()), said["stages"]


def leaders(source: str) -> Rows:
    """Numbers of each leader, and whether it or what is alike is a true cause: which of them is not this number's question. Cases that
    have neither gain nor latent power decide nothing."""
    rows: Rows = []
    for name, key, stages in cases(source):
        verdict = stages["verdict"]
        if verdict["G"] > 5 or max(stages["parameters_L"]["q"]) > 0.02:
            named = [h["effect"] for h in alike(stages["hypotheses"])] + [effect for effect, _ in verdict["set"]]
            right = any(effect in key["effects"] for effect in named)
            rows.append((name, dict(verdict["numbers"]), right))
    return rows


def alike(hypotheses: list[dict]) -> list[dict]:
    """The leader and what recordings do not distinguish from it (ALIKE, ALIKE_FIT and ALIKE_MOST of levels.rs)."""
    leader = hypotheses[0]
    evidence, fit, most = constant("ALIKE")[0], constant("ALIKE_FIT")[0], int(constant("ALIKE_MOST")[0])
    near = [h for h in hypotheses if leader["L"] - h["L"] < evidence or leader["penalised"] - h["penalised"] < fit]
    return near[:most]


def seconds(source: str) -> Rows:
    """Numbers of each second cause next to a true leader, and whether both are the true pair."""
    rows: Rows = []
    for name, key, stages in cases(source):
        leader, truth = stages["hypotheses"][0], set(key["effects"])
        if leader["effect"] not in truth:
            continue
        for pair in stages["pairs"]:
            first = next((h for h in stages["hypotheses"] if h["effect"] == pair["first"]), None)
            gain = pair["L"] - leader["L"]
            if first is None or gain <= 0:
                continue
            numbers = {
                "gain": np.log10(np.clip(gain, 1, 1e5)),
                "same": float(first["place"] == pair["place"]),
                "share": gain / max(pair["L"] - stages["parameters_L"]["L"], 1.0),
                "power": np.clip(np.log10(power(first["q"]) / power(pair["q"])), -1, 4),
                "left": np.log10(max(pair["q"])),
            }
            rows.append((name, numbers, len(truth) == 2 and {pair["first"], pair["second"]} == truth))
    return rows


def power_over_floors(floors: list[list[float]]) -> float:
    """Power of an arm's latents above their floors; errors of readings count a tenth."""
    forces, readings = floors
    return 1 + sum(max(x, 1) ** 2 - 1 for x in [*forces, *(x / 10 for x in readings)])


def is_arm(source: str) -> bool:
    return any("floors" in stages["parameters_L"] for _, _, stages in cases(source))


def named(source: str) -> Rows:
    """What is named of each arm, and whether that is right: the effects of the case, or an `ambiguous` with its only one."""
    rows: Rows = []
    for name, key, stages in cases(source):
        verdict, truth = stages["verdict"], key["effects"]
        effects = [effect for effect, _ in verdict["set"]]
        if not effects:
            continue
        together = verdict["verdict"] == "effects" and len(effects) == 2
        left = stages["pairs" if together else "hypotheses"][0]["floors"]
        decades = np.log10(power_over_floors(stages["parameters_L"]["floors"]) / power_over_floors(left))
        alone = verdict["verdict"] == "ambiguous" and len(truth) == 1 and truth[0] in effects
        right = alone or verdict["verdict"] == "effects" and set(effects) == set(truth)
        rows.append((name, {"fall": float(np.clip(decades, -1, 4))}, right))
    return rows


def probability(weights: Numbers, rows: Rows) -> np.ndarray:
    sums = [weights["bias"] + sum(w * row[1][k] for k, w in weights.items() if k != "bias") for row in rows]
    return 1 / (1 + np.exp(-np.clip(sums, -30, 30)))


def fit(rows: Rows, old: Numbers) -> Numbers:
    """Weights of largest posterior: logistic likelihood, normal prior about the present weights of the standardized numbers."""
    names = [k for k in old if k != "bias"]
    table = np.array([[row[1][k] for k in names] for row in rows])
    mean, deviation = table.mean(0), table.std(0) + 1e-6
    z = np.c_[np.ones(len(rows)), (table - mean) / deviation]
    y = np.array([row[2] for row in rows], float)
    slopes = np.array([old[k] for k in names])
    prior = np.r_[old["bias"] + slopes @ mean, slopes * deviation]

    def cost(w: np.ndarray) -> float:
        return (np.logaddexp(0, z @ w) - y * (z @ w)).sum() + 0.5 * RIDGE * ((w - prior) ** 2).sum()

    w = minimize(cost, prior).x
    slopes = w[1:] / deviation
    return {"bias": float(w[0] - slopes @ mean)} | {k: float(v) for k, v in zip(names, slopes, strict=True)}


def score(title: str, p: np.ndarray, rows: Rows) -> None:
    y = np.array([row[2] for row in rows], float)
    wrong = int(((p > 0.5) != (y > 0.5)).sum())
    bins = []
    for low, high in ((0, 0.2), (0.2, 0.5), (0.5, 0.8), (0.8, 0.95), (0.95, 1.01)):
        of = (p >= low) & (p < high)
        if of.any():
            bins.append(f"{p[of].mean():.2f}: {y[of].mean():.2f} of {int(of.sum())}")
    print(f"  {title:<12} wrong side {wrong} of {len(rows)}, Brier {((p - y) ** 2).mean():.4f}; reported: true  " + ", ".join(bins))


def main(sources: list[str]) -> None:
    if not sources:
        raise SystemExit(__doc__)
    models = {"RIGHT": leaders, "SECOND": seconds}
    if all(map(is_arm, sources)):
        models = {"CHAIN_RIGHT": named}
    for name, of in models.items():
        rows = sum(map(of, sources), [])
        old = present(name)
        print(f"{name}: {len(rows)} rows, {sum(row[2] for row in rows)} true")
        score("as it is", probability(old, rows), rows)
        new = fit(rows, old)
        score("fitted", probability(new, rows), rows)
        fold = np.array([zlib.crc32(row[0].encode()) % FOLDS for row in rows])
        left_out = np.zeros(len(rows))
        for k in range(FOLDS):
            rest = [row for row, f in zip(rows, fold, strict=True) if f != k]
            part = [row for row, f in zip(rows, fold, strict=True) if f == k]
            if part:
                left_out[fold == k] = probability(fit(rest, old), part)
        score("five folds", left_out, rows)
        print(f"pub const {name}: LogisticWeights = &[")
        print("".join(f'    ("{k}", {v!r}),\n' for k, v in new.items()) + "];")


if __name__ == "__main__":
    main(sys.argv[1:])
