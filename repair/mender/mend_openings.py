"""The uniting stage as decided: of the openings that are to be closed, some may have to stay open."""

from __future__ import annotations

from patchwright.models.arrays import Array
from patchwright.repair.mender.bridge import borders_of
from patchwright.repair.mender.mend_decided import undecided
from patchwright.repair.mender.mend_gaps import fill
from patchwright.repair.mender.mend_union import unite
from patchwright.repair.mender.mended import Work


def unite_as_decided(work: Work, openings: str) -> tuple[Array, ...]:
    """`unite`; of the openings to be closed, those decided upon stay open."""
    borders = borders_of(work.now, work.adjacency()) if openings == "close" else ()
    everything = list(range(len(borders)))
    if not borders or len(undecided(work, borders, everything, [], "close")[0]) == len(borders):
        return unite(work, openings)
    unite(work, "keep")
    borders = borders_of(work.now, work.adjacency())
    singles, _ = undecided(work, borders, list(range(len(borders))), [], "close")
    fill(work, borders, singles, [], "close")
    return tuple(border.points for border in borders_of(work.now, work.adjacency()))
