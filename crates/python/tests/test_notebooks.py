"""The notebooks run."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"


@pytest.mark.parametrize("name", ["simulate", "identify", "diagnose", "control", "close_the_gap", "arviz_plots"])
def test_a_notebook_runs(name, tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "committed notebooks hold no outputs"
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(FOLDER)}}).execute()
    assert any(cell.get("outputs") for cell in notebook.cells)


def test_all_of_them_are_run():
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == ["arviz_plots", "close_the_gap", "control", "diagnose", "identify", "simulate"]
