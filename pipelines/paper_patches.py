"""The repair examples of Hamann, Jean and Razdan as pictures and numbers, on shapes made in code.

The paper prints pictures of its figures 8 to 13 but no data, so that the shapes here are ours: part of one patch, two
patches with a gap, crossing patches, strongly waved patches with gaps, a car body, an aircraft.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.io.atomic import writing
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples import car, damage, demo_aircraft, missing_triangles, slit, unmerged
from patchwright.models.samples.body import Body
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.splines import cubic
from patchwright.models.tolerance import Tolerance
from patchwright.pipelines.approximate import APART, side_by_side
from patchwright.pipelines.outputs import prepare_folder
from patchwright.pipelines.pictures import free_edges, output_surface
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.scenes import Scene, draw_scenes
from patchwright.pipelines.view import DIRECTION

if TYPE_CHECKING:
    from patchwright.repair.patches.local_patch import LocalPatch
    from patchwright.repair.result import Repaired

SHARE = 1e-4  # of the diagonal: the tolerance of all cases
CELLS = 48  # of a tessellation


@dataclass(frozen=True, slots=True, eq=False)
class PatchCase:
    """A case of one approximant: the geometry, the four corners of the patch, and the surface before it was broken."""

    figure: int
    title: str
    model: Assembly
    corners: Array
    truth: tuple[NurbsSurface, ...]
    hits: str = "nearest"


@dataclass(frozen=True, slots=True, eq=False)
class CaseResult:
    """One row of the table: a case, the form of its approximant, and what came out; lengths over the diagonal."""

    case: PatchCase
    form: str
    patch: LocalPatch
    to_truth: float
    """Largest distance of the patch's points to the unbroken surfaces, gaps included."""
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class BodyResult:
    """A whole body resurfaced."""

    figure: int
    title: str
    repaired: Repaired
    model: Assembly
    to_truth: tuple[float, float]
    """Median and 99 % distance of the result's points from the truth, over the diagonal."""
    seconds: float


def patch_cases() -> tuple[PatchCase, ...]:
    """Figures 8 to 11."""
    wave = _height(lambda x, y: 0.15 * np.sin(2.0 * np.pi * x) * np.cos(np.pi * y) + 0.1 * x * y, 13)
    other = _height(lambda x, y: 0.12 * (x - 0.5) + 0.05 * np.cos(np.pi * x) * y, 13)
    up = _height(lambda x, y: -0.16 * (x - 0.5) - 0.06 * np.sin(np.pi * y), 13)
    rough = _height(lambda x, y: 0.05 * np.sin(7.0 * np.pi * x) * np.cos(6.0 * np.pi * y) + 0.03 * np.sin(5.0 * y), 49)
    gap = [wave.restricted(u=(0.0, 0.46)), wave.restricted(u=(0.58, 1.0))]
    pieces = [
        rough.restricted(u=(a, b), v=(c, d))
        for a, b in ((0.0, 0.48), (0.53, 1.0))
        for c, d in ((0.0, 0.47), (0.51, 1.0))
    ]
    return (
        PatchCase(8, "part of a single patch", _faces([wave]), _corners(wave, (0.12, 0.86), (0.18, 0.9)), (wave,)),
        PatchCase(9, "patches with a gap", _faces(gap), _corners(wave, (0.1, 0.9), (0.1, 0.9)), (wave,)),
        PatchCase(
            10, "crossing patches", _faces([other, up]),
            np.stack([up(0.05, 0.1), other(0.95, 0.1), other(0.95, 0.9), up(0.05, 0.9)]), (other, up),
            "outermost",
        ),
        PatchCase(11, "strongly waved patches", _faces(pieces), _corners(rough, (0.05, 0.95), (0.05, 0.95)), (rough,)),
    )  # fmt: skip


def _height(function: Any, points: int) -> NurbsSurface:
    """The bicubic not-a-knot interpolant of z = f(x, y) over the unit square; x = u, y = v."""
    t = np.linspace(0.0, 1.0, points)
    x, y = np.meshgrid(t, t, indexing="ij")
    values = np.stack([x, y, function(x, y)], axis=-1)
    U, half = cubic(t, values)
    V, net = cubic(t, half.swapaxes(0, 1))
    return NurbsSurface((3, 3), (U, V), net.swapaxes(0, 1))


