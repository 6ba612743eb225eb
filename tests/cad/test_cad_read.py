"""Real STEP and IGES files: faces, names, true surfaces, loops, conforming tessellations, and what is refused."""

from __future__ import annotations

import csv
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from patchwright.models import CorruptFile, RepairWarning, UnsupportedEntity
from patchwright.models.cad import measure_seams, surface_difference
from patchwright.models.io import read, write

Find = Callable[[str], Path]
FILES = (
    "fuselage_patches.stp",
    "nacelle.stp",
    "featuretype.step",
    "turbine_part.stp",
    "k1_loose_shells.stp",
    "t4mec.stp",
    "bearing.iges",
    "oneram6.igs",
)


def listed_faces(folder: Path, name: str) -> int:
    with (folder / "index.csv").open() as table:
        row = next(r for r in csv.DictReader(table) if r["file"] == name)
    return int(row["size"].split()[0])


@pytest.mark.parametrize("name", FILES)
def test_every_face_has_surface_loops_and_tessellation(data: Find, name: str) -> None:
    path = data(name)
    model = read(path)
    assert len(model.parts) == listed_faces(path.parent, name)
    assert model.is_cad
    assert model.unit == "mm"
    assert model.topology is not None
    largest = float(model.native.edge_tolerances.max())
    reach = 0.0
    for part, loops in zip(model.parts, model.topology.loops, strict=True):
        triangles, surface = part.triangulation, part.surface
        assert len(triangles) > 0
        assert triangles.uv is not None
        assert surface is not None
        assert part.trims is not None
        on = surface(triangles.uv[..., 0], triangles.uv[..., 1])
        reach = max(reach, float(np.abs(on - triangles.corners).max()))
        for chain in part.trims:  # head to tail in (u, v)
            ends = np.array([[c(c.domain[0]), c(c.domain[1])] for c in chain])
            span = np.ptp(np.concatenate([c.control_points for c in chain]), axis=0).max()
            assert np.abs(ends[:, 1] - np.roll(ends[:, 0], -1, axis=0)).max() <= 0.02 * span
        for loop in loops:
            for use in loop:
                assert use.pcurve.domain == model.topology.curves[use.edge].domain
    # a node lies off its surface by the file's own edge tolerances at most, pcurves beyond the border apart
    assert reach <= 20.0 * largest + 1e-9 * model.diagonal


def test_featuretype_is_closed_outward_and_exact(data: Find) -> None:
    model = read(data("featuretype.step"))
    merged = model.triangulation
    vertices, index = np.unique(merged.vertices, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[merged.triangles]
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    code = edges @ np.array([len(vertices), 1])
    assert np.array_equal(np.sort(code), np.sort(edges[:, ::-1] @ np.array([len(vertices), 1])))
    assert merged.volume > 0.0
    kinds = {type(p.surface).__name__ for p in model.parts}
    assert kinds == {"Plane", "Cylinder", "NurbsSurface"}
    assert {p.body for p in model.parts} == {"Cut-Extrude6"}
    for part in model.parts:  # winding follows the face's orientation, not the surface's own normal
        corners, uv = part.triangulation.corners, part.triangulation.uv
        assert uv is not None
        assert part.surface is not None
        middle = uv.mean(axis=1)
        normal = np.cross(part.surface(*middle.T, (1, 0)), part.surface(*middle.T, (0, 1)))
        assert model.topology is not None
        sign = -1.0 if model.topology.flipped[model.parts.index(part)] else 1.0
        facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("ij,ij->i", normal, facet) * sign > 0.0).mean() > 0.99


@pytest.mark.parametrize("suffix", [".step", ".igs"])
@pytest.mark.parametrize("name", [f for f in FILES if f not in ("oneram6.igs", "bearing.iges")])
def test_kept_faces_are_written_back_unchanged(data: Find, tmp_path: Path, name: str, suffix: str) -> None:
    model = read(data(name))
    write(tmp_path / f"kept{suffix}", model)
    back = read(tmp_path / f"kept{suffix}")
    assert back.names == model.names
    change = [surface_difference(p.surface, q.surface) for p, q in zip(model.parts, back.parts, strict=True)]
    assert max(change) <= 1e-15 * model.diagonal  # numbers are written with all their digits
    came, went = (max((s.gap for s in measure_seams(m)), default=0.0) for m in (model, back))
    assert went <= came + 1e-7


def test_deflection_is_held_and_smaller_refines(data: Find) -> None:
    path = data("nacelle.stp")
    counts = []
    for deflection in (4.0, 1.0):
        model = read_with(path, deflection)
        off = []
        for part in model.parts:
            middle = part.triangulation.uv.mean(axis=1)
            apart = part.surface(*middle.T) - part.triangulation.corners.mean(axis=1)
            off.append(np.abs((apart * part.triangulation.normals).sum(axis=1)))
        assert np.percentile(np.concatenate(off), 99) <= deflection  # the kernel's mesher misses it in places
        counts.append(len(model.triangulation))
    assert counts[1] > 2 * counts[0]


def read_with(path: Path, deflection: float):  # type: ignore[no-untyped-def]
    from patchwright.models.io.step import read as read_step

    return read_step(path, deflection=deflection, angle=1.0)


def test_assembly_travels_between_processes(data: Find, tmp_path: Path) -> None:
    model = pickle.loads(pickle.dumps(read(data("nacelle.stp"))))
    write(tmp_path / "again.step", model)
    assert len(read(tmp_path / "again.step").parts) == len(model.parts)


def test_unit_of_a_file_that_has_its_own_is_told(data: Find) -> None:
    with pytest.warns(RepairWarning, match="own unit"):
        assert read(data("nacelle.stp"), unit="m").unit == "mm"


STEP = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n{}\nENDSEC;\nEND-ISO-10303-21;\n"
BAD = {
    "empty.stp": (b"", CorruptFile),
    "zeros.stp": (bytes(4096), CorruptFile),
    "text.step": (b"hello\n" * 100, CorruptFile),
    "rubbish.step": (b"ISO-10303-21;\nrubbish\nEND-ISO-10303-21;\n", CorruptFile),
    "cut.step": (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=PLANE('',#2);", CorruptFile),
    "point.step": (STEP.format("#1=CARTESIAN_POINT('',(0.,0.,0.));").encode(), UnsupportedEntity),
    "nothing.step": (STEP.format("").encode(), (CorruptFile, UnsupportedEntity)),
    "zeros.igs": (bytes(4096), CorruptFile),
    "text.igs": (b"hello\n" * 100, CorruptFile),
    "cut.igs": (b"x".ljust(72) + b"S      1\n", CorruptFile),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_give_one_sentence(tmp_path: Path, name: str) -> None:
    content, kind = BAD[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(kind) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def test_reading_prints_nothing_and_keeps_the_kernel_out(data: Find) -> None:
    code = (
        "import sys; from patchwright.models.io import read; read(sys.argv[1]);"
        "assert not [m for m in sys.modules if m.startswith('OCP')]"
    )
    path = data("b1_invalid_faces.stp")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code, str(path)], capture_output=True, text=True, timeout=100, check=True
    )
    assert done.stdout == ""
    assert re.sub(r"\s", "", done.stderr) == ""
