"""STL of 1e6 triangles: read with equal corners merged, and written, beside VTK and trimesh; growth of the cost.

Run: pytest benchmarks/bench_stl.py --benchmark-only -m "slow or not slow"
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.models.io import read, write

pytest.importorskip("pytest_benchmark")


def wavy(n: int) -> Triangulation:
    """A height field of 2·n² triangles over (n + 1)² vertices whose coordinates are float32 numbers."""
    u = np.linspace(0.0, 1.0, n + 1)
    x, y = np.meshgrid(u, u, indexing="ij")
    points = np.stack([x, y, np.sin(5.0 * x) * np.cos(4.0 * y)], axis=-1).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Triangulation(points.astype(np.float32).astype(np.float64), triangles)


@pytest.fixture(scope="module")
def surface() -> Triangulation:
    return wavy(708)


@pytest.fixture(scope="module", params=["binary", "ascii"])
def path(request: pytest.FixtureRequest, surface: Triangulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place: Path = tmp_path_factory.mktemp("stl") / f"{request.param}.stl"
    write(place, surface, ascii=request.param == "ascii")
    return place


def test_read_patchwright(benchmark: Any, path: Path, surface: Triangulation) -> None:
    read(path)
    assembly = benchmark.pedantic(read, args=(path,), rounds=5)
    assert len(assembly.parts[0].triangulation.vertices) == len(surface.vertices)


def test_read_pyvista(benchmark: Any, path: Path, surface: Triangulation) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = benchmark.pedantic(pyvista.read, args=(path,), rounds=5 if "binary" in path.name else 2)
    assert mesh.n_points == len(surface.vertices)


def test_read_trimesh(benchmark: Any, path: Path, surface: Triangulation) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = benchmark.pedantic(trimesh.load_mesh, args=(path,), rounds=2)
    assert len(mesh.vertices) == len(surface.vertices)


@pytest.mark.parametrize("form", [False, True], ids=["binary", "ascii"])
def test_write_patchwright(benchmark: Any, surface: Triangulation, tmp_path: Path, form: bool) -> None:
    benchmark.pedantic(write, args=(tmp_path / "a.stl", surface), kwargs={"ascii": form}, rounds=2)


@pytest.mark.parametrize("form", [True, False], ids=["binary", "ascii"])
def test_write_pyvista(benchmark: Any, surface: Triangulation, tmp_path: Path, form: bool) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles)
    benchmark.pedantic(mesh.save, args=(tmp_path / "a.stl",), kwargs={"binary": form}, rounds=2)


def test_the_cost_grows_with_the_number_of_triangles(tmp_path: Path) -> None:
    """Eight times the triangles cost at most 16 times the time: linear but for the caches."""
    seconds = []
    for n in (250, 707):
        write(tmp_path / "a.stl", wavy(n), ascii=False)
        read(tmp_path / "a.stl")
        start = [time.perf_counter()]
        for _ in range(3):
            read(tmp_path / "a.stl")
            start.append(time.perf_counter())
        seconds.append(min(np.diff(start)))
    assert seconds[1] < 16.0 * seconds[0]
