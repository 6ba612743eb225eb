"""The data's own resolution: second order on sphere and cylinder, zero on planes, blind to creases."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.models.samples import cube
from patchwright.repair.layout.faceting import faceting


def cylinder(sides, height=1.0, scale=1.0):
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, height)])
    a = np.arange(sides)
    b = (a + 1) % sides
    triangles = np.concatenate([np.column_stack([a, b, b + sides]), np.column_stack([a, b + sides, a + sides])])
    return Triangulation(scale * vertices, triangles)


@pytest.mark.parametrize("sides", [24, 48, 96, 192])
def test_a_cylinder_gives_its_sagitta(sides):
    sagitta = 1.0 - np.cos(np.pi / sides)
    # the rise over the edge middle is exact, the centroid carries two of three edges: 8/9 of it
    assert faceting(cylinder(sides), 30.0) == pytest.approx(sagitta, rel=0.02)


def test_the_height_falls_by_four_when_the_facets_halve():
    values = [faceting(cylinder(n), 30.0) for n in (32, 64, 128)]
    assert values[0] / values[1] == pytest.approx(4.0, rel=0.02)
    assert values[1] / values[2] == pytest.approx(4.0, rel=0.02)


def test_scale_scales():
    assert faceting(cylinder(40, scale=1e3), 30.0) == pytest.approx(1e3 * faceting(cylinder(40), 30.0))


def test_a_cube_has_creases_and_no_height():
    assert faceting(cube().assembly.triangulation, 30.0) == 0.0


def test_creases_are_only_creases_beyond_the_angle():
    assert faceting(cylinder(8), 30.0) == 0.0  # 45 degrees an edge
    assert faceting(cylinder(8), 60.0) > 0.05


def test_nothing_has_no_height():
    assert faceting(Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=int)), 30.0) == 0.0


@pytest.mark.parametrize("sides", [24, 48, 96])
def test_the_apex_of_a_cone_is_no_height(sides):
    angle, height = 2 * np.pi * np.arange(sides) / sides, 3.0
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    a = np.arange(sides)
    cone = Triangulation(
        np.concatenate([ring, [[0.0, 0.0, height]]]), np.column_stack([a, (a + 1) % sides, 0 * a + sides])
    )
    # the rim's sagitta, seen along the cone's normal
    sagitta = (1.0 - np.cos(np.pi / sides)) * height / np.hypot(1.0, height)
    assert faceting(cone, 30.0) == pytest.approx(sagitta, rel=0.05)
