"""The optional backend: QuadriFlow (Huang et al., SGP 2018; package pyquadriflow, MIT) in a child process.

Native code that may abort, hang or write to stdout, hence the child. Its quads follow sharp features only roughly, so
no edge of the result is marked sharp; openings it closes up are found out and refused.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.errors import EngineError
from patchwright.repair.layout.features import Features
from patchwright.repair.layout.pairing import QuadMesh

TIME_LIMIT = 120.0  # seconds
DEFAULT_QUADS = 1000

_CHILD = """
import sys
import numpy as np
from pyQuadriFlow.pyQuadriFlow import pyquadriflow
given = np.load(sys.argv[1])
open_ends = bool(given["open_ends"])
got = pyquadriflow(
    int(given["target"]), 0, given["vertices"].tolist(), given["triangles"].tolist(),
    True, open_ends, False, False, False,
)
np.savez(sys.argv[2], vertices=np.array(got["vertices"], dtype=float), quads=np.array(got["faces"], dtype=np.int64))
"""


def quadriflow(features: Features, target: int | None) -> tuple[QuadMesh, Features]:
    """Quads of QuadriFlow on the triangulation, and the features without their curves.

    Raises
    ------
    EngineError : not installed, crashed, took longer than TIME_LIMIT, or the result is not pure quad, 2-manifold and of
        the same Euler characteristic and openness as the triangulation.
    """
    if importlib.util.find_spec("pyQuadriFlow") is None:
        raise EngineError('the layout method "quadriflow" needs the package pyquadriflow (patchwright[quadriflow])')
    vertices, quads = _run(features, DEFAULT_QUADS if target is None else target)
    _check(vertices, quads, features)
    return _place(vertices, quads, features)


def _run(features: Features, target: int) -> tuple[Array, IntArray]:
    """Vertices and faces as the child returns them, in the model's coordinates."""
    body = features.body
    low, high = body.bounds
    middle, scale = 0.5 * (low + high), max(float((high - low).max()), float(np.finfo(np.float64).tiny))
    with tempfile.TemporaryDirectory() as folder:
        given, result = Path(folder) / "given.npz", Path(folder) / "result.npz"
        np.savez(
            given,
            vertices=(body.vertices - middle) / scale,
            triangles=body.triangles,
            target=target,
            open_ends=(features.neighbours < 0).any(),
        )
        command = [sys.executable, "-c", _CHILD, str(given), str(result)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=TIME_LIMIT, check=False)
        except subprocess.TimeoutExpired:
            raise EngineError(f"QuadriFlow did not finish {target} quads within {TIME_LIMIT:.0f} s") from None
        if done.returncode != 0 or not result.exists():
            words = done.stderr.decode(errors="replace").strip().splitlines()
            raise EngineError(f"QuadriFlow ended with code {done.returncode}: {words[-1] if words else 'no message'}")
        with np.load(result) as arrays:
            return arrays["vertices"] * scale + middle, arrays["quads"].reshape(-1, 4)


def _check(vertices: Array, quads: IntArray, features: Features) -> None:
    """Raise unless the result is pure quad, 2-manifold, oriented and of the triangulation's topology."""
    if not len(quads):
        raise EngineError("QuadriFlow returned no quads")
    if not np.isfinite(vertices).all() or quads.min() < 0 or quads.max() >= len(vertices):
        raise EngineError("QuadriFlow returned vertices that are not finite or faces without vertices")
    if (np.sort(quads, axis=1)[:, 1:] == np.sort(quads, axis=1)[:, :-1]).any():
        raise EngineError("QuadriFlow returned faces that are not quads")
    n = len(vertices)
    start, end = quads.reshape(-1), np.roll(quads, -1, axis=1).reshape(-1)
    directed = start * n + end
    key, count = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_counts=True)
    if count.max() > 2 or len(np.unique(directed)) < len(directed):
        raise EngineError("QuadriFlow returned a mesh that is not an oriented 2-manifold")
    body = features.body
    free = int((features.neighbours < 0).sum())
    euler = len(body.vertices) - (3 * len(body) + free) // 2 + len(body)
    own = len(np.unique(quads)) - len(key) + len(quads)
    if own != euler or bool((count == 1).any()) != bool(free):
        raise EngineError(f"QuadriFlow changed the topology: Euler characteristic {own} instead of {euler}")


def _place(vertices: Array, quads: IntArray, features: Features) -> tuple[QuadMesh, Features]:
    """The quads on the triangulation, all vertices free."""
    from patchwright.models.tree import Tree
    from patchwright.repair.layout import _remesh_kernel as records
    from patchwright.repair.layout.quad_smooth import update_outward
    from patchwright.repair.layout.remesh import ground_of

    used, quads = np.unique(quads, return_inverse=True)
    quads = np.ascontiguousarray(quads.reshape(-1, 4), dtype=np.int64)
    body = features.body
    none = np.zeros(0, dtype=np.int64)
    bare = replace(
        features,
        side_curve=np.full_like(features.side_curve, -1),
        region=np.zeros_like(features.region),
        offsets=np.zeros(1, dtype=np.int64),
        vertices=none,
        along=np.zeros(0),
        beside=np.zeros((0, 2), dtype=np.int64),
        kind=none,
        corners=none,
    )
    n, m = len(used), len(quads)
    closest = Tree.of(body).closest(vertices[used])
    ground = ground_of(bare, np.full(len(body.vertices), body.diagonal))
    triangle = np.array(closest.triangle, dtype=np.int64)
    index, empty = np.zeros(n, dtype=np.int64), np.zeros((0, 3), dtype=np.int64)
    columns: Any = [
        np.array(closest.points),
        features.normals[triangle],
        np.full(n, body.diagonal),
        index,
        index - 1,
        np.zeros(n),
        triangle,
        index.copy(),
        empty,
        empty.copy(),
        empty.copy(),
        none,
        index.copy(),
    ]
    mesh = records.Mesh._make(columns)
    p = mesh.X[quads]
    outward = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    region = np.zeros(m, dtype=np.int64)
    update_outward(mesh, ground, quads, region, outward)
    return QuadMesh(ground, mesh, quads, region, outward, np.zeros((0, 2), dtype=np.int64), none), bare
