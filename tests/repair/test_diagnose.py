"""Diagnosis: every injected defect is found with its place and size, and nothing is found in clean models."""

from __future__ import annotations

import json

import numpy as np
import pytest
from oracles_shells import blade, box, hemisphere, moved, soup, sphere, tube, unmerged, without

from patchwright.models import Assembly, ParameterError, Part, Triangulation
from patchwright.models.io import read
from patchwright.repair import diagnose
from patchwright.repair.checks.registry import checks
from patchwright.repair.diagnosis import KINDS


def worse_than_info(t: Triangulation | Assembly) -> list[str]:
    return sorted({d.kind for d in diagnose(t).defects if d.severity != "info"})


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_closed_bodies_are_clean(scale: float) -> None:
    for k, t in enumerate([sphere(32), box(size=2.0)]):
        found = diagnose(moved(t, scale, k))
        assert found.clean
        assert found.summary["watertight"]
        assert found.summary["volume"] == pytest.approx(scale**3 * t.volume, rel=1e-9)
        assert found.summary["components"] == 1


def test_two_separate_bodies_are_clean_but_mentioned() -> None:
    far = sphere(16)
    found = diagnose(soup(sphere(16), Triangulation(far.vertices + np.array([5.0, 0, 0]), far.triangles)))
    assert found.clean
    assert found.counts == {"component": 2}


def test_an_open_tube_is_not_clean_because_of_its_openings_only() -> None:
    found = diagnose(tube(3.0))
    assert not found.clean
    assert [(d.kind, d.severity) for d in found.defects if d.severity != "info"] == [("opening", "warning")] * 2
    assert sorted(d.where[2] for d in found.of("opening")) == pytest.approx([0.0, 3.0])
    assert found.summary["volume"] is None


@pytest.mark.parametrize("percent", [1, 5, 10])
def test_gap_with_its_width_and_place(percent: float) -> None:
    width = 2.0 * percent / 100
    found = diagnose(soup(hemisphere(True, width / 2), hemisphere(False, -width / 2)))
    (gap,) = [d for d in found.defects if d.severity == "error"]
    assert gap.kind == "gap"
    assert gap.size == pytest.approx(width, rel=1e-6)
    assert gap.where == pytest.approx([0, 0, 0], abs=1e-9)
    assert gap.count == 96
    assert gap.box[:, 2] == pytest.approx([-width / 2, width / 2])


def test_overlap_of_open_shells() -> None:
    assert "overlap" in worse_than_info(soup(hemisphere(True, -0.05), hemisphere(False, 0.05)))


def test_crossing_closed_bodies_are_one_overlap_per_pair() -> None:
    a = sphere(24)
    b = Triangulation(a.vertices + np.array([1.0, 0.03, 0.02]), a.triangles)
    c = Triangulation(a.vertices + np.array([1.1, 1.03, 0.52]), a.triangles)
    found = diagnose(soup(a, b, c))
    assert len(found.of("overlap")) == 3
    assert not found.of("self-intersection")
    # the first two meet in a circle in the plane half-way between their centres
    first = max(found.of("overlap"), key=lambda d: -abs(d.where[0] - 0.5))
    assert first.where == pytest.approx([0.5, 0.015, 0.01], abs=0.1)


def test_differently_meshed_faces_make_t_junctions() -> None:
    found = diagnose(box((8, 8, 5, 5, 3, 3)))
    kinds = {d.kind for d in found.defects if d.severity == "error"}
    assert kinds == {"t-junction"}


def test_missing_face_missing_triangles() -> None:
    assert worse_than_info(box(skip=(1,))) == ["opening"]
    found = diagnose(without(sphere(32), np.array([40, 400])))
    assert [d.kind for d in found.defects if d.severity == "error"] == ["gap", "gap"]
    assert found.summary["holes"] == 2


def test_flipped_and_doubled() -> None:
    t = sphere(24)
    rng = np.random.default_rng(1)
    flip, double = rng.random(len(t)) < 0.4, rng.random(len(t)) < 0.1
    triangles = np.where(flip[:, None], t.triangles[:, ::-1], t.triangles)
    found = diagnose(Triangulation(t.vertices, np.concatenate([triangles, triangles[double]])))
    assert found.summary["duplicate_faces"] == np.count_nonzero(double)
    assert found.summary["flipped_faces"] == np.count_nonzero(flip)
    assert worse_than_info(found_of := Triangulation(t.vertices, triangles)) == ["flipped"]
    assert sum(d.count for d in diagnose(found_of).of("flipped")) == np.count_nonzero(flip)


def test_a_cavity_is_no_defect_but_a_body_turned_inside_out_beside_another_is() -> None:
    outer = sphere(24)
    inward = Triangulation(0.5 * outer.vertices, outer.triangles[:, ::-1])
    hollow = diagnose(soup(outer, inward))
    assert hollow.clean
    assert hollow.summary["volume"] == pytest.approx(outer.volume * (1 - 0.125))
    beside = diagnose(soup(outer, Triangulation(inward.vertices + np.array([3.0, 0, 0]), inward.triangles)))
    assert [d.severity for d in beside.of("flipped")] == ["error"]


def test_inside_out_body() -> None:
    t = sphere(16)
    found = diagnose(Triangulation(t.vertices, t.triangles[:, ::-1]))
    (defect,) = found.of("flipped")
    assert defect.severity == "error"
    assert defect.count == len(t)
    assert found.summary["inconsistent_edges"] == 0


