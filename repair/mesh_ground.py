"""What resurfacing does otherwise when its triangulation is the tessellation of CAD faces: the true surfaces lead.

Patches are projected onto them, the layout is moved onto them, and distances are taken from them, so that neither the
facets of the tessellation nor its chords along edges limit the fit.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.assembly import Assembly
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.deviation import Deviation, two_sided
from patchwright.repair.ground.true_deviation import true_deviation
from patchwright.repair.ground.true_ground import TrueGround, TrueSurfaces
from patchwright.repair.ground.true_surface import Outcome
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.layout.true_layout import onto_true
from patchwright.repair.mender.mend import BRIDGED, Mended
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.result import LedgerEntry, Rung

REACH = 2.0  # times the deflection measured at middles of triangle sides, which may miss the farthest places


def ground_of(assembly: Assembly, mended: Mended) -> Tree | TrueGround:
    """The mended triangulation to project onto, with the true surfaces where the assembly is CAD."""
    tree, true = Tree.of(mended.triangulation), TrueSurfaces.of(assembly)
    if true is None:
        return tree
    return TrueGround.of(tree, np.where(np.asarray(mended.origin) == BRIDGED, -1, mended.source), true)


def on_model(layout: QuadLayout, ground: Tree | TrueGround, assembly: Assembly, chord: float) -> QuadLayout:
    """The layout moved onto the CAD model, with chords along its creases within `chord`; unchanged on a mesh."""
    if not isinstance(ground, TrueGround):
        return layout
    curves = assembly.topology.curves if assembly.topology is not None else ()
    return onto_true(layout, ground, curves, chord, REACH * ground.deflection())


def measured(
    ground: Tree | TrueGround,
    after: Triangulation,
    tolerance: float | tuple[Array, Array],
    skip_before: BoolArray,
    skip_after: BoolArray,
) -> Deviation:
    """Two-sided distance between the ground and the patches' tessellation, without invented triangles.

    `tolerance` is the length coverage is counted against, or one for each triangle of the ground and of `after`.
    """
    if isinstance(ground, TrueGround):
        return true_deviation(ground, after, tolerance, skip_before, skip_after)
    return two_sided(
        ground.triangulation,
        after,
        tolerance,
        skip_before=skip_before,
        skip_after=skip_after,
        before_tree=ground,
    )


def true_entry(ground: TrueGround, network: PatchNetwork, assembly: Assembly) -> LedgerEntry:
    """How many points of the patches found the true surface below them, and why the others did not."""
    points = network.points(8)[:, :-1, :-1][~network.invented]
    found, status = ground.closest_with_outcome(points)
    counts = np.bincount(status, minlength=len(Outcome))
    rest = "; ".join(f"{counts[k]} {k.sentence}" for k in Outcome if k != Outcome.CONVERGED and counts[k])
    return LedgerEntry(
        "faces replaced by patches on their true surfaces",
        Rung.RESURFACE,
        (),
        f"{counts[Outcome.CONVERGED]} of {len(points)} points of the patches were led by the true surfaces of "
        f"{len(assembly.parts)} faces{', the rest by their triangles: ' + rest if rest else ''}",
        count=len(assembly.parts),
        largest_move=float(found.distance.max(initial=0.0)),
    )
