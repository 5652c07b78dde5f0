"""The Modelica package: read by pymoca, run by rumoca."""

from pathlib import Path

import numpy as np

PACKAGE = Path(__file__).resolve().parents[2] / "modelica/Trueup"


def files():
    """All files, packages before what they hold."""
    return sorted(PACKAGE.rglob("*.mo"), key=lambda f: (len(f.parts), f.name != "package.mo", f))


def class_of(file):
    """The class that a file holds, with its whole name."""
    parts = ["Trueup", *file.relative_to(PACKAGE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "package" else parts)


def parsed(text=None):
    """The package, or this text, as pymoca's tree."""
    from pymoca import parser

    tree = None
    for source in [text] if text else (file.read_text() for file in files()):
        part = parser.parse(source)
        assert part is not None, f"pymoca cannot parse {source[:80]} .."
        if tree is None:
            tree = part
        else:
            tree.extend(part)
    return tree


def flattened(tree, name):
    """A class without its hierarchy."""
    from pymoca import ast
    from pymoca.tree import flatten

    return flatten(tree, ast.ComponentRef.from_string(name)).classes[name]


def literal(value):
    """The number, Boolean, array of numbers or name of an item that an expression of pymoca is; None for any other."""
    from pymoca import ast

    if isinstance(value, ast.Primary):
        return value.value
    if isinstance(value, ast.ComponentRef):
        return str(value).split(".")[-1]
    if isinstance(value, ast.Array):
        return [literal(v) for v in value.values]
    if isinstance(value, ast.Expression) and value.operator == "-" and len(value.operands) == 1:
        inner = literal(value.operands[0])
        return None if inner is None else -inner
    return None


def run(source, grid, names, watch=(), solver="rk-like", tolerance=1e-12):
    """Model `T` of `source`, compiled and run by rumoca: values of `names` on the even `grid` that begins at 0 (from there
    on), and the times at which a Boolean of `watch` changed."""
    import rumoca

    model = rumoca.Session(roots=[str(PACKAGE)]).loads(source, model="T")
    config = rumoca.SimConfig(solver=solver, rtol=tolerance, atol=1e-2 * tolerance)
    result = model.simulate(t=(0.0, float(grid[-1])), dt=float(grid[1] - grid[0]), config=config)
    time = np.asarray(result.time)
    last = [np.flatnonzero(np.abs(time - t) < 1e-9)[-1] for t in grid]
    values = np.array([np.asarray(result[name], dtype=float)[last] for name in names]).T
    changed = np.zeros(len(time) - 1, dtype=bool)
    for name in watch:
        changed |= np.diff(np.asarray(result[name])) != 0
    return values, time[1:][changed]
