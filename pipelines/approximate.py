"""`patchwright approximate`: a dirty geometry and boundary curves in, bicubic patches out, with report and pictures."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import UnsupportedFormat
from patchwright.models.io import read, write
from patchwright.models.io.atomic import writing
from patchwright.models.io.registry import format_of
from patchwright.models.triangulation import Triangulation
from patchwright.pipelines.patch_list import load_patches
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.scenes import Scene, draw_scenes
from patchwright.pipelines.view import DIRECTION

if TYPE_CHECKING:
    from patchwright.repair.patches.local_patch import LocalPatch

APART = 1.08  # widths of the geometry between it and the patches in a picture
DRAWN = 96  # cells of a patch along a side, drawn
LINES = 17
PATCH, INVENTED, SIDE, INNER = "#7aa6c2", "#e28c3c", "#c03030", "#33475a"


@dataclass(frozen=True, slots=True, eq=False)
class NamedPatch:
    """A patch with its name and the seconds it took."""

    name: str
    patch: LocalPatch
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class ApproximateRun:
    """All patches of a run, the unit of their lengths, and the files written."""

    source: str
    unit: str
    patches: tuple[NamedPatch, ...]
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def converged(self) -> bool:
        """Whether every patch is within its tolerance."""
        from patchwright.repair.patches.local_patch import Status

        return all(p.patch.status is Status.WITHIN for p in self.patches)


def run_approximate(
    source: Path, patches: Path, output: Path, *, tolerance: float | None, terminal: Terminal
) -> ApproximateRun:
    """Read a geometry and a list of patches, approximate each, write the patches, the report and the picture.

    Raises
    ------
    UnsupportedFormat : an output that cannot hold surfaces; else as `load_patches` and `approximate`.
    """
    from patchwright.repair.patches.local_patch import approximate

    if "surfaces" not in format_of(output).holds:
        raise UnsupportedFormat(f"{output}: {format_of(output).name} cannot hold surfaces; write .step or .igs")
    with terminal.stage("read") as report:
        report(f"reading {source.name}", 0.0)
        model = read(source)
    with terminal.stage("boundary curves") as report:
        report(f"reading {patches.name}", 0.0)
        wanted = load_patches(patches, model, tolerance)
    made = []
    for spec in wanted.patches:
        with terminal.stage(f"patch {spec.name}") as report:
            begin = time.perf_counter()
            patch = approximate(spec.sides, model, wanted.tolerance, progress=report, **spec.options)
            made.append(NamedPatch(spec.name, patch, time.perf_counter() - begin))
    notes = (wanted.note,) if wanted.note else ()
    run = ApproximateRun(str(source), model.unit, tuple(made), notes=notes)
    with terminal.stage("write") as report:
        report(f"writing {output.name}", 0.0)
        output.parent.mkdir(parents=True, exist_ok=True)
        write(output, surfaces_of(run))
        listing = output.with_name(f"{output.stem}-report.json")
        with writing(listing) as out:
            out.write(json.dumps(approximate_json(run), indent=1, allow_nan=False).encode())
        report("drawing", 0.6)
        picture = output.with_suffix(".png")
        sentence = draw_scenes([side_by_side(picture, source.name, model, [p.patch for p in made])])
    files = (output.name, listing.name) + ((picture.name,) if sentence is None else ())
    return replace(run, files=files, notes=notes if sentence is None else (*notes, sentence))


def surfaces_of(run: ApproximateRun) -> Assembly:
    """The patches as an assembly of faces."""
    nothing = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    parts = tuple(Part(p.name, nothing, p.patch.surface) for p in run.patches)
    return Assembly(parts, unit=run.unit, source=run.source)


def side_by_side(path: Path, title: str, model: Assembly, patches: list[LocalPatch]) -> Scene:
    """The geometry with the boundary curves on the left; the patches with their lines, invented cells marked, right."""
    body = model.triangulation
    box = body.bounds
    for patch in patches:
        flat = patch.points.reshape(-1, 3)
        box = np.stack([np.minimum(box[0], flat.min(axis=0)), np.maximum(box[1], flat.max(axis=0))])
    eye = _towards(patches)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    corners = np.array([[x, y, z] for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])
    shift = right * APART * float(np.ptp(corners @ right))
    both = np.stack([np.minimum(box[0], box[0] + shift), np.maximum(box[1], box[1] + shift)])
    scene = Scene(
        path, f"{title}: the geometry with the sides given (left), the approximation (right)", both, direction=eye
    )
    scene.surface(body, edges=len(body) < 5000)
    for patch in patches:
        sides = (patch.sides.south, patch.sides.east, patch.sides.north, patch.sides.west)
        curves = [_chords(np.asarray(s.curve(np.linspace(*s.curve.domain, 65)))) for s in sides]
        scene.lines(np.concatenate(curves), colour=SIDE, width=4.0)
        t = np.linspace(0.0, 1.0, DRAWN + 1)
        P = patch.surface.grid(t, t) + shift
        known, unknown = _cells(patch, P)
        scene.surface(known, colour=PATCH)
        if len(unknown):
            scene.surface(unknown, colour=INVENTED)
        few = np.linspace(0.0, 1.0, LINES)
        lines = [*patch.surface.grid(few, t), *patch.surface.grid(t, few).swapaxes(0, 1)]
        scene.lines(np.concatenate([_chords(line) for line in lines]) + shift, colour=INNER, width=1.0)
        scene.lines(np.concatenate([_chords(c) for c in (P[0], P[-1], P[:, 0], P[:, -1])]), colour=SIDE, width=3.0)
    return scene


def _towards(patches: list[LocalPatch]) -> tuple[float, float, float]:
    """From the model to the eye: the usual direction, mirrored so that most of the patches face it."""
    normal = np.zeros(3)
    for patch in patches:
        corner = patch.points[[0, -1, -1, 0], [0, 0, -1, -1]]
        normal += np.cross(corner[2] - corner[0], corner[3] - corner[1])
    usual = np.array(DIRECTION)
    seen = np.where(np.abs(normal) < 1e-3 * np.abs(normal).max(), usual, np.abs(usual) * np.sign(normal))
    x, y, z = seen.tolist()
    return x, y, z


def _chords(points: Array) -> Array:
    return np.stack([points[:-1], points[1:]], axis=1)


def _cells(patch: LocalPatch, points: Array) -> tuple[Triangulation, Triangulation]:
    """The drawn grid as triangles: those on the geometry's points, and those on artificial ones."""
    index = np.arange((DRAWN + 1) ** 2).reshape(DRAWN + 1, DRAWN + 1)
    a, b, c, d = (x.reshape(-1) for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    middle = (np.arange(DRAWN) + 0.5) / DRAWN
    u, v = patch.parameters
    i = np.clip(np.searchsorted(u, middle) - 1, 0, len(u) - 2)
    j = np.clip(np.searchsorted(v, middle) - 1, 0, len(v) - 2)
    invented = np.repeat(patch.invented_cells[np.ix_(i, j)].reshape(-1), 2)
    triangles = np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1).reshape(-1, 3)
    body = Triangulation(points.reshape(-1, 3), triangles)
    return body.take(~invented), body.take(invented)


