"""What bounds the flow domain from outside: kept as it came, beside the repaired body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.assembly import Assembly
from patchwright.models.triangulation import concatenate
from patchwright.repair.result import LedgerEntry, Repaired, Rung, Verdict
from patchwright.repair.surroundings import Surroundings


def with_aside(repaired: Repaired, model: Assembly, around: Surroundings) -> Repaired:
    """The repaired body with the triangles of far field and symmetry parts in `triangulation`, named in the ledger.

    No patches are fitted to them: the output's faces are those of the body.
    """
    if not around.aside.any():
        return repaired
    mesh = model.triangulation
    outer = mesh.take(around.aside).compact()
    entries = []
    for tag in np.unique(outer.tags) if outer.tags is not None else ():
        own = outer.take(outer.tags == tag)
        x, y, z = own.bounds.mean(axis=0).tolist()
        entries.append(
            LedgerEntry(
                "triangles round the flow domain kept",
                Rung.KEEP,
                (model.names[int(tag)],),
                "; ".join(around.reasons) + "; no patches are fitted to them",
                count=len(own),
                area=float(own.areas.sum()),
                where=(x, y, z),
                size=own.diagonal,
            )
        )
    ledger = (*repaired.ledger, *entries)
    if repaired.verdict is Verdict.REFUSED:
        return replace(repaired, ledger=ledger)
    return replace(repaired, ledger=ledger, triangulation=concatenate([repaired.triangulation, outer]))