def _faces(surfaces: Sequence[NurbsSurface]) -> Assembly:
    """CAD faces with their tessellations."""
    parts = []
    for i, surface in enumerate(surfaces):
        lines = {name: np.linspace(*domain, CELLS + 1) for name, domain in zip(("u", "v"), surface.domain, strict=True)}
        body = Body(f"face{i + 1}", ("skin",), (surface,), lines, (("u", "v"),), closed=False)
        tessellation = Sample.of(body.name, (body,)).assembly.parts[0].triangulation
        parts.append(Part(body.name, tessellation, surface=surface))
    return Assembly(tuple(parts), unit="m", source="paper case")


def _corners(surface: NurbsSurface, u: tuple[float, float], v: tuple[float, float]) -> Array:
    return np.asarray(surface(np.array([u[0], u[1], u[1], u[0]]), np.array([v[0], v[0], v[1], v[1]])))


def approximate_case(case: PatchCase, form: str, refinement: str = "local") -> CaseResult:
    """Lay straight sides between the corners onto the geometry and approximate."""
    from patchwright.repair.patches.local_patch import approximate
    from patchwright.repair.patches.patch_ground import PatchGround
    from patchwright.repair.patches.patch_sides import Sides, laid, through

    begin = time.process_time()
    size = case.model.diagonal
    ground = PatchGround.of(case.model)
    south, east, north, west = (through(case.corners[[k, (k + 1) % 4]]) for k in range(4))
    sides = Sides.of(south, east, north, west, 0.0)
    sides = laid(sides, ground.under(sides), hits=case.hits)
    patch = approximate(sides, ground, SHARE * size, form=form, refinement=refinement, hits=case.hits, most=128)
    spent = time.process_time() - begin
    t = np.linspace(0.0, 1.0, 201)[1:-1]
    points = patch.surface.grid(t, t).reshape(-1, 3)
    off = np.min([np.linalg.norm(s.closest(points).points - points, axis=1) for s in case.truth], axis=0)
    return CaseResult(case, form, patch, float(off.max()) / size, spent)


def body_cases(report: Any) -> tuple[BodyResult, ...]:
    """Figures 12 and 13: a car body and an aircraft, resurfaced whole."""
    clean = car(cells=(80, 96))
    length = 4.5
    steps = (
        partial(slit, point=(0.31 * length, 0.0, 0.0), normal=(1.0, 0.0, 0.0), width=0.012, facing=(0.0, 0.0, 1.0)),
        partial(slit, point=(0.85 * length, 0.0, 0.0), normal=(1.0, 0.0, 0.2), width=0.008, facing=(0.0, 0.0, 1.0)),
        partial(missing_triangles, share=0.005),
        partial(unmerged, radius=1e-5 * length),
    )
    broken = damage(clean.assembly.triangulation, steps, seed=1).assembly
    plane = demo_aircraft()
    out = []
    for k, (figure, title, model, truth) in enumerate(
        ((12, "car body", broken, clean.truth), (13, "aircraft", plane.assembly, plane.truth))
    ):
        report(title, 0.5 * k)
        from patchwright.repair import repair

        begin = time.process_time()
        done = repair(model, scope="all")
        spent = time.process_time() - begin
        share = truth.distance(done.triangulation.corners.mean(axis=1)) / model.diagonal
        medians = float(np.median(share)), float(np.percentile(share, 99.0))
        out.append(BodyResult(figure, title, done, model, medians, spent))
    return tuple(out)


def draw_body(result: BodyResult, path: Path) -> Scene:
    """The dirty body with its free edges above, the patches below."""
    from patchwright.repair.mender.weld import weld, weld_distance

    body, colours, borders = output_surface(result.repaired)
    raw = result.model.triangulation
    before = weld(raw, weld_distance(raw, Tolerance.of(result.model))[0]).triangulation  # a soup would be red all over
    box = before.bounds
    right = np.cross([0.0, 0.0, 1.0], DIRECTION)
    right /= np.linalg.norm(right)
    up = np.cross(DIRECTION, right)
    up /= np.linalg.norm(up)
    corners = np.array([[x, y, z] for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])
    shift = -up * APART * float(np.ptp(corners @ up))
    both = np.stack([np.minimum(box[0], box[0] + shift), np.maximum(box[1], box[1] + shift)])
    scene = Scene(path, f"{result.title}: as it came (top), resurfaced (bottom)", both)
    scene.surface(before).lines(free_edges(before), colour="#c03030", width=1.0)
    moved = type(body)(body.vertices + shift, body.triangles)
    return scene.surface(moved, colours=colours).lines(borders + shift, colour="#33475a", width=1.0)