def approximate_json(run: ApproximateRun) -> dict[str, Any]:
    """The report as plain values; lengths in the model's unit, angles in degrees."""
    return {
        "source": run.source,
        "unit": run.unit,
        "converged": run.converged,
        "notes": list(run.notes),
        "patches": [_patch_json(p) for p in run.patches],
    }


def _patch_json(named: NamedPatch) -> dict[str, Any]:
    p = named.patch
    sides = {k: getattr(p.sides, k).source for k in ("south", "east", "north", "west")}
    return {
        "name": named.name,
        "status": p.status.value,
        "tolerance": p.tolerance,
        "largest distance": p.misfit.largest,
        "root mean square distance": p.misfit.rms,
        "samples": len(p.misfit.distances),
        "largest normal angle": float(p.misfit.angles.max(initial=0.0)),
        "largest curvature jump": p.curvature_jump,
        "control points": list(p.surface.control_points.shape[:2]),
        "rounds": p.rounds,
        "points found": int(p.found.sum()),
        "points": int(p.found.size),
        "offset distance": p.offset,
        "farthest point found": p.reach,
        "filling": p.fill.value,
        "invented share of the area": p.invented,
        "sides": sides,
        "seconds": round(named.seconds, 3),
    }


def approximate_lines(run: ApproximateRun) -> list[str]:
    """The report as text."""
    lines = [f"{run.source}: {len(run.patches)} patches; lengths in {run.unit}"]
    lines.append(
        f"  {'patch':<16}{'net':>9}{'largest':>11}{'rms':>11}{'angle':>8}{'bend jump':>11}{'invented':>10}"
        f"{'offset':>10}"
    )
    for named in run.patches:
        p = named.patch
        net = "x".join(map(str, p.surface.control_points.shape[:2]))
        lines.append(
            f"  {named.name:<16}{net:>9}{p.misfit.largest:>11.3g}{p.misfit.rms:>11.3g}"
            f"{p.misfit.angles.max(initial=0.0):>8.2g}{p.curvature_jump:>11.2g}{p.invented:>10.2%}{p.offset:>10.3g}"
        )
        lines.append(f"    {p.status.value} {p.tolerance:.3g} after {p.rounds} rounds; {p.fill.value}")
    if run.files:
        lines.append("written: " + ", ".join(run.files))
    return lines + list(run.notes)
