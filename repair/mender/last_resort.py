"""The rung before refusal: a wrap around what could not be mended, taken only where everything may be resurfaced."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.mend import BRIDGED, CUT, Action, Mended
from patchwright.repair.mender.wrap import wrap

CELLS_PER_DIAGONAL = 100.0


def wrapped(mended: Mended, raw: Triangulation, tolerance: Tolerance) -> Mended:
    """A mended model that is the wrap of its input; triangles farther from the input than `.fit` count as invented.

    The wrap rounds edges sharper than its cell and closes gaps narrower than two cells; both are said in its action.
    """
    cell = raw.diagonal / CELLS_PER_DIAGONAL
    made = wrap(raw, cell)
    body = made.triangulation
    centres = body.corners.mean(axis=1)
    distance = Tree.of(raw).closest(centres).distance
    origin = np.where(distance <= max(tolerance.fit, 2.0 * np.median(distance)), CUT, BRIDGED)
    reasons = "; ".join(sorted({p.message for p in mended.problems}))
    action = Action(
        "wrap",
        "resurface",
        centres.mean(axis=0),
        raw.diagonal,
        cell,
        f"the triangles cannot be mended ({reasons}); wrapped in cells of {cell:.3g}, sharper edges are rounded",
        len(body),
        float(distance.max()),
        float(body.areas.sum()),
    )
    return replace(
        mended,
        triangulation=body,
        origin=origin.astype(np.int64),
        source=made.nearest,
        actions=(*mended.actions, action),
        openings=(),
        closed=True,
        problems=(),
    )
