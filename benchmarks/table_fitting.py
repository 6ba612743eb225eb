"""Control points against tolerance: our C2 fit with few knots, the paper's C1 form, uniform and refined.

    python benchmarks/table_fitting.py

Four surfaces over the unit square, each a single patch of known shape: two test functions, the upper skin of a wing
with a round leading edge and a twisted blade. For each tolerance the fewest pieces are taken that keep the largest
distance at 101 x 101 places within it: the same number in both directions (the paper's uniform refinement), or, for the
C2 form, in each direction its own. Columns: control points, error over the tolerance, largest normal angle in degrees.
"""

from __future__ import annotations

import numpy as np

from patchwright.repair.patches.approximant import bicubic_approximant
from patchwright.repair.patches.fair_fit import curve_fit, fit_patches
from patchwright.repair.patches.spline_space import uniform_collocation

TOLERANCES = (1e-3, 1e-4, 1e-5)
MOST = 64
PLACES = 101


def wave(u, v):
    return np.stack([u, v, 0.15 * np.sin(2 * np.pi * u) * np.cos(np.pi * v) + 0.1 * u * v], axis=-1)


def bumps(u, v):
    height = 0.2 * np.exp(-20 * ((u - 0.4) ** 2 + (v - 0.6) ** 2)) + 0.1 * np.exp(-60 * (u - 0.8) ** 2)
    return np.stack([u, v, height], axis=-1)


def wing(u, v):
    x = np.sin(0.5 * np.pi * u) ** 2  # crowded at the leading edge, where the thickness goes with the root
    half = 0.6 * (0.2969 * np.sin(0.5 * np.pi * u) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    chord = 1.0 - 0.5 * v
    return np.stack([0.4 * v + chord * x, 1.5 * v, chord * half], axis=-1)


def blade(u, v):
    turn, x, z = 0.8 * v, u - 0.4, 0.2 * u * (1 - u)
    return np.stack([np.cos(turn) * x - np.sin(turn) * z, v, np.sin(turn) * x + np.cos(turn) * z], axis=-1)


SURFACES = {"wave": wave, "bumps": bumps, "wing": wing, "blade": blade}


def sampled(surface, m, n):
    return surface(*np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n), indexing="ij"))


def unit_normals(points):
    normal = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def paper(surface, cells, twist):
    return bicubic_approximant(sampled(surface, cells + 1, cells + 1), twist=twist)


def least_squares(surface, m, n):
    """The net of the C2 fit: boundary curves first, then the inside."""
    a, b = 6 * m + 1, 6 * n + 1
    points = sampled(surface, a, b)

    def curve(samples, cells):
        from_samples, from_ends = curve_fit(cells, len(samples), 1)
        ends = samples[[0, -1]]
        return np.concatenate([ends[:1], from_samples @ samples + from_ends[:, [0, -1]] @ ends, ends[1:]])

    net = np.zeros((1, m + 3, n + 3, 3))
    net[0, :, 0], net[0, :, -1] = curve(points[:, 0], m), curve(points[:, -1], m)
    net[0, 0], net[0, -1] = curve(points[0], n), curve(points[-1], n)
    return fit_patches(net, points[None])[0]


def values(net):
    m, n = net.shape[0] - 3, net.shape[1] - 3
    return np.einsum("ai,ijd,bj->abd", uniform_collocation(m, PLACES), net, uniform_collocation(n, PLACES))


def judged(points, exact):
    error = np.linalg.norm(points - exact, axis=-1).max()
    half = np.linalg.norm(unit_normals(points) - unit_normals(exact), axis=-1).max() / 2
    return error, np.degrees(2 * np.arcsin(min(half, 1.0)))


def fewest(fit, exact, tolerance, tries):
    """The first of `tries` (ordered by control points) whose fit keeps the tolerance."""
    for cells in tries:
        count, points = fit(*cells)
        error, angle = judged(points, exact)
        if error <= tolerance:
            return count, error / tolerance, angle
    return None


def main() -> None:
    t = np.linspace(0, 1, PLACES)
    square = [(k, k) for k in range(1, MOST + 1)]
    steps = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
    free = sorted(((m, n) for m in steps for n in steps), key=lambda c: (c[0] + 3) * (c[1] + 3))
    print(f"{'surface':8s}{'tolerance':>10s}  " + "".join(f"{name:>28s}" for name in METHODS))
    for name, surface in SURFACES.items():
        exact = sampled(surface, PLACES, PLACES)

        def c1(twist, surface=surface):
            def fit(m, n):
                return (3 * m + 1) * (3 * n + 1), paper(surface, m, twist).grid(t, t)

            return fit

        def c2(m, n, surface=surface):
            return (m + 3) * (n + 3), values(least_squares(surface, m, n))

        for tolerance in TOLERANCES:
            cells = [
                fewest(c1("zero"), exact, tolerance, square),
                fewest(c1("bessel"), exact, tolerance, square),
                fewest(c2, exact, tolerance, square),
                fewest(c2, exact, tolerance, free),
            ]
            told = "".join(
                f"{'none within ' + str(MOST):>28s}" if c is None else f"{c[0]:12d} {c[1]:6.2f} {c[2]:8.3f}"
                for c in cells
            )
            print(f"{name:8s}{tolerance:10.0e}  {told}")


METHODS = ("C1, zero twist, uniform", "C1, Bessel twist, uniform", "C2, uniform", "C2, own per direction")

if __name__ == "__main__":
    main()
