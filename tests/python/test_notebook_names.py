"""What can be checked of the notebooks without running them (./test --full runs them): their code, and the names of the package."""

import ast
import functools
import json

import pytest
from conftest import ROOT

PACKAGE = ROOT / "crates" / "python" / "python" / "trueup"
NOTEBOOKS = sorted((ROOT / "crates" / "python" / "notebooks").glob("*.ipynb"))


@functools.cache
def public():
    """`__all__` of the package."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    (names,) = (ast.literal_eval(n.value) for n in tree.body if isinstance(n, ast.Assign) and n.targets[0].id == "__all__")
    return set(names)


@functools.cache
def methods(name):
    """Of a class of the package: its own and those of the classes that it extends."""
    found, bases = set(), set()
    for file in PACKAGE.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ClassDef) and node.name == name:
                found |= {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
                bases |= {base.id for base in node.bases if isinstance(base, ast.Name)}
    return found.union(*(methods(base) for base in bases))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_python_with_names_that_are_there(notebook):
    cells = json.loads(notebook.read_text())["cells"]
    assert not any(cell.get("outputs") for cell in cells), "committed notebooks hold no outputs"
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    names = public()
    made = {}
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "tu":
            assert node.attr in names, f"tu.{node.attr}"
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and isinstance(node.value.func, ast.Attribute):
            call = node.value.func
            if isinstance(call.value, ast.Name) and call.value.id == "tu" and isinstance(node.targets[0], ast.Name):
                made[node.targets[0].id] = {"diagnose": "Diagnosis", "identify": "Fit"}.get(call.attr, call.attr)
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and made.get(node.value.id, "")[:1].isupper():
            kind = made[node.value.id]
            assert node.attr in methods(kind) or node.attr in {"json", "notes"}, f"{kind}.{node.attr}"