def run_paper_figures(output: Path, *, bodies: bool, terminal: Terminal) -> tuple[dict[str, Any], list[str]]:
    """Compute all cases, draw them into the folder, write `figures.json`; returns its content and the table's lines."""
    prepare_folder(output)
    rows: list[CaseResult] = []
    scenes: list[Scene] = []
    for case in patch_cases():
        with terminal.stage(f"figure {case.figure}") as report:
            own = []
            for k, (form, refinement) in enumerate((("c2", "local"), ("c1", "local"), ("c1", "uniform"))):
                report(f"{form}, {refinement}", k / 3)
                own.append(approximate_case(case, form, refinement))
            scenes.append(side_by_side(output / f"figure-{case.figure}.png", case.title, case.model, [own[0].patch]))
            rows += own
    whole: tuple[BodyResult, ...] = ()
    if bodies:
        with terminal.stage("figures 12 and 13") as report:
            whole = body_cases(report)
        scenes += [draw_body(b, output / f"figure-{b.figure}.png") for b in whole]
    with terminal.stage("drawing") as report:
        report("pictures", 0.0)
        sentence = draw_scenes(scenes)
    told = {"tolerance": SHARE, "patches": [_row_json(r) for r in rows], "bodies": [_body_json(b) for b in whole]}
    with writing(output / "figures.json") as out:
        out.write(json.dumps(told, indent=1, allow_nan=False).encode())
    names = [s.path.name for s in scenes if s.path.exists()]
    lines = [*_table(rows, whole), "written: " + ", ".join([*names, "figures.json"])]
    return told, lines if sentence is None else [*lines, sentence]


def _row_json(r: CaseResult) -> dict[str, Any]:
    size = r.case.model.diagonal
    return {
        "figure": r.case.figure, "title": r.case.title, "form": r.form, "status": r.patch.status.value,
        "control points": r.patch.control_points, "largest distance": r.patch.misfit.largest / size,
        "largest normal angle": float(r.patch.misfit.angles.max(initial=0.0)),
        "largest distance to the unbroken surface": r.to_truth, "invented share of the area": r.patch.invented,
        "largest curvature jump times diagonal": r.patch.curvature_jump * size, "cpu seconds": r.seconds,
    }  # fmt: skip


def _body_json(b: BodyResult) -> dict[str, Any]:
    return {
        "figure": b.figure, "title": b.title, "verdict": b.repaired.verdict.value,
        "patches": len(b.repaired.network or ()),
        "median distance to the truth": b.to_truth[0], "99 % distance to the truth": b.to_truth[1],
        "invented share of the area": b.repaired.invented, "cpu seconds": b.seconds,
    }  # fmt: skip


def _table(rows: Sequence[CaseResult], bodies: Sequence[BodyResult]) -> list[str]:
    lines = [
        f"tolerance {SHARE:g} of the diagonal; lengths over the diagonal, angles in degrees",
        f"{'figure':<42}{'form':>12}{'points':>8}{'error':>10}{'angle':>8}{'to truth':>10}{'invented':>10}"
        f"{'jump':>8}{'s':>7}",
    ]
    names = ("c2", "c1", "c1 uniform")
    for k, r in enumerate(rows):
        size = r.case.model.diagonal
        lines.append(
            f"{r.case.figure:>3} {r.case.title:<38}{names[k % 3]:>12}{r.patch.control_points:>8}"
            f"{r.patch.misfit.largest / size:>10.1e}{r.patch.misfit.angles.max(initial=0.0):>8.2f}{r.to_truth:>10.1e}"
            f"{r.patch.invented:>10.1%}{r.patch.curvature_jump * size:>8.2g}{r.seconds:>7.1f}"
        )
        if r.patch.status.name != "WITHIN":
            lines.append(f"      {r.patch.status.value}")
    for b in bodies:
        lines.append(
            f"{b.figure:>3} {b.title:<38}{len(b.repaired.network or ()):>6} patches, "
            f"median {b.to_truth[0]:.1e} and 99 % {b.to_truth[1]:.1e} from the truth, "
            f"{b.repaired.invented:.1%} invented, {b.seconds:.0f} s"
        )
    return lines
