"""Regions: defective edges or triangles that hang together become one defect with a count."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.checks.examination import Examination
from patchwright.repair.diagnosis import Defect, Severity

MOST = 2000  # regions of one kind that are listed one by one; the smaller ones are summed up in one more


def region_labels(elements: IntArray, links: IntArray | None = None) -> IntArray:
    """(k,) labels 0..r-1 of elements (k, c), given by their vertices, connected where they share one.

    `links` (j, 2) are pairs of elements that belong together besides.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(elements)
    if not count:
        return np.zeros(0, dtype=np.int64)
    used, local = np.unique(elements, return_inverse=True)
    local = local.reshape(elements.shape)
    rows = [np.repeat(np.arange(count), elements.shape[1])]
    columns = [local.reshape(-1) + count]
    if links is not None and len(links):
        rows.append(links[:, 0])
        columns.append(links[:, 1])
    i, j = np.concatenate(rows), np.concatenate(columns)
    size = count + len(used)
    _, label = connected_components(
        coo_array((np.ones(len(i), dtype=np.int8), (i, j)), shape=(size, size)), directed=False
    )
    return np.unique(label[:count], return_inverse=True)[1].astype(np.int64)


def regional(
    exam: Examination,
    kind: str,
    severity: Severity,
    elements: IntArray,
    points: Array,
    triangles: IntArray,
    say: Callable[[int, float], str],
    *,
    links: IntArray | None = None,
    labels: IntArray | None = None,
    curves: Sequence[tuple[Array, ...]] | None = None,
) -> list[Defect]:
    """One defect per connected region.

    Parameters
    ----------
    elements : (k, c) vertex indices that tell what hangs together
    points : (k, c', 3) coordinates of the elements
    triangles : (k,) a triangle (index into `exam.raw`) each belongs to, for the parts' names
    say : the message, from the count and the extent
    links, labels : further pairs that belong together, or the regions themselves when they are known
    curves : the curves that belong to each region of `labels`
    """
    if not len(elements):
        return []
    label = region_labels(elements, links) if labels is None else labels
    counts = np.bincount(label)
    order = np.argsort(label, kind="stable")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    low = np.minimum.reduceat(points.min(axis=1)[order], starts)
    high = np.maximum.reduceat(points.max(axis=1)[order], starts)
    middle = np.add.reduceat(points.mean(axis=1)[order], starts) / counts[:, None]
    size = np.linalg.norm(high - low, axis=1)
    rank = np.lexsort((size, counts))[::-1]
    defects = []
    for r in rank[:MOST]:
        own = order[starts[r] : starts[r] + counts[r]]
        defects.append(
            Defect(
                kind,
                severity,
                middle[r],
                float(size[r]),
                exam.parts_of(triangles[own]),
                int(counts[r]),
                say(int(counts[r]), float(size[r])),
                np.stack([low[r], high[r]]),
                curves=() if curves is None else curves[r],
            )
        )
    rest = rank[MOST:]
    if len(rest):
        total = int(counts[rest].sum())
        own = np.flatnonzero(np.isin(label, rest))
        defects.append(
            Defect(
                kind,
                severity,
                middle[rest].mean(axis=0),
                float(size[rest].max()),
                exam.parts_of(triangles[own]),
                total,
                f"{say(total, float(size[rest].max()))}, in {len(rest)} further small places",
                np.stack([low[rest].min(axis=0), high[rest].max(axis=0)]),
            )
        )
    return defects


def plural(count: int, word: str) -> str:
    """ "1 edge", "2 edges"."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
