"""`report.json` and `report.html`: the whole story of a repair, readable offline and on its own."""

from __future__ import annotations

import base64
import json
import platform
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Any

from patchwright.pipelines.outputs import prepare_folder
from patchwright.pipelines.progress import Report
from patchwright.pipelines.study import Study
from patchwright.pipelines.summary import study_json

PACKAGES = (
    "patchwright",
    "numpy",
    "scipy",
    "numba",
    "manifold3d",
    "cadquery-ocp-novtk",
    "open3d-cpu",
    "open3d",
    "pyvista",
    "vtk",
)
PICTURES = ("before.png", "after.png", "deviation.png")
MOST_ROWS = 200


def write_report(study: Study, report: Report) -> tuple[str, ...]:
    """Write `report.json` and `report.html` into the study's folder; returns their names."""
    report("writing the report", 0.5)
    prepare_folder(study.folder)
    told = study_json(study)
    told["versions"] = versions()
    told["files"] = [*told["files"], "report.json", "report.html"]
    _replace(study.folder / "report.json", json.dumps(told, indent=1, allow_nan=False))
    _replace(study.folder / "report.html", html(told, study.folder))
    return "report.json", "report.html"


def versions() -> dict[str, str]:
    """The versions a result depends on."""
    out = {"python": platform.python_version(), "system": f"{platform.system()} {platform.machine()}"}
    for name in PACKAGES:
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            continue
    return out


def html(told: dict[str, Any], folder: Path) -> str:
    """One self-contained page; pictures are embedded."""
    from jinja2 import Environment

    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["number"] = _number
    environment.filters["place"] = _place
    template = environment.from_string(
        (files("patchwright.pipelines") / "report.html.jinja").read_text(encoding="utf-8")
    )
    pictures = {name: _embedded(folder / name) for name in PICTURES if name in told["files"]}
    spots = {name: _embedded(folder / name) for name in told["files"] if name.startswith("defect-")}
    seams = sorted(told.get("seams", []), key=lambda s: (s["kind"] != "smooth", -(s["angle"] or 0.0)))
    return template.render(
        t=told, pictures=pictures, spots=spots, seams=seams[:MOST_ROWS], most=MOST_ROWS, name=Path(told["source"]).name
    )


def _embedded(path: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()


def _number(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _place(where: Any) -> str:
    return "" if where is None else "(" + ", ".join(f"{x:.6g}" for x in where) + ")"


def _replace(path: Path, text: str) -> None:
    beside = path.with_name(f".{path.name}.tmp")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)
