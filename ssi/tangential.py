"""Curves along which two surfaces touch, as arcs like all others."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array

TURN = 0.03  # radians between nodes: the quintic's error is below 1e-9 of the radius there


def steady(rows: Array, net_a: Array, net_b: Array) -> None:
    """Give ends on a degenerate edge, where a parameter means nothing, the parameter of the nodes before, in place."""
    from patchwright.ssi._tracing_kernel import surface_jets

    for end, near in ((0, 1), (-1, -2)):
        length = float(np.linalg.norm(rows[end, :3] - rows[near, :3])) * (-1.0 if end == 0 else 1.0)
        for side, net in ((0, net_a), (1, net_b)):
            jet = surface_jets(net, rows[end][None, 3 + 2 * side : 5 + 2 * side].copy())[0]
            for axis in (0, 1):
                at = 3 + 2 * side + axis
                if np.linalg.norm(jet[1 + axis]) < 1e-9:
                    rows[end, at] = np.clip(rows[near, at] + length * rows[near, at + 7], 0.0, 1.0)
                    rows[end, at + 7] = rows[near, at + 7]
                    rows[end, 7:10] = rows[near, 7:10]


def jets_of(rows: Array, closed: bool) -> tuple[Array, Array]:
    """Jets (n, 3, 7) and lengths of rows of x, w and their first derivatives; second derivatives by differences of the
    first over three nodes, which is enough for 1e-8 of the size at these steps."""
    from patchwright.ssi._tracing_kernel import piece_lengths

    n = rows.shape[0]
    jets = np.zeros((n, 3, 7))
    jets[:, 0], jets[:, 1] = rows[:, :7], rows[:, 7:14]
    chord = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1)
    cosine = np.clip((rows[1:, 7:10] * rows[:-1, 7:10]).sum(axis=1), -1.0, 1.0)
    lengths = chord * (1.0 + np.arccos(cosine) ** 2 / 24.0)
    for _ in range(3):
        jets[:, 2] = _differences(jets[:, 1], lengths, closed)
        # T . x'' = 0 by arc length
        T = jets[:, 1, :3]
        jets[:, 2, :3] -= (jets[:, 2, :3] * T).sum(axis=1)[:, None] * T
        lengths = piece_lengths(jets.reshape(n, 21))
    return jets, lengths


def _differences(d: Array, L: Array, closed: bool) -> Array:
    """The derivative of d by arc length: parabola through three neighbours."""
    n = d.shape[0]
    if n == 2:
        return np.repeat((d[1:] - d[:1]) / L[0], 2, axis=0)
    s = np.concatenate(([0.0], np.cumsum(L)))
    if closed:
        s = np.concatenate(([s[0] - L[-1]], s, [s[-1] + L[0]]))
        d = np.concatenate((d[-2:-1], d, d[1:2]))
    out = np.empty_like(d)
    width = min(5, d.shape[0])
    for i in range(d.shape[0]):
        k = min(max(i - width // 2, 0), d.shape[0] - width)
        t = s[k : k + width] - s[i]
        scale = np.abs(t).max()
        V = np.vander(t / scale, width, increasing=True)
        out[i] = np.linalg.solve(V, d[k : k + width])[1] / scale
    return out[1:-1] if closed else out
