"""The dirty half model in high-lift configuration over ten seeds, one row each, beside an alpha wrap of the same input.

    python benchmarks/table_high_lift.py [--seeds N] [--first N] [--wrap]

`slot` is the share of points half-way across the slot that are outside the result (100 %: it stayed open), `surface`
the largest distance of the result's points to the undamaged triangles (a bridge from the upper to the lower skin would
be half the wing's thickness away), `line` the largest distance between the wing-body line of the result and that of the
undamaged triangulations, both ways, `plane` the largest |y| of the border at the symmetry plane, triangles and patches
alike, `located` the share of injected defects that diagnosis reports at their place, `false` the bridges at places
where nothing is missing. Lengths are shares of the aircraft's diagonal. `--wrap` adds pymeshlab's alpha wrap (an
optional peer) with cells of 2 % and 0.5 % of the diagonal; it has no line: the true line's distance to it is told.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.samples.high_lift import dirty_high_lift
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.models.winding import winding_number
from patchwright.repair import repair
from patchwright.repair.deviation import sample_area

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import oracles_high_lift as oracle


def in_slot(body: Triangulation, parts: dict[str, Triangulation]) -> str:
    outside = np.abs(winding_number(body, oracle.slot_points(parts))) < 0.5
    return f"slot {outside.mean():6.1%}"


def ours(seed: int) -> str:
    dirty = dirty_high_lift(seed)
    parts = {part.name: part.triangulation for part in dirty.sample.assembly.parts}
    truth = concatenate(list(parts.values()))
    size = truth.diagonal
    start = time.process_time()
    result = repair(dirty.assembly, domain=oracle.DOMAIN)
    spent = time.process_time() - start
    body = result.triangulation
    craft = body.take(np.isin(body.tags, [body.tag_names.index(n) for n in parts])).compact()
    rim = Adjacency.of(craft)
    off = float(Tree.of(truth).closest(sample_area(craft, 40_000)[0]).distance.max())
    line, exact = oracle.edges_between(craft, ("fuselage",), oracle.WING), oracle.segments(parts)
    far = max(
        oracle.to_segments(exact.reshape(-1, 3), line).max(),
        oracle.to_segments(exact.mean(axis=1), line).max(),
        oracle.to_segments(line.reshape(-1, 3), exact).max(),
    )
    border = [np.abs(craft.vertices[np.unique(rim.edges[rim.free]), 1]).max()]
    if result.network is not None:
        edges, layout = result.network.edges, result.network.layout
        free = np.bincount(layout.quad_edges.reshape(-1), minlength=len(layout.edges)) == 1
        own = np.repeat(free, np.diff(edges.offsets))
        border.append(np.abs(edges.controls[own, 1]).max())
    return (
        f"{in_slot(oracle.mirrored(craft), parts)}  surface {off / size:7.1e}  line {far / size:7.1e}  "
        f"plane {max(border):7.1e}  located {oracle.located(dirty):6.1%}  "
        f"false {oracle.false_changes(dirty, result.ledger):2d}  "
        f"faces {len(result.faces):5d}  {spent:6.1f} s  {result.verdict.value}"
    )


def wrap(seed: int, cell: float) -> str:
    """Alpha wrap of the dirty aircraft and its mirror image; `cell` is a share of the diagonal."""
    import pymeshlab

    dirty = dirty_high_lift(seed)
    parts = {part.name: part.triangulation for part in dirty.sample.assembly.parts}
    truth = concatenate(list(parts.values()))
    whole = oracle.mirrored(dirty.damaged.triangulation)
    start = time.process_time()
    session = pymeshlab.MeshSet(verbose=False)
    session.add_mesh(pymeshlab.Mesh(np.array(whole.vertices), np.array(whole.triangles)))
    session.generate_alpha_wrap(
        alpha=pymeshlab.PercentageValue(100.0 * cell), offset=pymeshlab.PercentageValue(10.0 * cell)
    )
    mesh = session.current_mesh()
    spent = time.process_time() - start
    body = Triangulation(mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64))
    points = sample_area(body, 40_000)[0]
    off = float(Tree.of(oracle.mirrored(truth)).closest(points).distance.max())
    line = float(Tree.of(body).closest(oracle.segments(parts).reshape(-1, 3)).distance.max())
    return (
        f"{in_slot(body, parts)}  surface {off / truth.diagonal:7.1e}  line {line / truth.diagonal:7.1e}  "
        f"{len(body)} triangles  {spent:6.1f} s"
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--seeds", type=int, default=10)
    arguments.add_argument("--first", type=int, default=0, help="the first seed")
    arguments.add_argument("--wrap", action="store_true")
    asked = arguments.parse_args()
    for seed in range(asked.first, asked.first + asked.seeds):
        print(f"{seed:3d} patchwright  {ours(seed)}", flush=True)
        if asked.wrap:
            for cell in (0.02, 0.005):
                print(f"{seed:3d} wrap {cell:6.1%}  {wrap(seed, cell)}", flush=True)


if __name__ == "__main__":
    main()
