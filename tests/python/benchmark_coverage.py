"""Coverage of the 95 % intervals of `trueup identify`, and errors of two methods on the same made cases.

    python tests/python/benchmark_coverage.py target/release/trueup FOLDER --plant joint --seed 650111 --count 200

Cases are those of `trueup trial generate --split none` with other values in `[parameters]`: what is fitted begins at 0.8 to 1.25 of the true value,
inertias (of an arm masses, too) are drawn from their priors (5 %), all others are the true ones. Results are appended to FOLDER/results.csv and kept: a second
call goes on. The first method of `--methods` is the one that the others are compared with.
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import tomllib
from pathlib import Path

import numpy as np

FIT = {"joint": ("stiffness", "damping", "coulombFriction", "viscousFriction"), "manipulator": ("jointStiffness", "jointDamping")}
PRIOR = {
    "joint": ("motorInertia", "loadInertia"),
    "manipulator": ("linkMass", "linkInertia", "motorInertia", "baseMass", "baseInertia"),
}
DEVIATION = 0.05
FIELDS = ("case", "method", "parameter", "truth", "value", "error", "low", "high", "prior", "seconds")


def wilson(hits, of, z=1.959964):
    """The interval of a share (Wilson 1927)."""
    p, q = hits / of, z * z / of
    middle, half = (p + q / 2) / (1 + q), z * np.sqrt(p * (1 - p) / of + q / (4 * of)) / (1 + q)
    return middle - half, middle + half


def write(made, key, folder, plant, rng):
    """The case with other values, next to its recordings; which parameters are judged, with their true values."""
    truth = tomllib.loads(key.read_text())["parameters"]
    text = (made / "case.toml").read_text()
    given = tomllib.loads(text)["parameters"]
    of = lambda names: [n for n, value in truth.items() if n.split("[")[0] in names[plant] and value > 0]
    values = {n: truth[n] * np.exp(rng.uniform(-0.22, 0.22)) for n in of(FIT)}
    values |= {n: truth[n] / (1 + DEVIATION * rng.standard_normal()) for n in of(PRIOR)}
    for name, value in values.items():
        array, _, index = name.partition("[")
        if index and array in given:
            given[array][int(index[:-1]) - 1] = value
        else:
            given[name] = value
    if plant == "joint":
        given["staticFriction"] = 0.0
    head, rest = text.split("[parameters]")[0], text.split("[channels", 1)
    table = lambda items: [f'"{k}" = {json.dumps(v)}' for k, v in items]
    out = [head, "[parameters]", *table(given.items()), "", "[uncertain]", *table((n, DEVIATION) for n in of(PRIOR))]
    out += ["", "[fit]", f"parameters = {json.dumps(of(FIT))}", "", "[channels" + rest[1]]
    folder.mkdir(parents=True, exist_ok=True)
    for file in made.glob("*.csv"):
        link = folder / file.name
        if not link.exists():
            link.symlink_to(file.resolve())
    (folder / "case.toml").write_text("\n".join(out))
    return {n: truth[n] for n in values}


def run(binary, folder, method):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([binary, "identify", folder, "--method", method, "--json"], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode:
        return None, seconds, done.stderr.strip().splitlines()[-1]
    return json.loads(done.stdout), seconds, ""


def table(rows, methods):
    """Coverage by parameter and method, errors of the further methods over those of the first."""
    of = {(r["case"], r["method"], r["parameter"]): r for r in rows}
    names = sorted({r["parameter"].split("[")[0] for r in rows if r["parameter"]})
    number = lambda r, k: float(r[k]) if r[k] else np.nan
    print("| parameter | method | covered | 95 % interval of that | rms of error / standard error |")
    print("|---|---|---|---|---|")
    for name in [*names, ""]:
        for method in methods:
            own = [r for r in rows if r["method"] == method and r["parameter"] and (not name or r["parameter"].split("[")[0] == name)]
            closed = [r for r in own if r["low"] and r["high"] and r["error"]]
            if not closed:
                continue
            hits = sum(number(r, "low") <= number(r, "truth") <= number(r, "high") for r in closed)
            z = [(number(r, "value") - number(r, "truth")) / number(r, "error") for r in closed]
            a, b = wilson(hits, len(closed))
            share = f"{hits} of {len(closed)}, {100 * hits / len(closed):.1f} %"
            print(f"| {name or 'together'} | {method} | {share} | {100 * a:.1f} to {100 * b:.1f} % | {np.sqrt(np.mean(np.square(z))):.2f} |")
    print(f"\n| absolute error over that of {methods[0]} | rms over rms, in standard errors of {methods[0]} | quantiles 10, 50, 90 % | standard errors, 10, 50, 90 % | cases |")
    print("|---|---|---|---|---|")
    for method in methods[1:]:
        for name in [*names, ""]:
            pairs = [(r, of.get((r["case"], method, r["parameter"]))) for r in rows if r["method"] == methods[0] and r["parameter"] and (not name or r["parameter"].split("[")[0] == name)]
            pairs = [(a, b) for a, b in pairs if b and a["error"] and b["error"]]
            if not pairs:
                continue
            off = lambda r: abs(number(r, "value") - number(r, "truth"))
            ratio = np.quantile([off(b) / max(off(a), 1e-300) for a, b in pairs], [0.1, 0.5, 0.9])
            errors = np.quantile([number(b, "error") / number(a, "error") for a, b in pairs], [0.1, 0.5, 0.9])
            size = lambda k: np.sqrt(np.mean([(off(p[k]) / number(p[0], "error")) ** 2 for p in pairs]))
            print(f"| {name or 'together'}, {method} | {size(1):.2f} / {size(0):.2f} | {ratio[0]:.2f}, {ratio[1]:.2f}, {ratio[2]:.2f} | {errors[0]:.2f}, {errors[1]:.2f}, {errors[2]:.2f} | {len(pairs)} |")
    for method in methods:
        seconds = {r["case"]: float(r["seconds"]) for r in rows if r["method"] == method}
        if seconds:
            q = np.quantile(list(seconds.values()), [0.5, 0.95])
            failed = sum(1 for r in rows if r["method"] == method and not r["parameter"])
            print(f"\n{method}: {len(seconds)} cases, {failed} without a result; processor seconds {q[0]:.1f} in the median, 95 % below {q[1]:.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--plant", default="joint", choices=FIT)
    parser.add_argument("--seed", type=int, default=650111)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--methods", nargs="+", default=["output-error", "innovations"])
    parser.add_argument("--table", action="store_true", help="print what is there")
    args = parser.parse_args()
    os.environ["RAYON_NUM_THREADS"] = "1"
    results = args.folder / "results.csv"
    rows = list(csv.DictReader(results.open())) if results.exists() else []
    if not args.table:
        made = args.folder / "made"
        generate = [args.binary, "trial", "generate", "--plant", args.plant, "--split", "none", "--count", str(args.count), "--seed", str(args.seed), "-o", made]
        subprocess.run(generate, check=True, stdout=subprocess.DEVNULL)
        done = {(r["case"], r["method"]) for r in rows}
        with results.open("a", newline="") as file:
            out = csv.DictWriter(file, FIELDS)
            if not rows:
                out.writeheader()
            for number, key in enumerate(sorted((made / "keys").glob("*.toml"))):
                folder = args.folder / "cases" / key.stem
                judged = write(made / "cases" / key.stem, key, folder, args.plant, np.random.default_rng([args.seed, number]))
                for method in args.methods:
                    if (key.stem, method) in done:
                        continue
                    found, seconds, why = run(args.binary, folder, method)
                    if found is None:
                        print(f"{key.stem}, {method}: {why}")
                    own = {**found["parameters"], **found["uncertain"]} if found else {}
                    for name in [n for n in judged if n in own] or [""]:
                        e = own.get(name, {"value": "", "standard_error": "", "ci95": ["", ""]})
                        blank = lambda x: "" if x is None else x
                        low, high = map(blank, e["ci95"])
                        row = dict(zip(FIELDS, (key.stem, method, name, judged.get(name, ""), e["value"], blank(e["standard_error"]), low, high, e.get("prior", ""), f"{seconds:.2f}")))
                        out.writerow(row)
                        rows.append(row)
                    file.flush()
    table(rows, args.methods)


if __name__ == "__main__":
    main()
