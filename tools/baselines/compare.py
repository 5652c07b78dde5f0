"""Results of simpler methods for blind trials, compared with those of `trueup trial run` (docs/blind-trials.md).

    python tools/baselines/compare.py TRIALS... --train DIR... [--cache DIR] [-o table.md]
"""

import argparse
import os
import sys
from pathlib import Path

# Problems are small: several threads would only wait for each other. To be set before numpy is loaded.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cases  # noqa: E402
import score  # noqa: E402
import sparse  # noqa: E402
from forest import Forest  # noqa: E402
from reduced import reduced  # noqa: E402


def arguments():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("trials", type=Path, nargs="+", help="folders of trials, with results of `trueup trial run`")
    a.add_argument("--train", type=Path, nargs="+", default=[], help="trials of other seeds, for the forest")
    a.add_argument("--cache", type=Path, help="folder for what cases are reduced to; a later run goes on from there")
    a.add_argument("--all", action="store_true", help="count cases without a result too")
    a.add_argument("-o", "--output", type=Path, help="the table as Markdown; on standard output if not given")
    return a.parse_args()


def reduce_all(found, cache, what):
    """The reduced problem of every (trial, name)."""
    problems = []
    for i, (trial, name) in enumerate(found, 1):
        print(f"{what} {i}/{len(found)} {name}", file=sys.stderr, flush=True)
        problems.append(reduced(trial / "cases" / name, cache))
    return problems


def main():
    a = arguments()
    found = [(t, n) for t in a.trials for n in cases.names(t)]
    said = {pair: cases.diagnosis(*pair) for pair in found}
    if not a.all:
        found = [pair for pair in found if said[pair] is not None]
    taught = [(t, n) for t in a.train for n in cases.names(t)]
    both = {n for _, n in found} & {n for _, n in taught}
    if both:
        raise SystemExit(f"{min(both)} is in the trials and in --train: generate the latter with another --seed")
    if not found:
        raise SystemExit("no case has a result yet: run `trueup trial run` first, or give --all")

    text = []
    problems = reduce_all(found, a.cache, "case")
    lessons = reduce_all(taught, a.cache, "training case")
    keys = [cases.Key.read(*pair) for pair in found]
    known = [cases.Key.read(*pair) for pair in taught]
    for plant in ("joint", "manipulator"):
        mine = [i for i, k in enumerate(keys) if k.plant == plant]
        if not mine:
            continue
        results = [said[found[i]] for i in mine]
        answers = {
            "Trueup": [None if r is None else cases.trueup(r) for r in results],
            "refit of parameters": [None if r is None else cases.refit(r) for r in results],
            "STLSQ": [sparse.answer(problems[i]) for i in mine],
        }
        lesson = [i for i, k in enumerate(known) if k.plant == plant]
        if lesson:
            forest = Forest([_features(lessons[i]) for i in lesson], [known[i] for i in lesson])
            print(f"{plant}: forest, right out of bag: {forest.forest.oob_score_:.2f}", file=sys.stderr)
            answers["random forest"] = forest.answers([_features(problems[i]) for i in mine])
        text.append(score.table(plant, [keys[i] for i in mine], answers))
    if a.output:
        a.output.write_text("\n".join(text))
    else:
        print("\n".join(text))


def _features(problem):
    return problem["features"] if problem else None


if __name__ == "__main__":
    main()
