"""Fingerprints: how a defect or a planned change is known again, in a re-ordered or slightly revised model.

A fingerprint is the kind, the place, the size and the parts; never an index. Two are the same thing when the kind is
the same, the sizes are alike and the places lie within the thing's own extent of each other. The short label made of
it is for people and files: equal models give equal labels, whatever the order of their triangles and parts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import blake2s

import numpy as np

from patchwright.models.arrays import Array

NEAR = 1e-3  # of the diagonal: places nearer than that are the same whatever their size
EXTENT = 0.5  # of the larger size: how far the middle of the same region may have moved
GROWN = 1.5  # times: a region that grew or shrank more is another
STEP = 1e-3  # of the diagonal: what a label's coordinates are rounded to


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """Kind, place (model length unit), size and names of the parts of one thing."""

    kind: str
    where: tuple[float, float, float]
    size: float
    parts: tuple[str, ...] = ()


def fingerprint(kind: str, where: Array | Sequence[float], size: float, parts: Iterable[str] = ()) -> Fingerprint:
    """A fingerprint; parts are sorted, an infinite size counts as none."""
    x, y, z = (float(c) for c in where)
    return Fingerprint(kind, (x, y, z), float(size) if np.isfinite(size) else 0.0, tuple(sorted(set(parts))))


def labels(things: Sequence[Fingerprint], diagonal: float) -> list[str]:
    """One label per thing, "kind-xxxxxx", unique among them; the hash is of the rounded fingerprint.

    Things that round alike are told apart by a number after the hash, in the order of their exact places.
    """
    scale = max(diagonal, np.finfo(float).tiny)
    first = []
    for thing in things:
        place = [round(c / scale / STEP) for c in thing.where]
        octave = round(float(np.log2(max(thing.size / scale, STEP))))
        text = "|".join(map(str, (thing.kind, *place, octave, *thing.parts)))
        first.append(f"{thing.kind}-{blake2s(text.encode(), digest_size=3).hexdigest()}")
    seen: Counter[str] = Counter()
    out = list(first)
    for i in sorted(range(len(things)), key=lambda i: (things[i].where, things[i].size)):
        seen[first[i]] += 1
        if seen[first[i]] > 1:
            out[i] = f"{first[i]}-{seen[first[i]]}"
    return out


def matched(old: Sequence[Fingerprint], new: Sequence[Fingerprint], diagonal: float) -> dict[int, int]:
    """Which of `new` (by index) is which of `old` (its index): one to one, nearest first.

    Parameters
    ----------
    old, new : the things of both models
    diagonal : of the newer model, model length unit
    """
    found: list[tuple[bool, float, int, int]] = []
    kinds = {thing.kind for thing in old} & {thing.kind for thing in new}
    for kind in sorted(kinds):
        a = [i for i, thing in enumerate(old) if thing.kind == kind]
        b = [i for i, thing in enumerate(new) if thing.kind == kind]
        size_a, size_b = (np.array([some[i].size for i in own]) for some, own in ((old, a), (new, b)))
        place_a, place_b = (np.array([some[i].where for i in own]) for some, own in ((old, a), (new, b)))
        apart = np.linalg.norm(place_a[:, None] - place_b[None], axis=2)
        larger = np.maximum(size_a[:, None], size_b[None])
        smaller = np.minimum(size_a[:, None], size_b[None])
        alike = (larger <= GROWN * smaller) | (larger <= NEAR * diagonal)
        near = apart <= np.maximum(NEAR * diagonal, EXTENT * larger)
        for i, j in np.argwhere(alike & near):
            one, other = old[a[i]], new[b[j]]
            strangers = bool(one.parts and other.parts and not set(one.parts) & set(other.parts))
            found.append((strangers, float(apart[i, j]), a[i], b[j]))
    pairs: dict[int, int] = {}
    taken: set[int] = set()
    for _, _, i, j in sorted(found):
        if i not in taken and j not in pairs:
            pairs[j] = i
            taken.add(i)
    return pairs
