"""Kernel of `opened_quads`: vertices of small quads move downhill on an energy that no unfolded quad has infinite.

The energy is that of Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, Foldover-free maps in 50 lines of code,
ACM TOG 40 (2021), equations 4 and 5, summed over the corners of quads: with J the Jacobian from a rectangle as long and
wide as the large quad, tr(J'J) / (2 det J) + (det J + 1 / det J) / 2, where the det J divided by is kept above zero.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import filling, inner
from patchwright.repair.layout._quad_kernel import try_place

_AREA = 0.2  # share of the term that evens out the areas
_TRIALS = 8  # lengths of a step, each half of the one before


@inner
def corner_energy(m, quads, outward, sizes, q, k, eps):
    """(energy, determinant) of corner k of quad q."""
    X = m.X
    p, after, before = quads[q, k], quads[q, (k + 1) % 4], quads[q, (k + 3) % 4]
    a, b = sizes[q, k % 2], sizes[q, (k + 1) % 2]
    ux, uy, uz = (X[after, 0] - X[p, 0]) / a, (X[after, 1] - X[p, 1]) / a, (X[after, 2] - X[p, 2]) / a
    wx, wy, wz = (X[before, 0] - X[p, 0]) / b, (X[before, 1] - X[p, 1]) / b, (X[before, 2] - X[p, 2]) / b
    det = (
        outward[q, 0] * (uy * wz - uz * wy) + outward[q, 1] * (uz * wx - ux * wz) + outward[q, 2] * (ux * wy - uy * wx)
    )
    size = ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
    above = 0.5 * (det + np.sqrt(eps * eps + det * det))
    return ((1.0 - _AREA) * size + _AREA * (det * det + 1.0)) / (2.0 * above), det


@inner
def energy_round(m, quads, outward, sizes, offsets, around, v, eps):
    """Energy of the corners of all quads round a vertex."""
    total = 0.0
    for a in range(offsets[v], offsets[v + 1]):
        for k in range(4):
            total += corner_energy(m, quads, outward, sizes, around[a], k, eps[around[a]])[0]
    return total


@inner
def gradient(m, quads, outward, sizes, offsets, around, v, eps):
    """(x, y, z, stiffness): the energy's gradient by the place of v, and a bound of its second derivatives, nearly."""
    X = m.X
    gx, gy, gz, stiff = 0.0, 0.0, 0.0, 0.0
    for i in range(offsets[v], offsets[v + 1]):
        q = around[i]
        nx, ny, nz = outward[q, 0], outward[q, 1], outward[q, 2]
        for k in range(4):
            p, after, before = quads[q, k], quads[q, (k + 1) % 4], quads[q, (k + 3) % 4]
            if p != v and after != v and before != v:
                continue
            a, b = sizes[q, k % 2], sizes[q, (k + 1) % 2]
            ux, uy, uz = (X[after, 0] - X[p, 0]) / a, (X[after, 1] - X[p, 1]) / a, (X[after, 2] - X[p, 2]) / a
            wx, wy, wz = (X[before, 0] - X[p, 0]) / b, (X[before, 1] - X[p, 1]) / b, (X[before, 2] - X[p, 2]) / b
            det = nx * (uy * wz - uz * wy) + ny * (uz * wx - ux * wz) + nz * (ux * wy - uy * wx)
            root = np.sqrt(eps[q] * eps[q] + det * det)
            above = 0.5 * (det + root)
            size = ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
            value = ((1.0 - _AREA) * size + _AREA * (det * det + 1.0)) / (2.0 * above)
            # by det, at the same size; and by u and w
            slope = _AREA * det / above - value * 0.5 * (1.0 + det / root) / above
            share = (1.0 - _AREA) / above
            dux, duy, duz = share * ux, share * uy, share * uz
            dwx, dwy, dwz = share * wx, share * wy, share * wz
            dux, duy, duz = (
                dux + slope * (wy * nz - wz * ny),
                duy + slope * (wz * nx - wx * nz),
                duz + slope * (wx * ny - wy * nx),
            )
            dwx, dwy, dwz = (
                dwx + slope * (ny * uz - nz * uy),
                dwy + slope * (nz * ux - nx * uz),
                dwz + slope * (nx * uy - ny * ux),
            )
            if after == v:
                gx, gy, gz = gx + dux / a, gy + duy / a, gz + duz / a
            elif before == v:
                gx, gy, gz = gx + dwx / b, gy + dwy / b, gz + dwz / b
            else:
                gx, gy, gz = gx - dux / a - dwx / b, gy - duy / a - dwy / b, gz - duz / a - dwz / b
            stiff += share * (1.0 / (a * a) + 1.0 / (b * b))
    return gx, gy, gz, stiff


@filling
def least_determinant(m, quads, outward, sizes, out):
    """Into out (m,) the least determinant at the corners of each quad."""
    for q in range(len(quads)):
        out[q] = np.inf
        for k in range(4):
            out[q] = min(out[q], corner_energy(m, quads, outward, sizes, q, k, 1.0)[1])


@filling
def descend(m, g, quads, outward, sizes, offsets, around, free, eps, sweeps):
    """Move the `free` (n,) vertices down the energy, one after the other; `eps` (m,) keeps the divisors above zero."""
    X, N, H, vt = m.X, m.N, m.H, m.vt
    for _ in range(sweeps):
        for v in range(len(free)):
            if not free[v]:
                continue
            gx, gy, gz, stiff = gradient(m, quads, outward, sizes, offsets, around, v, eps)
            up = gx * N[v, 0] + gy * N[v, 1] + gz * N[v, 2]
            gx, gy, gz = gx - up * N[v, 0], gy - up * N[v, 1], gz - up * N[v, 2]
            if stiff <= 0.0 or gx * gx + gy * gy + gz * gz == 0.0:
                continue
            old = energy_round(m, quads, outward, sizes, offsets, around, v, eps)
            ox, oy, oz, ot, oh = X[v, 0], X[v, 1], X[v, 2], vt[v], H[v]
            onx, ony, onz = N[v, 0], N[v, 1], N[v, 2]
            step = 1.0 / stiff
            for _ in range(_TRIALS):
                try_place(m, g, v, ox - step * gx, oy - step * gy, oz - step * gz)
                if energy_round(m, quads, outward, sizes, offsets, around, v, eps) < old:
                    break
                X[v, 0], X[v, 1], X[v, 2] = ox, oy, oz
                N[v, 0], N[v, 1], N[v, 2] = onx, ony, onz
                vt[v], H[v] = ot, oh
                step *= 0.5
