"""Curves on files: STEP and IGES edges, VTK polylines, Plot3D lines (one block a curve)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from os import PathLike
from pathlib import Path

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import UnsupportedFormat
from patchwright.models.io.atomic import replacing, writing
from patchwright.models.io.registry import format_of
from patchwright.models.io.vtk_xml import data_array, footer, header, section
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.structured_grid import StructuredGrid

SECONDS, SECONDS_PER_CURVE = 120.0, 0.1  # time limit of the CAD kernel
KNOWN = "STEP (.step), IGES (.igs), VTK (.vtp, .vtk) and Plot3D (.p3d)"


def curve_format(path: str | PathLike[str]) -> str:
    """The name of the format a suffix picks for curves.

    Raises
    ------
    UnsupportedFormat : there is none, or it holds no curves.
    """
    place = Path(path)
    if place.suffix.lower() == ".vtk":
        return "VTK"
    try:
        name = format_of(place).name
    except UnsupportedFormat as error:
        raise UnsupportedFormat(f"{place}: no known format; known for curves are {KNOWN}") from error
    if name not in ("STEP", "IGES", "Plot3D") and place.suffix.lower() != ".vtp":
        raise UnsupportedFormat(f"{place}: {name} files hold no curves; known for curves are {KNOWN}")
    return name


def write_curves(
    path: str | PathLike[str],
    curves: Sequence[NurbsCurve],
    polylines: Sequence[Array],
    *,
    unit: str = "unknown",
) -> None:
    """Writes curves whole or not at all: beside the place first, then renamed.

    Parameters
    ----------
    path : the suffix picks the format; STEP and IGES hold the curves themselves, VTK and Plot3D the polylines
    polylines : (n, 3) points along each curve
    unit : of the coordinates; "unknown" is written as mm with unchanged numbers

    Raises
    ------
    UnsupportedFormat : a format that holds no curves, or there is none.
    EngineError : the CAD kernel refused a curve.
    """
    place = Path(path)
    name = curve_format(place)
    if not curves:
        raise UnsupportedFormat(f"{place}: there is no curve to write")
    if name in ("STEP", "IGES"):
        _write_cad(place, name, curves, "mm" if unit == "unknown" else unit)
    elif place.suffix.lower() == ".vtp":
        _write_vtp(place, polylines)
    elif place.suffix.lower() == ".vtk":
        _write_vtk(place, polylines)
    else:
        from patchwright.models.io.plot3d import write

        write(place, StructuredGrid(tuple(p.reshape(-1, 1, 1, 3) for p in polylines)))


def _write_cad(path: Path, kind: str, curves: Sequence[NurbsCurve], unit: str) -> None:
    from patchwright.models.cad import contained

    limit = SECONDS + SECONDS_PER_CURVE * len(curves)
    name = "patchwright.models.cad.curve_writing:write_curve_file"
    with replacing(path) as part:
        contained.call_named(
            name, part, kind, tuple(curves), unit, unit, time_limit=limit, what=f"writing {path}"
        )  # fmt: skip


def _write_vtp(path: Path, polylines: Sequence[Array]) -> None:
    points = np.concatenate(polylines)
    ends = np.cumsum([len(p) for p in polylines])
    owner = np.arange(len(polylines))
    with writing(path) as out:
        out.write(header("PolyData"))
        out.write(f'<Piece NumberOfPoints="{len(points)}" NumberOfLines="{len(polylines)}">\n'.encode())
        section(out, "Points", [data_array("points", points)])
        section(out, "Lines", [data_array("connectivity", np.arange(len(points))), data_array("offsets", ends)])
        section(out, "CellData", [data_array("curve", owner)])
        out.write(b"</Piece>\n" + footer("PolyData"))


def _write_vtk(path: Path, polylines: Sequence[Array]) -> None:
    """The legacy form, as text."""
    points = np.concatenate(polylines)
    first = np.concatenate([[0], np.cumsum([len(p) for p in polylines])])
    with writing(path) as out:
        out.write(b"# vtk DataFile Version 3.0\npatchwright curves\nASCII\nDATASET POLYDATA\n")
        out.write(f"POINTS {len(points)} double\n".encode())
        np.savetxt(out, points, fmt="%.17g")
        out.write(f"LINES {len(polylines)} {len(points) + len(polylines)}\n".encode())
        for begin, end in pairwise(first.tolist()):
            out.write((" ".join(map(str, [end - begin, *range(begin, end)])) + "\n").encode())
