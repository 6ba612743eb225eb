"""A CAD model sewn where only round-off keeps edges apart, and healed where more does.

The sewing tolerance is found from the data: the smallest that leaves the fewest free edges and whose seams, measured
surface to surface, are closed, or no wider than the file's own edges leave them.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.cad.seams import measure_seams
from patchwright.models.cad.sewing import free_edge_curve, sew
from patchwright.models.errors import EngineError
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.draft import LOOSE_SHARE, Draft, Limits
from patchwright.repair.cad.face_steps import free_edges, widest
from patchwright.repair.cad.heal import heal
from patchwright.repair.cad.outcome import Outcome
from patchwright.repair.cad.retrace import retrace
from patchwright.repair.cad.vetoes import Vetoes

SHARES = np.array([1e-8, 1e-7, 1e-6, 1e-5, 1e-4])  # of the diagonal: sewing tolerances tried, smallest first
COINCIDENT = 1e-6  # of the diagonal: edges this near to each other are one edge that the file holds twice
SEAM_SHARE = 1e-6  # of the diagonal: the widest seam between kept faces that is closed
UNCHANGED = 1e-12  # of the diagonal: a kept surface's numbers may differ by round-off only
HEALING = 0.25  # of the time limit: how long one attempt to heal may take
WHOLE, WHOLE_PER_FACE = 120.0, 1.0  # seconds for one run of the kernel's sewing, where the deadline leaves so many


def sewn(model: Assembly, deadline: Deadline) -> Outcome:
    """The model sewn at the smallest tolerance that closes all that round-off keeps open, or as it came."""
    free = free_edges(model)
    if free == 0:
        return Outcome(model, None, "every edge is shared already")
    most = WHOLE + WHOLE_PER_FACE * len(model.parts)
    try:
        curve = free_edge_curve(model, SHARES * model.diagonal, time_limit=deadline.left(most))
    except EngineError as error:
        return Outcome(model, None, f"nothing is sewn: {error}", undone=("sewing",))
    counts = ", ".join(f"{n} at {t:.1g}" for t, n in zip(curve.tolerances, curve.free, strict=True))
    tried = [int(np.flatnonzero(curve.free == n)[0]) for n in np.unique(curve.free) if n < free]
    for k in tried:  # fewest free edges first, each at its smallest tolerance
        if deadline.passed:
            return Outcome(model, None, "nothing is sewn: the time was up", undone=("sewing",))
        try:
            result = sew(model, float(curve.tolerances[k]), time_limit=deadline.left(most))
        except EngineError:
            continue
        if result.dropped or result.surface_change.max(initial=0.0) > UNCHANGED * max(model.diagonal, 1.0):
            continue
        gap = _widest_to_be(result.assembly, model.diagonal, deadline)
        reason = f"{free} free edges become {result.free_edges}; free edges by tolerance: {counts}"
        if gap <= SEAM_SHARE * model.diagonal:
            return Outcome(result.assembly, result, reason)
        if curve.tolerances[k] <= COINCIDENT * model.diagonal and gap <= LOOSE_SHARE * model.diagonal:
            reason += (
                f"; the edges coincide, and surfaces up to {gap:.2g} apart beside them are the file's own precision"
            )
            return Outcome(result.assembly, result, reason)
    return Outcome(
        model, None, f"no tolerance up to {curve.tolerances[-1]:.3g} closes a seam whose surfaces meet; {counts}"
    )


def healed(
    model: Assembly, sewn: Outcome, deadline: Deadline, folded: Collection[int] = (), vetoes: Vetoes | None = None
) -> Outcome:
    """The sewn model healed, or the model as it came where healing alone closes as much with narrower seams.

    Sewing takes edges within its tolerance for one; healing finds the curve where their surfaces meet. So where sewing
    left free edges or needed more than round-off, both are tried. `vetoes` are what a plan rejects.
    """
    if deadline.passed:
        return replace(sewn, undone=(*sewn.undone, "mending faces and seams"))
    limits = Limits.of(model.diagonal, deadline.left(HEALING * deadline.limit), vetoes)
    found = []
    if sewn.sewn is not None and (free_edges(sewn.assembly) or sewn.sewn.tolerance > COINCIDENT * model.diagonal):
        alone = heal(model, limits, folded)
        if alone is not None and alone.changes:
            found.append(Outcome(alone.assembly, None, sewn.reason, alone))
    if not found or free_edges(found[0].assembly):
        limits = Limits.of(model.diagonal, deadline.left(HEALING * deadline.limit), vetoes)
        made = heal(sewn.assembly, limits, folded)
        found.append(sewn if made is None else replace(sewn, assembly=made.assembly, healed=made))

    else:
        found.append(sewn)
    return min(found, key=lambda one: (free_edges(one.assembly), widest(one.assembly)))


def _widest_to_be(assembly: Assembly, diagonal: float, deadline: Deadline) -> float:
    """The widest seam once trims that stray from their edges are drawn anew, which is what comes next."""
    gap = max((s.gap for s in measure_seams(assembly)), default=0.0)
    if assembly.topology is None or gap <= SEAM_SHARE * diagonal:
        return gap
    drawn, _, _ = retrace(
        Draft(assembly, assembly.topology), Limits.of(diagonal, deadline.left(HEALING * deadline.limit))
    )
    return max(
        (s.gap for s in measure_seams(replace(drawn.assembly, topology=drawn.topology, native=None))), default=0.0
    )
