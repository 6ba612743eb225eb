"""CAD checks: measured seams, unsewn faces, openings of shells, parametrisation."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models import Assembly, NurbsSurface, Part, Plane, Topology, Triangulation
from patchwright.models.io import read
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import EdgeUse
from patchwright.repair import diagnose
from patchwright.repair.checks.cad_rims import free_edge_reach
from patchwright.reparam import parametrisation_defect


def quadratic(power: int) -> NurbsSurface:
    """x = u^power, y = v."""
    knots = np.repeat([0.0, 1.0], power + 1)
    points = np.zeros((power + 1, 2, 3))
    points[-1, :, 0] = 1.0
    points[:, 1, 1] = 1.0
    return NurbsSurface((power, 1), (knots, np.repeat([0.0, 1.0], 2)), points)


def test_defect_of_even_parameter_lines_is_zero() -> None:
    assert parametrisation_defect(Plane((0, 0, 0), (0, 0, 1), u=(0, 2), v=(0, 3))) == pytest.approx(0.0, abs=1e-12)
    assert parametrisation_defect(quadratic(1)) == pytest.approx(0.0, abs=1e-12)


def test_defect_of_a_squared_parameter_is_known() -> None:
    """Chords of u² at 33 equal steps are (2k + 1) / 33²: the last is 65/33 of its share."""
    assert parametrisation_defect(quadratic(2)) == pytest.approx(32 / 33, rel=1e-12)
    assert parametrisation_defect(quadratic(3)) == pytest.approx((33**3 - 32**3) / 33**2 - 1, rel=1e-12)


def line(a: tuple[float, float, float], b: tuple[float, float, float]) -> NurbsCurve:
    return NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), np.array([a, b], dtype=float))


@pytest.mark.parametrize("gap", [0.0, 1e-6, 1e-3, 0.1])
def test_reach_of_free_edges_is_their_distance(gap: float) -> None:
    """An arc and the same arc raised by `gap`, met by two halves of it as well."""
    w = np.sqrt(0.5)
    knots = np.array([0.0, 0, 0, 1, 1, 1])
    points = np.array([[1.0, 0, 0], [1, 1, 0], [0, 1, 0]])
    arc = NurbsCurve(2, knots, points, np.array([1, w, 1]))
    other = NurbsCurve(2, knots, points + np.array([0, 0, gap]), np.array([1, w, 1])).split(0.3)
    topology = Topology(np.zeros((1, 3)), (arc, *other), np.zeros((3, 2), dtype=int), ())
    reach = free_edge_reach(topology, np.arange(3))
    assert reach == pytest.approx([gap] * 3, abs=1e-12)


def two_squares(gap: float, shared: bool) -> Assembly:
    """Two unit squares side by side in a plane, `gap` apart, with one shared edge or none."""
    uv = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    offsets = [0.0, 1.0 + gap]
    vertices, curves, ends, loops, parts = [], [], [], [], []
    for k, x in enumerate(offsets):
        surface = Plane((x, 0, 0), (0, 0, 1), xdir=(1, 0, 0), u=(0, 1), v=(0, 1))
        corners = [(x + u, v, 0.0) for u, v in uv]
        first = len(vertices)
        vertices += corners
        uses = []
        for i in range(4):
            j = (i + 1) % 4
            flat = NurbsCurve(1, np.array([0.0, 0, 1, 1]), np.array([uv[i], uv[j]]))
            if shared and k == 1 and i == 3:  # the left side of the second is the right side of the first
                flat = NurbsCurve(1, np.array([0.0, 0, 1, 1]), np.array([uv[0], uv[3]]))
                uses.append(EdgeUse(1, True, flat))
                continue
            uses.append(EdgeUse(len(curves), False, flat))
            curves.append(line(corners[i], corners[j]))
            ends.append((first + i, first + j))
        loops.append((tuple(uses),))
        mesh = Triangulation(
            np.array(corners), [[0, 1, 2], [0, 2, 3]], uv=np.array([[uv[0], uv[1], uv[2]], [uv[0], uv[2], uv[3]]])
        )
        parts.append(Part(f"square{k + 1}", mesh, surface))
    return Assembly(
        tuple(parts), "m", topology=Topology(np.array(vertices), tuple(curves), np.array(ends), tuple(loops))
    )


@pytest.mark.parametrize("gap", [1e-5, 1e-2])
def test_a_shared_edge_does_not_hide_the_gap_between_its_surfaces(gap: float) -> None:
    """The topology says sewn; the surfaces are apart."""
    (seam,) = diagnose(two_squares(gap, shared=True)).of("seam-gap")
    assert seam.severity == ("error" if gap > 1e-3 else "warning")
    assert seam.parts == ("square1", "square2")
    assert diagnose(two_squares(gap, shared=True)).summary["largest_seam_gap"] == pytest.approx(gap)
    assert not diagnose(two_squares(0.0, shared=True)).of("seam-gap")


def test_unsewn_faces_and_a_gap_between_faces() -> None:
    near = diagnose(two_squares(1e-9, shared=False))
    (defect,) = near.of("open-edge")
    assert defect.count == 2
    assert near.summary["open_edges"] == 8
    assert near.summary["open_edges_after_sewing"] == 6
    assert near.summary["rims"] == 1
    assert not near.of("gap")


def test_clean_control_is_clean(data) -> None:
    found = diagnose(read(data("featuretype.step")))
    assert found.clean
    assert found.summary["watertight"]
    assert found.summary["invalid_faces"] == 0


def test_openings_of_a_nacelle(data) -> None:
    found = diagnose(read(data("nacelle.stp")))
    assert [d.kind for d in found.defects if d.severity != "info"] == ["opening", "opening"]
    assert sorted(d.where[0] for d in found.of("opening")) == pytest.approx([564.08, 2564.0], abs=0.1)


@pytest.mark.parametrize(
    ("name", "free", "left"), [("fuselage_patches.stp", 28, 0), ("t4mec.stp", 102, 72), ("turbine_part.stp", 14, 14)]
)
def test_free_edges_of_real_files(data, name: str, free: int, left: int) -> None:
    """The kernel's own sewing at 1e-6 of the diagonal leaves 0, 73 and 14 of them."""
    summary = diagnose(read(data(name))).summary
    assert summary["open_edges"] == free
    assert summary["free_edges_by_tolerance"][3]["free_edges"] == left


