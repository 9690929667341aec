"""The notebooks of examples/ run from top to bottom, and are kept without what they print."""

import os

import pytest
from conftest import ROOT

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
FOLDER = ROOT / "examples" / "notebooks"
NEEDS = {"bodies": ("scipy", "matplotlib"), "linkages": ("matplotlib",), "beams": ("matplotlib",)}
PICTURES = {"bodies": 2, "linkages": 2, "beams": 2}


def test_all_are_known():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(NEEDS)


@pytest.mark.timeout(240)
@pytest.mark.parametrize("name", sorted(NEEDS))
def test_runs(limberd, name, tmp_path):
    for package in ("ipykernel", *NEEDS[name]):
        pytest.importorskip(package)
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear the outputs before keeping it"
    environment = dict(os.environ, LIMBER_BIN=str(limberd.parent), IPYTHONDIR=str(tmp_path))
    client = nbclient.NotebookClient(notebook, timeout=200, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}})
    client.execute(env=environment)
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    shown = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(shown) == PICTURES[name]
