"""The two orders of one surface with itself: S(p) = S(q) is S(q) = S(p), and a curve of both is one curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.ssi.arcs import Arc, hermite
from patchwright.ssi.singular_points import Ball

ORDER = np.array([0, 2, 1, 7, 8, 9, 10, 3, 4, 5, 6, 13, 14, 11, 12, 15, 16, 17, 18, 19])  # of a finding's columns
TURNED = np.array([0, 1, 2, 5, 6, 3, 4])  # of x, uv_a, uv_b
DENSE = 17  # samples of a piece


def swapped(rows: Array) -> Array:
    """Findings (k, ROW) with their two places exchanged."""
    return rows[:, ORDER]


def both_ways(ball: Ball) -> Ball:
    """A singular point with its places in both orders."""
    other = tuple(((j, i), w[[2, 3, 0, 1]]) for (i, j), w in ball.places)
    return replace(ball, places=ball.places + other)


def completed(arcs: list[Arc], scale: Array) -> list[Arc]:
    """The arcs in both orders, where one of two was taken for a repeat of the other."""
    dense = [_dense(arc) / scale for arc in arcs]
    out = list(arcs)
    for arc in arcs:
        probe = (arc.jets[arc.jets.shape[0] // 2, 0] / scale)[TURNED]
        if not any(_on(probe, other) for other in dense):
            out.append(replace(arc, jets=arc.jets[:, :, TURNED]))
    return out


def one_of_each(arcs: list[Arc], scale: Array) -> list[Arc]:
    """One of each two arcs that differ in the order of their parameters only.

    A closed arc on which the two places change over after half a turn is its own counterpart: half of it is kept.
    """
    out: list[Arc] = []
    kept: list[Array] = []
    for arc in sorted(arcs, key=lambda a: -float(a.lengths.sum())):
        dense = _dense(arc) / scale
        probe = (arc.jets[arc.jets.shape[0] // 2, 0] / scale)[TURNED]
        if any(_on(probe, other) for other in kept):
            continue
        if arc.closed and _on(probe, dense):
            arc = _half(arc, probe * scale, scale)
        out.append(arc)
        kept.append(_dense(arc) / scale)
    return out


def _dense(arc: Arc) -> Array:
    """(n, 7) samples of x and both parameters."""
    t = np.linspace(0.0, 1.0, DENSE)
    rows = [
        np.array([hermite(a, b, float(L), float(s)) for s in t])
        for a, b, L in zip(arc.jets[:-1], arc.jets[1:], arc.lengths, strict=True)
        if L > 0.0
    ]
    return np.concatenate(rows)


def _on(probe: Array, samples: Array) -> bool:
    """Whether a point lies on a polyline in the seven coordinates, within the sag of its chords."""
    a, d = samples[:-1], np.diff(samples, axis=0)
    size = np.maximum((d * d).sum(axis=1), 1e-300)
    t = np.clip(((probe - a) * d).sum(axis=1) / size, 0.0, 1.0)
    far = np.linalg.norm(a + t[:, None] * d - probe, axis=1)
    return bool((far <= 0.1 * np.sqrt(size) + 1e-7).any())


def _half(arc: Arc, probe: Array, scale: Array) -> Arc:
    """The closed arc from its middle node to where the places have changed over."""
    nodes = arc.jets[:, 0]
    k = nodes.shape[0] // 2
    m = int(np.argmin(np.linalg.norm((nodes - probe) / scale, axis=1)))
    first, last = min(k, m), max(k, m)
    return replace(
        arc,
        jets=arc.jets[first : last + 1],
        lengths=arc.lengths[first:last],
        closed=True,
        smooth=None if arc.smooth is None else arc.smooth[first : last + 1],
    )
