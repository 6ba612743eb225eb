"""Sewing keeps every face and surface; free edges as a function of tolerance tell round-off from gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from oracles_cad import EMPTY, cube_sphere

from patchwright.models import Assembly, ParameterError, Part
from patchwright.models.cad import brep_status, free_edge_curve, measure_seams, sew
from patchwright.models.io import read
from patchwright.models.nurbs_surface import NurbsSurface

Find = Callable[[str], Path]


def loose_ball(gap: float) -> Assembly:
    """The six patches without topology, each moved outward so that neighbours are `gap` apart."""
    parts = []
    for part in cube_sphere().parts:
        surface = part.surface
        assert isinstance(surface, NurbsSurface)
        points = surface.control_points
        middle = points[points.shape[0] // 2, points.shape[1] // 2]
        shift = middle / np.linalg.norm(middle) * gap / np.sqrt(2.0)
        parts.append(replace(part, surface=replace_points(surface, points + shift)))
    return Assembly(tuple(parts), unit="mm")


def replace_points(surface: NurbsSurface, points: np.ndarray) -> NurbsSurface:  # type: ignore[type-arg]
    return NurbsSurface(surface.degree, surface.knots, points, surface.weights)


def test_touching_faces_become_a_solid() -> None:
    result = sew(loose_ball(0.0), 1e-6)
    assert result.dropped == ()
    assert result.surface_change.max() == 0.0
    assert (result.free_edges, result.multiple_edges) == (0, 0)
    seams = measure_seams(result.assembly)
    assert len(seams) == 12
    assert max(s.gap for s in seams) <= 1e-7


def test_a_hidden_gap_is_measured() -> None:
    gap = 0.05
    result = sew(loose_ball(gap), 4 * gap)
    assert result.free_edges == 0
    gaps = [s.gap for s in measure_seams(result.assembly)]
    assert min(gaps) == pytest.approx(gap, rel=0.02)
    assert max(gaps) == pytest.approx(gap, rel=0.02)


def test_free_edges_vanish_only_above_the_gap() -> None:
    gap = 1e-3
    curve = free_edge_curve(loose_ball(gap), np.array([0.1, 0.5, 2.0, 10.0]) * gap)
    assert curve.free.tolist() == [24, 24, 0, 0]


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("fuselage_patches.stp", [0, 0, 0, 0, 0]),
        ("k1_loose_shells.stp", [248, 246, 246, 28, 0]),
        ("t4mec.stp", [90, 73, 55, 51, 51]),
        ("nacelle.stp", [4, 4, 4, 4, 4]),
    ],
)
def test_real_files_show_their_known_curve(data: Find, name: str, counts: list[int]) -> None:
    """The counts were measured on these files with the CAD kernel by another program (index.csv of the data)."""
    model = read(data(name))
    shares = np.array([1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
    assert free_edge_curve(model, shares * model.diagonal).free.tolist() == counts


def test_sewn_real_faces_are_unchanged(data: Find) -> None:
    model = read(data("fuselage_patches.stp"))
    result = sew(model, 1e-6 * model.diagonal)
    assert result.dropped == ()
    assert result.surface_change.max() <= 1e-12
    assert result.assembly.names == model.names
    assert max(s.gap for s in measure_seams(result.assembly)) <= 1e-9 * model.diagonal


def test_invalid_faces_are_found_and_time_is_kept(data: Find) -> None:
    model = read(data("k1_loose_shells.stp"))
    assert brep_status(model).invalid == ()
    rushed = brep_status(model, time_limit=0.0)
    assert rushed.invalid == ()
    assert "not checked within 0 s" in rushed.stopped


def test_meshes_and_bad_tolerances_are_refused() -> None:
    with pytest.raises(ParameterError, match="surfaces"):
        sew(Assembly((Part("t", EMPTY),)), 1e-3)
    with pytest.raises(ParameterError, match="positive"):
        sew(cube_sphere(), 0.0)
    with pytest.raises(ParameterError, match="topology"):
        measure_seams(loose_ball(0.0))
