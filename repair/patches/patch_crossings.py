"""Patches that pass through each other or through themselves, seen on facets of every patch, with their places."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.mender.crossings import crossing_pairs
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.result import LedgerEntry, Rung

FACETS = 400_000  # of all patches together
INTERVALS = (3, 8)  # fewest and most per side of a patch


def patch_crossings(network: PatchNetwork, depth: float) -> tuple[IntArray, Array]:
    """(k, 2) pairs of patches where facets of one pass deeper than `depth` through facets of the other, (k, 3) where.

    Both are the same patch where one passes through itself. Facets are chords: what is nearer to each other than these
    stray from the surfaces may cross on facets alone, or on the surfaces alone.
    """
    per_side = int(np.clip(np.sqrt(FACETS / (2.0 * max(1, len(network)))), *INTERVALS))
    facets = network.tessellate(per_side)
    assert facets.tags is not None
    pairs = crossing_pairs(facets, depth)
    if not len(pairs):
        return pairs, np.zeros((0, 3))
    patches, which = np.unique(np.sort(facets.tags[pairs], axis=1), axis=0, return_inverse=True)
    middle = facets.vertices[facets.triangles[pairs]].mean(axis=(1, 2))
    count = np.bincount(which.reshape(-1))
    where = np.stack([np.bincount(which.reshape(-1), middle[:, k]) / count for k in range(3)], axis=1)
    return patches, where


def crossing_entries(network: PatchNetwork, names: tuple[str, ...], depth: float) -> tuple[LedgerEntry, ...]:
    """The ledger's entry for patches that cross; none where none do."""
    pairs, where = patch_crossings(network, depth)
    if not len(pairs):
        return ()
    low, high = where.min(axis=0), where.max(axis=0)
    x, y, z = where[0].tolist()
    reason = (
        f"{len(pairs)} pairs of patches pass through each other, the first near ({x:.6g}, {y:.6g}, {z:.6g}): "
        "the surface is closed but not free of crossings there"
    )
    size = float(np.linalg.norm(high - low))
    return (LedgerEntry("patches cross", Rung.RESURFACE, names, reason, count=len(pairs), where=(x, y, z), size=size),)