@pytest.mark.parametrize("lift", [1e-3, 1e-2])
def test_a_lid_lifted_off_its_walls_is_a_gap_and_not_an_opening(tmp_path, lift: float) -> None:
    from oracles_cad_damage import SIZES, centre, faces_of, rounded_box, shifted, shrunk, written

    height = lift * float(np.linalg.norm(SIZES))
    faces = faces_of(rounded_box())
    top = max(range(len(faces)), key=lambda k: centre(faces[k]).Z())
    lid = shifted(shrunk(faces[top], 0.999), (0, 0, height))
    found = diagnose(read(written(tmp_path / "lid.step", [*faces[:top], lid, *faces[top + 1 :]], {top})))
    (gap,) = found.of("gap")
    assert gap.size == pytest.approx(height, rel=0.2)
    assert not found.of("opening")


def test_a_loop_cut_out_of_an_open_sheet_is_an_opening_and_in_a_closed_body_a_missing_face(tmp_path) -> None:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepGProp import BRepGProp
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.GProp import GProp_GProps
    from oracles_cad_damage import faces_of, written

    drill = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(5, 5, 5), gp_Dir(0, 0, 1)), 0.4, 10.0).Shape()
    block = faces_of(BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(10.0, 10.0, 10.0).Shape(), drill).Shape())

    def area(face) -> float:
        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, properties)
        return properties.Mass()

    (drilled,) = [face for face in block if 99.0 < area(face) < 99.9]
    sheet = diagnose(read(written(tmp_path / "sheet.step", [drilled], {0})))
    assert sorted(d.kind for d in sheet.defects if d.severity != "info") == ["opening", "opening"]
    # the block without the wall and the bottom of its hole
    shell = [face for face in block if area(face) > 50.0]
    assert len(shell) == len(block) - 2 == 6
    body = diagnose(read(written(tmp_path / "body.step", shell, set())))
    assert [d.kind for d in body.defects if d.severity == "error"] == ["gap"]
