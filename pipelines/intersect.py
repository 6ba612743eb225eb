"""`patchwright intersect`: files in, their intersection curves out, with a report and a picture."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.analytic import Plane, Torus
from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.errors import CorruptFile, ParameterError
from patchwright.models.io import read, read_grid
from patchwright.models.io.curves import curve_format, write_curves
from patchwright.models.io.registry import format_of
from patchwright.models.knots import between, divided
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.structured_grid import StructuredGrid
from patchwright.models.surface import Surface
from patchwright.models.triangulation import Triangulation
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.scenes import Scene, draw_scenes
from patchwright.pipelines.units import in_one_unit
from patchwright.pipelines.warm import MESH_SECTIONS, announce_sections
from patchwright.ssi import Intersection, IntersectionCurve, intersect
from patchwright.ssi.intersect import check_tolerance
from patchwright.ssi.intersection import Box
from patchwright.ssi.operands import Operand, operands

CHORDS = 16  # of a polyline in each knot span of a curve
PER_SPAN = 40  # samples of the reported residual: ten times the four a fit of degree 5 uses in a span


@dataclass(frozen=True, slots=True, eq=False)
class Sections:
    """An intersection with the operands it is between, the time it took, where it was written, and what was assumed."""

    found: Intersection
    items: tuple[Operand, ...]
    seconds: float
    files: tuple[str, ...]
    notes: tuple[str, ...] = ()


def run_intersect(
    sources: Sequence[Path],
    output: Path | None,
    *,
    tolerance: float | None,
    terminal: Terminal,
    unit: str | None = None,
) -> Sections:
    """Read, intersect, and write curves, report and picture where an output is named.

    Parameters
    ----------
    sources : files; one alone is intersected with itself
    output : curves as .step, .igs, .vtp, .vtk, .p3d, or .json (the report itself)
    unit : of the files that store none
    """
    if output is not None and output.suffix.lower() != ".json":
        curve_format(output)
    check_tolerance(tolerance)
    for path in sources:  # before minutes go into reading the others
        if not path.exists():
            raise CorruptFile(f"{path}: there is no such file; check the path")
    read_in: list[Assembly | StructuredGrid] = []
    with terminal.stage("read") as report:
        for k, path in enumerate(sources):
            report(f"reading {path.name}", k / len(sources))
            read_in.append(_input(path))
    inputs, common, notes = in_one_unit(read_in, [path.name for path in sources], unit)
    items = operands(inputs)
    things = [item.thing for item in items]
    meshes = [isinstance(thing, Triangulation) for thing in things]
    if any(isinstance(thing, NurbsSurface | Torus) for thing in things) and not all(meshes):
        announce_sections(terminal)
    if any(meshes) and not all(isinstance(thing, Triangulation | Plane) for thing in things):
        announce_sections(terminal, MESH_SECTIONS)
    begin = time.perf_counter()
    with terminal.stage("intersect") as report:
        found = intersect(inputs[0], *inputs[1:], tolerance=tolerance, progress=report)
    result = Sections(found, items, time.perf_counter() - begin, (), notes)
    if output is None:
        return result
    with terminal.stage("write") as report:
        files = _written(result, output, sources, common, report)
    return replace(result, files=files)


def _input(path: Path) -> Assembly | StructuredGrid:
    if format_of(path).name != "Plot3D":
        return read(path)
    grid = read_grid(path)
    for number, block in enumerate(grid.blocks):
        if sum(size > 1 for size in block.shape[:3]) != 2:
            shape = block.shape[:3]
            raise ParameterError(f"{path}: block {number} of {shape} nodes is not a surface; give a volume's faces")
    return grid


def _written(result: Sections, output: Path, sources: Sequence[Path], unit: str, report: Any) -> tuple[str, ...]:
    """Curves, report and picture beside each other."""
    from patchwright.models.io.atomic import writing

    files = []
    output.parent.mkdir(parents=True, exist_ok=True)
    curves = result.found.curves
    as_json = output.suffix.lower() == ".json"
    if curves and not as_json:
        report(f"writing {output.name}", 0.2)
        write_curves(output, [c.curve for c in curves], [polyline(c) for c in curves], unit=unit)
        files.append(output.name)
    listing = output if as_json else output.with_name(f"{output.stem}-report.json")
    report(f"writing {listing.name}", 0.6)
    with writing(listing) as out:
        out.write(json.dumps(sections_json(result, [str(s) for s in sources]), indent=1, allow_nan=False).encode())
    files.append(listing.name)
    report("drawing", 0.8)
    picture = output.with_suffix(".png")
    if draw_scenes([_scene(result, picture)]) is None:
        files.append(picture.name)
    return tuple(files)


def polyline(curve: IntersectionCurve) -> Array:
    """(n, 3) points along a curve, its knots among them."""
    if curve.uv_a is None and curve.uv_b is None:
        return curve.points
    return curve.curve(divided(curve.curve.breaks, CHORDS))


def residuals(curve: IntersectionCurve, items: Sequence[Operand]) -> tuple[float | None, float | None]:
    """Largest distance between the curve and its image on either surface; None on a mesh."""
    t = between(curve.curve.breaks, PER_SPAN)
    points = curve.curve(t)
    out: list[float | None] = []
    for uv, operand in zip((curve.uv_a, curve.uv_b), curve.surfaces, strict=True):
        surface = items[operand].thing
        if uv is None or not isinstance(surface, Surface):
            out.append(None)
            continue
        at = uv(t)
        place = surface(*_within(at, surface).T)
        out.append(float(np.linalg.norm(place - points, axis=1).max()))
    return out[0], out[1]


def _within(uv: Array, surface: Surface) -> Array:
    """Parameters brought back into the domain of a closed surface."""
    out = uv.copy()
    for k, (low, high) in enumerate(surface.domain):
        if np.isfinite([low, high]).all():
            beyond = (out[:, k] < low) | (out[:, k] > high)
            out[beyond, k] = low + np.mod(out[beyond, k] - low, high - low)
    return out


def sections_json(result: Sections, sources: Sequence[str]) -> dict[str, Any]:
    """Everything found, as plain values."""
    found = result.found

    def names(which: Sequence[int]) -> list[str]:
        return [f"{sources[result.items[i].source]}:{result.items[i].name}".rstrip(":") for i in which]

    curves = []
    for c in found.curves:
        on_a, on_b = residuals(c, result.items)
        curves.append(
            {
                "kind": c.kind,
                "closed": c.closed,
                "length": float(c.curve.length()),
                "residual": c.residual,
                "residual on each surface": [on_a, on_b],
                "points": len(c.points),
                "control points": len(c.curve.control_points),
                "surfaces": names(c.surfaces),
                "start": c.points[0].tolist(),
                "end": c.points[-1].tolist(),
            }
        )
    return {
        "sources": list(sources),
        "complete": found.complete,
        "curves": curves,
        "length": found.length,
        "residual": found.residual,
        "points": [
            {"kind": p.kind, "at": np.asarray(p.point).tolist(), "gap": p.gap, "surfaces": names(p.surfaces)}
            for p in found.points
        ],
        "overlaps": [
            {"area": o.area, "boundary curves": len(o.boundary), "surfaces": names(o.surfaces)} for o in found.overlaps
        ],
        "unresolved": [
            {"box_a": _finite(u.box_a), "box_b": _finite(u.box_b), "reason": u.reason, "surfaces": names(u.surfaces)}
            for u in found.unresolved
        ],
        "notes": list(result.notes),
        "seconds": round(result.seconds, 3),
        "files": list(result.files),
    }


def sections_lines(result: Sections, sources: Sequence[str], most: int = 20) -> list[str]:
    """The same in at most a screenful."""
    found = result.found
    told = "complete" if found.complete else f"{len(found.unresolved)} places unresolved"
    lines = [
        f"{' x '.join(sources)}: {len(found.curves)} curves, {len(found.points)} points, "
        f"{len(found.overlaps)} overlaps; {told} ({result.seconds:.2f} s)"
    ]
    lines += [f"  note: {note}" for note in result.notes]
    for c in found.curves[:most]:
        ends = "closed" if c.closed else "open"
        lines.append(
            f"  {c.kind:<16} {ends:<6} length {c.curve.length():.9g}  residual {c.residual:.2g}  {len(c.points)} points"
            + _between(result, sources, c.surfaces)
        )
    if len(found.curves) > most:
        lines.append(f"  and {len(found.curves) - most} more; --json lists all")
    for p in found.points[:most]:
        x, y, z = p.point
        lines.append(
            f"  {p.kind:<16} at ({x:.9g}, {y:.9g}, {z:.9g})  gap {p.gap:.2g}" + _between(result, sources, p.surfaces)
        )
    if len(found.points) > most:
        lines.append(f"  and {len(found.points) - most} more points; --json lists all")
    for o in found.overlaps[:most]:
        lines.append(
            f"  overlap          area {o.area:.9g}  {len(o.boundary)} boundary curves"
            + _between(result, sources, o.surfaces)
        )
    for u in found.unresolved[:most]:
        where = _between(result, sources, u.surfaces)
        lines.append(f"  unresolved in {_ranges(u.box_a)} x {_ranges(u.box_b)}{where}: {u.reason}")
    if len(found.unresolved) > most:
        lines.append(f"  and {len(found.unresolved) - most} more unresolved; --json lists all")
    if result.files:
        lines.append(f"  wrote {', '.join(result.files)}")
    return lines


def _between(result: Sections, sources: Sequence[str], which: Sequence[int]) -> str:
    """Which inputs, where there are more than two."""
    if len(result.items) < 3:
        return ""
    return "  of " + " x ".join(_name(result, sources, i) for i in which)


def _name(result: Sections, sources: Sequence[str], which: int) -> str:
    """A file, and the part of it where it has a name."""
    item = result.items[which]
    return f"{Path(sources[item.source]).name}:{item.name}".rstrip(":")


def _finite(box: Box) -> list[list[float | None]]:
    """A box for JSON, which has no infinity: null where it is unbounded."""
    return [[x if np.isfinite(x) else None for x in side] for side in box]


def _ranges(box: Box) -> str:
    return " ".join(f"[{low:.6g}, {high:.6g}]" for low, high in box)


def _scene(result: Sections, path: Path) -> Scene:
    """The inputs in grey, the curves red, single points dark."""
    bodies = [_drawn(item) for item in result.items if np.isfinite(item.size)]
    low = np.min([b.bounds[0] for b in bodies], axis=0)
    high = np.max([b.bounds[1] for b in bodies], axis=0)
    scene = Scene(path, f"{len(result.found.curves)} intersection curves", np.stack([low, high]))
    for body in bodies:
        scene.surface(body)
    lines = [polyline(c) for c in result.found.curves]
    if lines:
        scene.lines(
            np.concatenate([np.stack([p[:-1], p[1:]], axis=1) for p in lines]), colour="#c03030", width=6.0, tubes=True
        )
    if result.found.points:
        scene.points(np.array([p.point for p in result.found.points]), colour="#202020", width=12.0)
    return scene


def _drawn(item: Operand) -> Triangulation:
    """Triangles that show an operand."""
    if isinstance(item.thing, Triangulation):
        return item.thing
    from patchwright.ssi.triangulate import triangulate

    return triangulate(item.thing, 1e-3 * item.size)
