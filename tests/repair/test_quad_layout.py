"""Layouts whole: features covered, topology kept, nothing folded, numbers, invariance, failures."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from layout_shapes import cube, cylinder, jittered, moved, plate_with_hole, sphere, torus, wedge

from patchwright.models import EngineError, GeometryError, ParameterError, Triangulation
from patchwright.repair.layout import quadriflow
from patchwright.repair.layout.quad_layout import quad_layout

SHAPES = {
    "cube": cube(3),
    "sphere": sphere(),
    "torus": torus(),
    "cylinder": cylinder(),
    "plate": plate_with_hole(),
    "wedge": wedge(),
}
EULER = {"cube": 2, "sphere": 2, "torus": 0, "cylinder": 2, "plate": 0, "wedge": 2}


@pytest.fixture(scope="module")
def layouts():
    return {name: quad_layout(shape, target=150) for name, shape in SHAPES.items()}


@pytest.mark.parametrize("name", SHAPES)
def test_pure_manifold_and_of_the_same_topology(layouts, name):
    layout = layouts[name]
    assert layout.report.euler == (EULER[name], EULER[name])
    assert (layout.edges[:, 0] < layout.edges[:, 1]).all()
    uses = np.bincount(layout.quad_edges.reshape(-1), minlength=len(layout.edges))
    np.testing.assert_array_equal(uses, np.where(layout.boundary, 1, 2))
    start, end = layout.quads, np.roll(layout.quads, -1, axis=1)
    ends = layout.edges[layout.quad_edges]
    np.testing.assert_array_equal(np.where(layout.edge_reversed, ends[..., 1], ends[..., 0]), start)
    np.testing.assert_array_equal(np.where(layout.edge_reversed, ends[..., 0], ends[..., 1]), end)
    # one quad runs forth and the other back
    forth = np.bincount(layout.quad_edges[~layout.edge_reversed], minlength=len(layout.edges))
    assert (forth[~layout.boundary] == 1).all()
    for column in (0, 1):
        own = np.flatnonzero(layout.edge_quads[:, column] >= 0)
        assert (layout.quad_edges[layout.edge_quads[own, column]] == own[:, None]).any(axis=1).all()


@pytest.mark.parametrize("name", SHAPES)
def test_nothing_is_folded_and_features_are_covered(layouts, name):
    report = layouts[name].report
    assert report.folded == 0
    assert report.min_scaled_jacobian > 0.05
    assert report.median_scaled_jacobian > 0.7
    assert report.feature_coverage == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_paths_join_the_vertices(layouts, name):
    layout = layouts[name]
    np.testing.assert_array_equal(layout.path_points[layout.path_offsets[:-1]], layout.vertices[layout.edges[:, 0]])
    np.testing.assert_array_equal(layout.path_points[layout.path_offsets[1:] - 1], layout.vertices[layout.edges[:, 1]])
    assert np.diff(layout.path_offsets).min() >= 2


def test_cube_has_exact_planes_and_edges(layouts):
    layout = layouts["cube"]
    p = layout.path_points
    assert (np.minimum(np.abs(p), np.abs(p - 1.0)).min(axis=1) < 1e-12).all()
    lengths = np.linalg.norm(np.diff(layout.vertices[layout.edges], axis=1)[:, 0], axis=1)
    assert lengths[layout.sharp].sum() == pytest.approx(12.0, rel=1e-12)
    corners = np.isin(np.round(layout.vertices, 12), [0.0, 1.0]).all(axis=1)
    assert corners.sum() == 8
    for quad in layout.vertices[layout.quads]:
        assert np.ptp(quad, axis=0).min() < 1e-12


def test_paths_of_rims_keep_all_their_vertices(layouts):
    layout = layouts["cylinder"]
    length, points = 0.0, []
    for e in np.flatnonzero(layout.sharp):
        path = layout.path(int(e))
        length += np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        points.append(path)
    assert length == pytest.approx(2 * 96 * np.sin(np.pi / 48), rel=1e-12)
    given = SHAPES["cylinder"].vertices
    rim = given[(np.hypot(given[:, 0], given[:, 1]) > 1 - 1e-9) & (np.minimum(given[:, 2], 2 - given[:, 2]) < 1e-9)]
    distance = np.linalg.norm(rim[:, None] - np.concatenate(points)[None], axis=2).min(axis=1)
    assert distance.max() < 1e-12


def test_boundary_loops_stay(layouts):
    layout = layouts["plate"]
    length = sum(
        np.linalg.norm(np.diff(layout.path(int(e)), axis=0), axis=1).sum() for e in np.flatnonzero(layout.boundary)
    )
    assert length == pytest.approx(8.0 + 128 * 0.4 * np.sin(np.pi / 64), rel=1e-12)
    assert not layout.sharp.any()


def test_smooth_paths_lie_on_the_surface(layouts):
    layout = layouts["sphere"]
    radius = np.linalg.norm(layout.path_points, axis=1)
    sagitta = 1.0 - np.linalg.norm(SHAPES["sphere"].corners.mean(axis=1), axis=1).min()
    assert radius.max() < 1.0 + 1e-12
    assert radius.min() > 1.0 - 1.5 * sagitta


def test_quads_face_outward(layouts):
    for name in ("sphere", "cube"):
        layout = layouts[name]
        p = layout.vertices[layout.quads] - SHAPES[name].vertices.mean(axis=0)
        normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
        assert (np.einsum("ij,ij->i", normal, p.mean(axis=1)) > 0).all()


@pytest.mark.parametrize("target", [60, 240, 960])
def test_target_is_reached(target):
    assert len(quad_layout(sphere(32), target=target)) == pytest.approx(target, rel=0.2)


def test_noise_makes_no_feature():
    layout = quad_layout(jittered(sphere(40), 1e-3), target=150)
    assert not layout.sharp.any()
    assert layout.report.folded == 0


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_rigid_motion_and_scale_keep_the_quality(scale):
    shape, _ = moved(wedge(), scale)
    report, other = quad_layout(wedge(), target=200).report, quad_layout(shape, target=200).report
    assert other.folded == report.folded == 0
    assert other.min_scaled_jacobian > 0.05
    assert other.median_scaled_jacobian == pytest.approx(report.median_scaled_jacobian, abs=0.1)
    assert other.feature_coverage == pytest.approx(1.0, abs=1e-9)


def test_tags_are_those_below():
    shape = cube(4)
    face = np.argmax(np.abs(shape.normals), axis=1) * 2 + (shape.normals.sum(axis=1) > 0)
    tagged = Triangulation(shape.vertices, shape.triangles, tags=face, tag_names=tuple("abcdef"))
    layout = quad_layout(tagged, target=100)
    p = layout.vertices[layout.quads]
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    np.testing.assert_array_equal(layout.tags, np.argmax(np.abs(normal), axis=1) * 2 + (normal.sum(axis=1) > 0))


def test_bad_arguments_are_refused():
    with pytest.raises(ParameterError, match="nurbs"):
        quad_layout(cube(), method="nurbs")
    with pytest.raises(ParameterError, match="target"):
        quad_layout(cube(), target=0)
    with pytest.raises(ParameterError, match="angle"):
        quad_layout(cube(), angle=200.0)
    with pytest.raises(GeometryError, match="triangle"):
        quad_layout(Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))


@pytest.mark.skipif(importlib.util.find_spec("pyQuadriFlow") is None, reason="pyquadriflow is not installed")
def test_quadriflow_is_validated(monkeypatch):
    layout = quad_layout(torus(), method="quadriflow", target=300)
    assert layout.report.euler == (0, 0)
    assert layout.report.folded == 0
    assert len(layout) == pytest.approx(300, rel=0.3)
    monkeypatch.setattr(quadriflow, "_CHILD", "import os; os.abort()")
    with pytest.raises(EngineError, match="code"):
        quad_layout(torus(), method="quadriflow", target=300)
    monkeypatch.setattr(quadriflow, "_CHILD", "import time; time.sleep(60)")
    monkeypatch.setattr(quadriflow, "TIME_LIMIT", 0.5)
    with pytest.raises(EngineError, match="did not finish"):
        quad_layout(torus(), method="quadriflow", target=300)
    child = "import sys, numpy as np; np.savez(sys.argv[2], vertices=np.eye(3), quads=[[0, 1, 2, 2]])"
    monkeypatch.setattr(quadriflow, "TIME_LIMIT", 60.0)
    monkeypatch.setattr(quadriflow, "_CHILD", child)
    with pytest.raises(EngineError, match="not quads"):
        quad_layout(torus(), method="quadriflow", target=300)


def test_an_open_blade_keeps_its_openings(data):
    from patchwright.models.io import read

    layout = quad_layout(read(data("cgal_blade.off")).triangulation, target=600)
    assert layout.report.euler == (0, 0)
    assert layout.report.folded == 0
    ends = layout.edges[layout.boundary]
    assert (np.bincount(ends.reshape(-1))[np.unique(ends)] == 2).all()
