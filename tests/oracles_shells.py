"""Open and closed shells with known rims, made from formulas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from patchwright.models import Triangulation

Array = np.ndarray


def grid(f: Callable[[Array, Array], Array], n: int, m: int, *, wrap: bool = False) -> Triangulation:
    """Two triangles per cell of an n × m grid over the unit square; `wrap` joins u = 1 to u = 0."""
    u, v = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1), indexing="ij")
    points = f(u, v).reshape(-1, 3)
    i, j = (a.reshape(-1) for a in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    right = (i + 1) % n if wrap else i + 1
    a, b, c, d = i * (m + 1) + j, right * (m + 1) + j, right * (m + 1) + j + 1, i * (m + 1) + j + 1
    return Triangulation(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])).compact()


def soup(*parts: Triangulation) -> Triangulation:
    """All parts in one, nothing merged."""
    offsets = np.cumsum([0] + [len(p.vertices) for p in parts])
    return Triangulation(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.triangles + k for p, k in zip(parts, offsets, strict=False)]),
    )


def merged(t: Triangulation, digits: int = 9) -> Triangulation:
    """Vertices equal to so many digits are one; triangles that collapse go."""
    _, first, inverse = np.unique(np.round(t.vertices, digits) + 0.0, axis=0, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1)[t.triangles]
    a, b, c = triangles.T
    return Triangulation(t.vertices[first], triangles[(a != b) & (b != c) & (c != a)])


def unmerged(t: Triangulation, jitter: float = 0.0, seed: int = 0) -> Triangulation:
    """Every corner its own vertex, each moved by normal noise of the given size."""
    points = t.corners.reshape(-1, 3)
    noise = np.random.default_rng(seed).normal(scale=jitter, size=points.shape) if jitter else 0.0
    return Triangulation(points + noise, np.arange(len(points)).reshape(-1, 3))


def hemisphere(up: bool, shift: float, n: int = 48) -> Triangulation:
    """Half a unit sphere, outward, moved along z; its rim has n edges."""
    sign = 1.0 if up else -1.0

    def f(u: Array, v: Array) -> Array:
        angle, polar = 2 * np.pi * u * sign, 0.5 * np.pi * v
        x, y = np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle)
        return np.stack([x, y, sign * np.cos(polar) + shift], -1)

    t = merged(grid(f, n, n // 4, wrap=True))
    return t if up == (t.area_vectors[:, 2].sum() > 0) else Triangulation(t.vertices, t.triangles[:, ::-1])


def sphere(n: int = 48) -> Triangulation:
    """A closed unit sphere."""
    return merged(soup(hemisphere(True, 0.0, n), hemisphere(False, 0.0, n)))


def tube(length: float, n: int = 40, m: int = 10, radius: float = 1.0) -> Triangulation:
    """A cylinder's side, open at both ends."""
    return grid(
        lambda u, v: np.stack([radius * np.cos(2 * np.pi * u), radius * np.sin(2 * np.pi * u), length * v], -1),
        n, m, wrap=True,
    )  # fmt: skip


def blade(thickness: float, n: int = 80, m: int = 20, span: float = 6.0) -> Triangulation:
    """A NACA 4-digit wing of chord 1, sharp at the trailing edge, open at both ends."""

    def f(u: Array, v: Array) -> Array:
        x = 0.5 + 0.5 * np.cos(2 * np.pi * u)
        half = 5 * thickness * (0.2969 * np.sqrt(np.abs(x)) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
        return np.stack([x, np.where(u < 0.5, 1.0, -1.0) * half, span * v], -1)

    return grid(f, n, m, wrap=True)


def box(cells: tuple[int, ...] = (6,) * 6, skip: tuple[int, ...] = (), size: float = 1.0) -> Triangulation:
    """A cube, face k of cells[k]² squares (bottom, top, front, back, left, right); equal meshes are merged."""
    x, y, z = np.eye(3)
    frames = [
        (0 * x, y, x), (z, x, y), (0 * x, x, z), (y, z, x), (0 * x, z, y), (x, y, z),
    ]  # fmt: skip
    faces = [
        grid(lambda u, v, o=o, a=a, b=b: o + u[..., None] * a + v[..., None] * b, n, n)
        for k, ((o, a, b), n) in enumerate(zip(frames, cells, strict=True))
        if k not in skip
    ]
    t = merged(soup(*faces))
    return Triangulation(size * t.vertices, t.triangles)


def without(t: Triangulation, which: Array) -> Triangulation:
    """Without some triangles (indices or a mask)."""
    keep = np.ones(len(t), dtype=bool)
    keep[which] = False
    return t.take(keep).compact()


def moved(t: Triangulation, scale: float, seed: int) -> Triangulation:
    """Scaled, turned and shifted."""
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q if np.linalg.det(q) > 0 else -q
    return Triangulation(scale * (t.vertices @ q.T + rng.normal(size=3)), t.triangles)
