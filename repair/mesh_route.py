"""The ladder for triangulations: keep, weld, cut, bridge; then patches fitted to what is there.

A triangulation has no faces to keep: its kept triangles stay as they are in the output triangulation, and the NURBS
patches are fitted to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import GeometryError
from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.decisions import Decisions
from patchwright.repair.deviation import Deviation
from patchwright.repair.ground.true_ground import TrueGround
from patchwright.repair.layout.blocks import Blocks, find_blocks, single_blocks, smallest_corner
from patchwright.repair.layout.faceting import faceting
from patchwright.repair.layout.quad_layout import QuadLayout, quad_layout
from patchwright.repair.mender.last_resort import wrapped
from patchwright.repair.mender.mend import BRIDGED, CUT, KEPT, Mended, mend
from patchwright.repair.mender.mended import LEFT_OUT
from patchwright.repair.mesh_ground import ground_of, measured, on_model, true_entry
from patchwright.repair.patches.block_faces import BlockFaces, block_faces
from patchwright.repair.patches.block_grid import block_grid
from patchwright.repair.patches.joins import smooth_edges
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.network_seams import measure
from patchwright.repair.patches.patch_crossings import crossing_entries
from patchwright.repair.patches.patch_fit import Target
from patchwright.repair.patches.resurface import resurface
from patchwright.repair.patches.seam_curvature import curvature_jumps
from patchwright.repair.patches.tessellation import tessellation_within
from patchwright.repair.result import Face, LedgerEntry, Point, Problem, Progress, Repaired, Rung, Seam, Verdict
from patchwright.repair.symmetry import settled

COVERAGE_GOAL = 0.99  # share of the area, both ways, within the fit tolerance; below it a result has not converged
COVERAGE_LEAST = 0.95  # below it a result is refused
RETRIES = 1
FINER = 2.0  # quads of each retry against the one before
WIDEST = 10.0  # times: how far a fit tolerance nobody asked for may widen to the height of coarse facets
CHORD = 0.25  # of the fit tolerance: how far a tessellation of the patches may stray from them
MEASURED_CHORD = 0.1  # the same where distances are measured: on top of those of the patches
GRID = 8  # intervals per patch side of the structured grid


def repair_mesh(
    assembly: Assembly,
    tolerance: Tolerance,
    *,
    scope: str,
    layout: str | QuadLayout,
    merged: bool = True,
    openings: Literal["keep", "close"],
    clean: bool,
    decisions: Decisions | None = None,
    progress: Progress,
) -> Repaired:
    """Mend a triangulated assembly and fit patches to it.

    Parameters
    ----------
    merged : whether the patches of a block become one face, or each patch its own
    clean : whether diagnosis found no error: a warning, of an opening or of thin parts, is no reason to call a model
        repaired in which nothing was changed
    decisions : what stays as it is, and the symmetry planes whose borders stay on them
    scope : "least" keeps the input's triangles in the output triangulation, "all" takes the patches' tessellation

    The other arguments are those of `repair`.
    """
    raw = assembly.triangulation
    mended = mend(raw, tolerance.careful, openings=openings, decisions=decisions, progress=progress)
    if mended.problems and scope == "all":
        progress("wrapping", 0.0)
        mended = wrapped(mended, raw, tolerance)
    ledger = mending_ledger(mended)
    if mended.problems:
        return _refused(assembly, mended, ledger, problems_of(mended))
    ground = ground_of(assembly, mended)
    resolution = 0.0
    if not isinstance(ground, TrueGround):
        tolerance, resolution = _resolved(tolerance, mended.triangulation)
    try:
        network, deviation, tries = _fit(mended, ground, assembly, tolerance, layout, progress)
    except GeometryError as error:
        middle = _point(mended.triangulation.bounds.mean(axis=0))
        message = f"no layout of quads was found: {error}"
        return _refused(assembly, mended, ledger, (Problem("layout", middle, raw.diagonal, message),))
    if decisions is not None and decisions.surroundings.planes:
        network = settled(network, decisions.surroundings.planes, tolerance.fit)
    if deviation.coverage < COVERAGE_LEAST:
        return _refused(assembly, mended, ledger, (_uncovered(deviation),))
    blocks = find_blocks(network.layout)
    made = block_faces(network, blocks if merged else single_blocks(network.layout))
    seams = tuple(replace(s, faces=tuple(made.face[list(s.faces)].tolist())) for s in measure(network))
    faces = _faces(network, mended, made)
    invented = float(mended.triangulation.areas[mended.origin == BRIDGED].sum() / mended.triangulation.areas.sum())
    ledger += (_fitting_entry(network, mended, tolerance, tries, resolution),)
    crossing = crossing_entries(network, mended.triangulation.tag_names, tolerance.gap)
    ledger += crossing
    if isinstance(ground, TrueGround):
        ledger += (true_entry(ground, network, assembly),)
    if scope == "all":
        tessellation = tessellation_within(network, CHORD * tolerance.tightest)
        tags = network.layout.tags[tessellation.tags] if tessellation.tags is not None else None
        triangulation = replace(tessellation, tags=tags, tag_names=mended.triangulation.tag_names)
    else:
        triangulation = mended.triangulation
    changed = bool(mended.dropped) or any(not a.kind.endswith(LEFT_OUT) for a in mended.actions)
    verdict = Verdict.INVENTED if invented > 0 else Verdict.CLEAN if clean and not changed else Verdict.REPAIRED
    parts = tuple(
        Part(
            face.name,
            Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)),
            surface=surface,
            body="repaired",
        )
        for face, surface in zip(faces, made.surfaces, strict=True)
    )
    figures = _figures(network, len(faces), blocks, mended, seams, deviation)
    figures["pairs of patches that cross"] = sum(entry.count for entry in crossing)
    return Repaired(
        verdict,
        faces,
        seams,
        triangulation,
        ledger,
        deviation,
        invented,
        (),
        Assembly(parts, unit=assembly.unit, source=assembly.source, topology=made.topology),
        grid=block_grid(network, blocks, GRID),
        network=network,
        figures=figures,
    )


def _fit(
    mended: Mended,
    ground: Tree | TrueGround,
    assembly: Assembly,
    tolerance: Tolerance,
    layout: str | QuadLayout,
    progress: Progress,
) -> tuple[PatchNetwork, Deviation, int]:
    """Lay out and fit, with finer quads until the coverage holds; the best network is kept."""
    body = mended.triangulation
    invented = np.asarray(mended.origin == BRIDGED)
    target = Target(ground, invented, np.asarray(Adjacency.of(body).components()))
    best: tuple[PatchNetwork, Deviation] | None = None
    wanted: int | None = None
    for attempt in range(1 + RETRIES):
        progress("laying out quads", attempt / (1 + RETRIES))
        quads = quad_layout(body, target=wanted, angle=tolerance.angle) if isinstance(layout, str) else layout
        if isinstance(layout, str):
            quads = on_model(quads, ground, assembly, CHORD * tolerance.tightest)
        limits = tolerance.of_tags(body.tag_names, quads.tags)
        network = resurface(quads, target, tolerance, limits=limits, noise=mended.noise, progress=progress)
        progress("measuring coverage", 0.0)
        tessellation = tessellation_within(network, MEASURED_CHORD * tolerance.tightest)
        assert tessellation.tags is not None
        skip = network_invented(network, tessellation)
        own = tolerance.of_tags(body.tag_names, body.tags if body.tags is not None else np.zeros(len(body), dtype=int))
        deviation = measured(ground, tessellation, (own, limits[tessellation.tags]), invented, skip)
        if best is None or deviation.coverage > best[1].coverage:
            best = network, deviation
        if deviation.coverage >= COVERAGE_LEAST or not isinstance(layout, str):
            break
        wanted = int(FINER * len(quads.quads))
    assert best is not None
    return *best, attempt + 1


def network_invented(network: PatchNetwork, tessellation: Triangulation) -> BoolArray:
    """(triangles,) whether the middle of each triangle of a tessellation of the network lies on invented surface."""
    assert tessellation.uv is not None
    i, j = np.minimum((8.0 * tessellation.uv.mean(axis=1)).astype(np.int64), 7).T
    return np.asarray(network.invented[tessellation.tags, i, j])


def _point(where: Array) -> Point:
    x, y, z = np.asarray(where, dtype=np.float64).tolist()
    return x, y, z


def _faces(network: PatchNetwork, mended: Mended, made: BlockFaces) -> tuple[Face, ...]:
    """One face per block of patches; its origin are the tags of the triangles it was laid over."""
    names = mended.triangulation.tag_names or ("",)
    cells = network.points(8)
    a, b = cells[:, 1:, 1:] - cells[:, :-1, :-1], cells[:, 1:, :-1] - cells[:, :-1, 1:]
    area = 0.5 * np.linalg.norm(np.cross(a, b), axis=-1)
    total, invented = (np.bincount(made.face, x.sum(axis=(1, 2))) for x in (area, area * network.invented))
    share = invented / np.where(total > 0, total, 1.0)
    deviation = np.full(len(made), np.nan)
    np.fmax.at(deviation, made.face, network.deviation)
    tags = np.zeros(len(made), dtype=np.int64)
    tags[made.face] = network.layout.tags
    return tuple(
        Face(
            f"{names[tag] or 'patch'}-{i + 1}",
            (names[tag],),
            Rung.BRIDGE if s == 1.0 else Rung.RESURFACE,
            float(d),
            float(s),
            float(t),
        )
        for i, (tag, s, d, t) in enumerate(zip(tags.tolist(), share, deviation, total, strict=True))
    )


def problems_of(mended: Mended) -> tuple[Problem, ...]:
    """Why the mender refuses."""
    return tuple(Problem(p.kind, _point(p.where), float(p.size), p.message) for p in mended.problems)


def mending_ledger(mended: Mended) -> tuple[LedgerEntry, ...]:
    """What was kept, part by part, every action of the mender, and everything that was dropped."""
    entries = []
    body = mended.triangulation
    tags = body.tags if body.tags is not None else np.zeros(len(body), dtype=np.int64)
    areas = body.areas
    for i, name in enumerate(body.tag_names or ("",)):
        own = tags == i
        for origin, rung, words in (
            (KEPT, Rung.KEEP, "triangles kept"),
            (CUT, Rung.CUT, "pieces of triangles cut where bodies cross"),
            (BRIDGED, Rung.BRIDGE, "triangles invented to bridge gaps"),
        ):
            which = own & (mended.origin == origin)
            if which.any():
                entries.append(
                    LedgerEntry(words, rung, (name,), "", count=int(which.sum()), area=float(areas[which].sum()))
                )
    for action in mended.actions:
        entries.append(
            LedgerEntry(
                action.kind,
                Rung(action.rung),
                (),
                action.reason,
                count=int(action.count),
                tolerance=float(action.tolerance),
                largest_move=float(action.largest_move),
                area=float(action.area),
                where=_point(action.where),
                size=float(action.size),
            )
        )
    for piece in mended.dropped:
        entries.append(
            LedgerEntry(
                piece.what,
                Rung.DROP,
                tuple(piece.parts),
                piece.why,
                count=len(piece.triangles),
                area=float(piece.area),
                where=_point(piece.where),
                size=float(piece.size),
            )
        )
    return tuple(entries)


def _uncovered(deviation: Deviation) -> Problem:
    """The refusal of patches that leave too much of the surface beyond the tolerance."""
    worst = min(deviation.input_to_output, deviation.output_to_input, key=lambda s: s.coverage)
    message = (
        f"the patches keep only {100.0 * worst.coverage:.1f} % of the surface within {worst.tolerance:.3g}; "
        f"the farthest place is {worst.largest:.3g} away; give a wider --tolerance or mend that place by hand"
    )
    return Problem("coverage", worst.where, worst.largest, message)


def _resolved(tolerance: Tolerance, body: Triangulation) -> tuple[Tolerance, float]:
    """The fit tolerance the data can carry, and the height of the data's facets.

    A tolerance nobody asked for is widened to that height, up to `WIDEST` times: closer, a smooth patch would have to
    copy the facets.
    """
    height = faceting(body, tolerance.angle)
    if tolerance.given or height <= tolerance.fit:
        return tolerance, height
    return replace(tolerance, fit=min(height, WIDEST * tolerance.fit)), height


def _fitting_entry(
    network: PatchNetwork, mended: Mended, tolerance: Tolerance, tries: int, resolution: float
) -> LedgerEntry:
    worst = float(np.nanmax(network.deviation))
    over = int((network.deviation > tolerance.of_tags(mended.triangulation.tag_names, network.layout.tags)).sum())
    reason = (
        f"bicubic patches over {len(network)} quads, layout {tries}; {over} stray farther than the fit tolerance; "
        + (f"the input's facets are {resolution:.3g} high" if resolution else "fitted to the true surfaces")
    )
    return LedgerEntry(
        "patches fitted",
        Rung.RESURFACE,
        mended.triangulation.tag_names,
        reason,
        count=len(network),
        tolerance=tolerance.fit,
        largest_move=worst,
    )


def _figures(
    network: PatchNetwork, faces: int, blocks: Blocks, mended: Mended, seams: Sequence[Seam], deviation: Deviation
) -> dict[str, float | int | str | bool]:
    """The numbers of the report's first table."""
    smooth = np.array([s.angle for s in seams if s.kind == "smooth"] or [0.0])
    inner = smooth_edges(network.layout)
    jumps = (curvature_jumps(network.layout, network.nets) * mended.triangulation.diagonal)[inner]
    jumps = jumps if len(jumps) else np.zeros(1)
    return {
        "faces": faces,
        "patches": len(network),
        "control points": len(network.nets.controls),
        "irregular vertices": network.layout.irregular_vertices,
        "grid blocks": len(blocks),
        "smallest block corner": smallest_corner(network.layout, blocks),
        "closed": bool(mended.closed),
        "openings kept": len(mended.openings),
        "noise": float(mended.noise),
        "coverage": deviation.coverage,
        "converged": deviation.coverage >= COVERAGE_GOAL,
        "largest seam gap": max((s.gap for s in seams if s.kind != "free"), default=0.0),
        "largest smooth seam angle": float(smooth.max()),
        "median smooth seam angle": float(np.median(smooth)),
        "smooth seam angle, 99 %": float(np.percentile(smooth, 99.0)),
        "largest curvature jump times diagonal": float(jumps.max()),
        "median curvature jump times diagonal": float(np.median(jumps)),
        "curvature jump times diagonal, 99 %": float(np.percentile(jumps, 99.0)),
        "volume": mended.triangulation.volume if mended.closed else float("nan"),
    }


def _refused(
    assembly: Assembly, mended: Mended, ledger: tuple[LedgerEntry, ...], problems: tuple[Problem, ...]
) -> Repaired:
    return Repaired(
        Verdict.REFUSED,
        (),
        (),
        mended.triangulation,
        ledger,
        None,
        0.0,
        problems,
        Assembly((), unit=assembly.unit, source=assembly.source),
    )
