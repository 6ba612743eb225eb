"""Closed networks written to STEP and IGES come back as one valid solid whose surfaces meet to round-off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from oracles_cad import EMPTY, cube_sphere, torus

from patchwright.models import Assembly, Cone, Cylinder, ParameterError, Part, Plane, Sphere, Torus, UnsupportedFormat
from patchwright.models.cad import brep_status, edge_deviation, measure_seams, surface_difference
from patchwright.models.io import read, write
from patchwright.models.nurbs_surface import NurbsSurface


def closed_volume(assembly: Assembly) -> float:
    """Volume of the welded tessellation; raises where an edge is not used once each way."""
    merged = assembly.triangulation
    vertices, index = np.unique(merged.vertices, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[merged.triangles]
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    code = edges[:, 0] * len(vertices) + edges[:, 1]
    back = edges[:, 1] * len(vertices) + edges[:, 0]
    assert len(np.unique(code)) == len(code)
    assert np.array_equal(np.sort(code), np.sort(back))
    return merged.volume


@pytest.mark.parametrize("suffix", [".step", ".igs"])
@pytest.mark.parametrize("shape", ["sphere", "torus"])
def test_closed_network_comes_back_as_one_solid(tmp_path: Path, suffix: str, shape: str) -> None:
    made = cube_sphere() if shape == "sphere" else torus(10, 10)
    path = tmp_path / f"closed{suffix}"
    write(path, made)
    back = read(path)
    assert back.names == made.names
    assert {p.body for p in back.parts} == {made.parts[0].body}
    assert back.topology is not None
    assert made.topology is not None
    assert len(back.topology.curves) == len(made.topology.curves)
    assert (back.topology.use_counts() == 2).all()
    seams = measure_seams(back)
    assert len(seams) == len(made.topology.curves)
    assert max(s.gap for s in seams) <= 1e-9 * back.diagonal
    assert max(s.tolerance for s in seams) <= max(1e-6 * back.diagonal, 1e-7)
    assert max(surface_difference(p.surface, q.surface) for p, q in zip(made.parts, back.parts, strict=True)) == 0.0
    assert set(brep_status(back).faces) == {type(brep_status(back).faces[0]).VALID}
    assert closed_volume(back) > 0.0


def test_inward_network_is_turned_outward(tmp_path: Path) -> None:
    made = cube_sphere()
    assert made.topology is not None
    inward = replace(made, topology=replace(made.topology, flipped=(True,) * 6))
    for number, assembly in enumerate((made, inward)):
        path = tmp_path / f"{number}.step"
        write(path, assembly)
        assert closed_volume(read(path)) > 0.0


def test_open_and_disjoint_parts_stay_apart(tmp_path: Path) -> None:
    made = cube_sphere()
    topology = made.topology
    assert topology is not None
    parts, loops = made.parts[:4], topology.loops[:4]
    opened = replace(made, parts=parts, topology=replace(topology, loops=loops, flipped=topology.flipped[:4]))
    write(tmp_path / "open.step", opened)
    back = read(tmp_path / "open.step")
    assert back.topology is not None
    used = np.bincount([u.edge for f in loops for loop in f for u in loop], minlength=len(topology.curves))
    assert (back.topology.use_counts() == 1).sum() == (used == 1).sum()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_scale_and_place_keep_the_seams(tmp_path: Path, scale: float) -> None:
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn[:, 0] *= np.sign(np.linalg.det(turn))
    made = torus(3, 3, place=lambda grid: scale * (grid @ turn.T + np.array([30.0, -20.0, 10.0])))
    write(tmp_path / "t.step", made)
    back = read(tmp_path / "t.step")
    assert max(s.gap for s in measure_seams(back)) <= 1e-9 * back.diagonal
    assert closed_volume(back) > 0.0


def test_units_scale_only_when_they_are_known(tmp_path: Path) -> None:
    made = cube_sphere()
    for own, wanted, factor in (("unknown", None, 1.0), ("mm", "m", 1.0), ("m", None, 1e3), ("unknown", "m", 1e3)):
        path = tmp_path / f"{own}-{wanted}.step"
        write(path, replace(made, unit=own), unit=wanted)
        back = read(path)
        assert back.unit == "mm"
        first, again = made.parts[0].surface, back.parts[0].surface
        assert isinstance(first, NurbsSurface)
        assert isinstance(again, NurbsSurface)
        np.testing.assert_allclose(again.control_points, factor * first.control_points, atol=1e-12 * factor * 10)
    with pytest.raises(ParameterError, match="parsec"):
        write(tmp_path / "p.step", replace(made, unit="parsec"))


@pytest.mark.parametrize("suffix", [".step", ".igs"])
def test_analytic_surfaces_survive_as_loose_faces(tmp_path: Path, suffix: str) -> None:
    shapes = [
        Plane((1, 2, 3), (1, 1, 0.5), u=(-1.0, 2.0), v=(0.0, 3.0)),
        Cylinder((10, 0, 0), (0, 1, 1), 2.0, u=(0.3, 2.9), v=(-1.0, 4.0)),
        Cone((20, 0, 0), (0, 0, 1), 0.4, 1.5, u=(0.2, 3.0), v=(0.5, 2.5)),
        Sphere((30, 0, 0), 3.0, u=(0.1, 3.0), v=(-1.0, 1.2)),
        Torus((45, 0, 0), (1, 0, 1), 5.0, 1.5, u=(0.5, 2.0), v=(0.1, 3.0)),
    ]
    made = Assembly(tuple(Part(f"s{i}", EMPTY, s) for i, s in enumerate(shapes)), unit="mm")
    path = tmp_path / f"loose{suffix}"
    write(path, made)
    back = read(path)
    assert len(back.parts) == len(shapes)
    for part in back.parts:
        assert part.surface is not None
        triangles = part.triangulation
        on = part.surface(triangles.uv[..., 0], triangles.uv[..., 1])  # type: ignore[index]
        assert np.abs(on - triangles.corners).max() <= 1e-7
    for own, part in zip(shapes, back.parts, strict=True):
        if suffix == ".step":
            assert surface_difference(own, part.surface) <= 1e-12
    assert edge_deviation(back).max() <= 1e-7


def test_names_of_any_length_and_sign_come_back(tmp_path: Path) -> None:
    names = ["wing", "a rather long name of a face", "rib-17", "it's", "flap 007", "x" * 60]
    made = cube_sphere()
    named = replace(made, parts=tuple(replace(p, name=n) for p, n in zip(made.parts, names, strict=True)))
    for suffix in (".step", ".igs"):
        write(tmp_path / f"n{suffix}", named)
        assert list(read(tmp_path / f"n{suffix}").names) == names


def test_triangles_are_refused_and_the_old_file_stays(tmp_path: Path) -> None:
    path = tmp_path / "old.step"
    path.write_text("old")
    with pytest.raises(UnsupportedFormat, match="no surface"):
        write(path, Assembly((Part("t", EMPTY),)))
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
