"""The notebooks run from top to bottom through the API alone, and are kept without outputs."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
PLOTLY = "application/vnd.plotly.v1+json"


@cache
def shown_by(path: Path) -> list[dict[str, Any]]:
    """What the cells of a notebook display when it is run from top to bottom, by MIME type."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(FOLDER)}}).execute()
    return [output["data"] for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output]


def test_there_are_notebooks() -> None:
    assert {path.stem for path in NOTEBOOKS} >= {
        "first_study",
        "the_44_configurations",
        "sweep_and_front",
        "end_to_end_check",
    }


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_stripped(path: Path) -> None:
    cells = nbformat.read(path, as_version=4).cells
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)


def modules_imported_by(code: str) -> Iterator[str]:
    """Every module that code imports, and every name that it imports from a package, with dots."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{'.' * node.level}{node.module or ''}.{name.name}" for name in node.names)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_api_is_the_only_door(path: Path) -> None:
    cells = [cell.source for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    ours = {name for code in cells for name in modules_imported_by(code) if name.split(".")[0] in {"designer", ""}}
    assert ours == {"designer.api"}
    assert not any("import_module" in code or "__import__" in code for code in cells)


def test_other_doors_are_noticed() -> None:
    code = (
        "from designer import api\nfrom designer.api import study\nimport designer.trace as t, numpy\nfrom . import x"
    )
    assert list(modules_imported_by(code)) == ["designer.api", "designer.api.study", "designer.trace", "numpy", "..x"]


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs_and_figures_are_pictures(path: Path) -> None:
    shown = shown_by(path)
    assert any(kind.startswith("image/") for data in shown for kind in data)
    # A figure that the kernel cannot draw is shown as the words <Figure size ...> alone.
    assert not [data for data in shown if set(data) == {"text/plain"} and data["text/plain"].startswith("<Figure")]


@pytest.mark.slow
def test_the_front_is_interactive() -> None:
    pytest.importorskip("plotly")
    (figure,) = [data[PLOTLY] for data in shown_by(FOLDER / "sweep_and_front.ipynb") if PLOTLY in data]
    designs = figure["data"][0]["text"]
    assert len(figure["layout"]["sliders"][0]["steps"]) == len(designs) > 1
    assert all("folded-HyHy-Hy" in text for text in designs)