def test_unmerged_soup_is_one_open_edge_defect() -> None:
    t = sphere(32)
    found = diagnose(unmerged(t))
    assert found.clean, "equal coordinates are one point"
    found = diagnose(unmerged(t, jitter=1e-7))
    (defect,) = found.of("open-edge")
    assert "not merged" in defect.message
    assert [d.kind for d in found.defects if d.severity == "error"] == ["open-edge"]
    assert found.summary["open_edges"] == 3 * len(t)


def test_jittered_soup_with_a_gap_and_a_hole() -> None:
    """Corners jittered by 1e-4 of the length: the gap and the hole are found behind the noise."""
    body = soup(without(hemisphere(True, 0.1, 96), np.array([500])), hemisphere(False, -0.1, 96))
    found = diagnose(unmerged(body, jitter=2e-5, seed=3))
    errors = [d for d in found.defects if d.severity == "error"]
    assert len([d for d in errors if d.kind == "open-edge"]) == 1
    gaps = [d for d in errors if d.kind == "gap"]
    assert max(d.size for d in gaps if d.count > 50) == pytest.approx(0.2, rel=0.02)
    assert len(gaps) == 2


def test_free_edges_as_a_function_of_tolerance() -> None:
    """Two halves 1e-5 of the diagonal apart: all edges are free below and none above."""
    t = soup(hemisphere(True, 0.0), hemisphere(False, -1e-5 * np.sqrt(12.0)))
    curve = {row["share"]: row["free_edges"] for row in diagnose(t).summary["free_edges_by_tolerance"]}
    assert curve[0.0] == curve[1e-6] == 96
    assert curve[1e-4] == curve[1e-3] == 0


def test_non_manifold_edge() -> None:
    t = box((1,) * 6)
    fin = np.array([[*t.triangles[0][:2], len(t.vertices)]])
    vertices = np.concatenate([t.vertices, [[0.5, 0.5, -2.0]]])
    found = diagnose(Triangulation(vertices, np.concatenate([t.triangles, fin])))
    assert found.summary["non_manifold_edges"] == 1
    (defect,) = found.of("non-manifold-edge")
    assert defect.where == pytest.approx(t.vertices[t.triangles[0][:2]].mean(axis=0))


def test_far_field_and_symmetry_plane() -> None:
    small = sphere(16)
    found = diagnose(soup(small, box((2,) * 6, size=1.0), moved(sphere(16), 1.0, 0)))
    assert not found.of("far-field")
    far = Triangulation(60.0 * sphere(16).vertices, sphere(16).triangles)
    (defect,) = diagnose(soup(small, far)).of("far-field")
    assert defect.severity == "info"
    half = without(blade(0.12), np.zeros(0, dtype=int))
    plane = diagnose(half).summary["symmetry_plane"]
    assert plane is not None
    assert (plane["axis"], plane["value"]) == ("z", 0.0)


def test_unit_suspicion() -> None:
    t = sphere(12)
    assert worse_than_info(Assembly((Part("a", t),), unit="m")) == []
    assert worse_than_info(Assembly((Part("a", Triangulation(1e5 * t.vertices, t.triangles)),), unit="m")) == ["unit"]
    assert worse_than_info(Assembly((Part("a", Triangulation(1e5 * t.vertices, t.triangles)),))) == []


def test_parts_are_named() -> None:
    halves = Assembly((Part("nose", hemisphere(True, 0.1)), Part("tail", hemisphere(False, -0.1))))
    (gap,) = diagnose(halves).of("gap")
    assert gap.parts == ("nose", "tail")


def test_json_is_plain_and_ids_are_unique() -> None:
    found = diagnose(unmerged(tube(2.0), jitter=1e-7))
    text = json.dumps(found.to_json(), allow_nan=False)
    back = json.loads(text)
    assert back["clean"] is False
    ids = [d["id"] for d in back["defects"]]
    assert len(set(ids)) == len(ids) > 0


def test_registered_kinds_are_known_and_all_looked_for() -> None:
    promised = {kind for check in checks() for kind in check.kinds}
    assert promised == set(KINDS)


def test_nothing_to_diagnose() -> None:
    with pytest.raises(ParameterError, match="nothing to diagnose"):
        diagnose(Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))


def test_clean_controls(data) -> None:
    found = diagnose(read(data("dtc_hull.stl.gz")))
    assert found.clean
    assert found.summary["watertight"]


@pytest.mark.parametrize(
    ("name", "open_edges", "non_manifold", "duplicates", "collapsed", "components"),
    [
        ("c172_wing.stl", 334, 0, 0, 0, 3),
        ("boeing.off", 0, 0, 0, 0, 1),
        ("wigley_hull.stl.gz", 392, 4, 4, 0, 1),
        ("cgal_blade.off", 240, 0, 0, 0, 1),
        ("mech_holes.off", 304, 0, 0, 0, 1),
        ("featuretype.stl", 576, 0, 0, 0, 1),
        ("motor.stl", 10, 162, 24, 4, 13),
        ("multiregion_heater.stl.gz", 176, 40, 0, 0, 1),
    ],
)
def test_counts_of_real_files(
    data, name: str, open_edges: int, non_manifold: int, duplicates: int, collapsed: int, components: int
) -> None:
    """Counts measured with other tools on the same files."""
    summary = diagnose(read(data(name))).summary
    assert summary["open_edges"] == open_edges
    assert summary["non_manifold_edges"] == non_manifold
    assert summary["duplicate_faces"] == duplicates
    assert summary["collapsed_faces"] == collapsed
    assert summary["components"] == components
