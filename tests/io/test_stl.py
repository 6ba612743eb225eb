"""STL: round trips are exact, names survive, the two forms are told apart by content, faults are told with numbers."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from oracles_mesh_io import ascii_stl, binary_stl, same_surface, tetrahedron

from patchwright.models import Assembly, CorruptFile, Part, RepairWarning, Triangulation, UnsupportedFormat
from patchwright.models.io import read, write


def two_bodies() -> Assembly:
    return Assembly((Part("wing", tetrahedron()), Part("tail fin", tetrahedron(math.pi, 0.1))))


@pytest.mark.parametrize("suffix", [".stl", ".stl.gz", ".STL"])
@pytest.mark.parametrize("ascii_form", [None, True])
def test_named_solids_come_back_bit_for_bit(tmp_path: Path, suffix: str, ascii_form: bool | None) -> None:
    write(tmp_path / f"a{suffix}", two_bodies(), ascii=ascii_form)
    back = read(tmp_path / f"a{suffix}", unit="mm")
    assert back.names == ("wing", "tail fin")
    assert back.unit == "mm"
    for part, original in zip(back.parts, two_bodies().parts, strict=True):
        assert len(part.triangulation.vertices) == 4
        assert same_surface(part.triangulation, original.triangulation)
        assert part.triangulation.volume > 0.0


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1.0, 1e3, 1e30])
def test_a_float64_solid_is_written_as_text_by_default_and_loses_nothing(tmp_path: Path, scale: float) -> None:
    shape = tetrahedron(scale / 3.0, shift=scale / 7.0)
    write(tmp_path / "a.stl", shape)
    assert (tmp_path / "a.stl").read_bytes().startswith(b"solid a\n")
    assert same_surface(read(tmp_path / "a.stl").triangulation, shape)


def test_a_single_float32_solid_is_written_in_binary_by_default_with_its_name(tmp_path: Path) -> None:
    shape = Assembly((Part("wing", tetrahedron(0.25, 0.5)),))
    write(tmp_path / "a.stl", shape)
    assert (tmp_path / "a.stl").stat().st_size == 84 + 50 * 4
    back = read(tmp_path / "a.stl")
    assert back.names == ("wing",)
    assert same_surface(back.triangulation, shape.triangulation)


def test_binary_rounds_to_float32_and_says_what_else_is_lost(tmp_path: Path) -> None:
    with pytest.warns(RepairWarning, match="names of its 2 solids"):
        write(tmp_path / "a.stl", two_bodies(), ascii=False)
    back = read(tmp_path / "a.stl")
    assert back.names == ("a",)
    assert np.array_equal(back.triangulation.corners, two_bodies().triangulation.corners.astype(np.float32))
    close = Triangulation([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1 + 1e-12, 0, 0]], [[0, 1, 2], [0, 3, 2]])
    with pytest.warns(RepairWarning, match="difference between 1 vert"):
        write(tmp_path / "b.stl", close, ascii=False)
    with pytest.raises(UnsupportedFormat, match="float32"):
        write(tmp_path / "c.stl", tetrahedron(1e39), ascii=False)
    assert not (tmp_path / "c.stl").exists()


def test_the_written_normals_are_the_triangles_own(tmp_path: Path) -> None:
    shape = tetrahedron(2.0, 0.1)
    write(tmp_path / "a.stl", shape, ascii=True)
    lines = [line.split()[2:] for line in (tmp_path / "a.stl").read_text().splitlines() if "normal" in line]
    assert np.abs(np.array(lines, dtype=float) - shape.normals).max() <= 0.51e-7


def test_a_triangulation_gives_one_solid_a_tag_and_shared_vertices_stay_shared(tmp_path: Path) -> None:
    shape = tetrahedron(1.0 / 3.0)
    tagged = Triangulation(
        shape.vertices, shape.triangles, tags=[7, 0, 7, 0], tag_names=("low",) + ("x",) * 6 + ("high",)
    )
    write(tmp_path / "a.stl", tagged)
    back = read(tmp_path / "a.stl")
    assert back.names == ("low", "high")
    assert np.array_equal(back.parts[0].triangulation.corners, shape.corners[[1, 3]])
    assert len(np.unique(back.triangulation.corners.reshape(-1, 3), axis=0)) == 4
    write(tmp_path / "b.stl", Assembly.of(tagged))
    assert read(tmp_path / "b.stl").names == ("low", "high")


def test_names_are_made_unique_and_empty_solids_are_left_out(tmp_path: Path) -> None:
    corners = tetrahedron().corners
    text = ascii_stl(
        [("wing", corners), ("", corners), ("nothing", corners[:0]), ("wing", corners), ("wing-2", corners)]
    )
    (tmp_path / "craft.stl").write_text(text)
    assert read(tmp_path / "craft.stl").names == ("wing", "craft", "wing-3", "wing-2")


@pytest.mark.parametrize("head", [b"", b"solid wing", b"solid binary pretending\nfacet"])
def test_binary_is_seen_by_its_size_even_when_it_begins_with_solid(tmp_path: Path, head: bytes) -> None:
    (tmp_path / "a.stl").write_bytes(binary_stl(tetrahedron().corners, head=head))
    (tmp_path / "b.stl").write_bytes(gzip.compress(binary_stl(tetrahedron().corners, head=head + b"\0")))
    for name in ("a", "b"):
        back = read(tmp_path / f"{name}.stl")
        assert back.names == (name,)
        assert same_surface(back.triangulation, tetrahedron())
        assert len(back.triangulation.vertices) == 4


def test_loose_spelling_of_ascii_is_read(tmp_path: Path) -> None:
    text = ascii_stl([("a  b", tetrahedron().corners)])
    for k, form in enumerate(
        [text.upper(), text.replace("\n", "\r\n"), text.replace("\n", "\n\n\t "), "\ufeff" + text, text[:-1]]
    ):
        (tmp_path / f"{k}.stl").write_bytes(form.encode())
        assert same_surface(read(tmp_path / f"{k}.stl").triangulation, tetrahedron())
    (tmp_path / "e.stl").write_text(text.replace("normal 0 0 0", "normal nan -nan(ind) 1.#QNAN"))
    assert len(read(tmp_path / "e.stl").triangulation) == 4


def test_negative_zero_is_zero(tmp_path: Path) -> None:
    corners = np.array([[[0.0, -0.0, 0.0], [1, 0, 0], [0, 1, 0]], [[-0.0, 0.0, -0.0], [0, 1, 0], [-1, 0, 0]]])
    (tmp_path / "a.stl").write_text(ascii_stl([("a", corners)]))
    (tmp_path / "b.stl").write_bytes(binary_stl(corners))
    for name in ("a.stl", "b.stl"):
        vertices = read(tmp_path / name).triangulation.vertices
        assert len(vertices) == 4
        assert not np.signbit(vertices[0]).any()


@pytest.mark.parametrize("order", [[0], [1, 0], [0, 0, 1]])
def test_one_triangle_and_doubled_or_collapsed_ones_are_kept(tmp_path: Path, order: list[int]) -> None:
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 0, 0], [0, 0, 0], [0, 1, 0]]])[order]
    (tmp_path / "a.stl").write_bytes(binary_stl(corners))
    assert np.array_equal(read(tmp_path / "a.stl").triangulation.corners, corners)


TEXT = ascii_stl([("a", tetrahedron().corners)])
BAD = {
    "announces more": (binary_stl(tetrahedron().corners, count=5), "header says 5 triangles.* 200 bytes.* hold 4"),
    "announces fewer": (binary_stl(tetrahedron().corners, count=3), "header says 3 triangles.* hold 4"),
    "announces none": (binary_stl(tetrahedron().corners, count=0), "header says 0 triangles.* hold 4"),
    "holds none": (binary_stl(np.zeros((0, 3, 3))), "no triangle"),
    "solid without facet": (b"solid a\nendsolid a\n", "no triangle"),
    "cut in the header": (b"\0" * 50, "50 bytes are too few"),
    "other text": (b"# just a note\n" * 20, "'# just a note"),
    "solid, then zeros": (b"solid a" + b"\0" * 2000, "header says 0 triangles"),
    "zeros later": (TEXT.encode() + b"\0" * 10, "line|byte|header says"),
    "nan in binary": (
        binary_stl(np.where(np.arange(4)[:, None, None] == 2, np.nan, tetrahedron().corners)),
        "triangle 3 .*1 of 4",
    ),
    "infinity in text": (TEXT.replace("1.0", "inf", 1).encode(), "triangle 1 "),
    "overflow in text": (TEXT.replace("1.0", "1e999", 1).encode(), "triangle 1 "),
    "cut in a facet": (TEXT[:150].encode(), "ends inside facet 2"),
    "no endsolid": (TEXT.rpartition("endsolid")[0].encode(), "without 'endsolid' after 4 triangles"),
    "four corners": (TEXT.replace("vertex", "vertex 0 0 0\nvertex", 1).encode(), "line 7.*exactly three corners"),
    "two corners": (TEXT.replace("vertex 0.0 0.0 0.0\n", "", 1).encode(), "exactly three corners"),
    "a bad number": (TEXT.replace("1.0", "1.0.0", 1).encode(), "line 5 has '1.0.0'"),
    "a stray word": (TEXT.replace("outer", "inner", 1).encode(), "line 3 has 'inner'"),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("fault", BAD)
def test_faults_are_told_in_one_sentence(tmp_path: Path, fault: str, packed: bool) -> None:
    content, expected = BAD[fault]
    path = tmp_path / "bad.stl"
    path.write_bytes(gzip.compress(content) if packed else content)
    with pytest.raises(CorruptFile, match=expected) as caught:
        read(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_triangle_count_that_no_memory_holds_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "bad.stl.gz"
    path.write_bytes(gzip.compress(b"\0" * 80 + b"\xff" * 4 + b"\0" * 1000))
    with pytest.raises(CorruptFile, match="4294967295 triangles, more than 4 GiB"):
        read(path)


def test_other_readers_open_what_is_written(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    shape = tetrahedron(1.0 / 3.0)
    for form in (True, False):
        write(tmp_path / "a.stl", shape, ascii=form)
        mesh = pyvista.read(tmp_path / "a.stl")
        assert mesh.is_manifold
        assert mesh.volume == pytest.approx(shape.volume, rel=1e-6)


def test_trimesh_opens_what_is_written(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    write(tmp_path / "a.stl", two_bodies())
    scene = trimesh.load(tmp_path / "a.stl")
    assert set(scene.geometry) == {"wing", "tail fin"}
    assert all(mesh.is_watertight for mesh in scene.geometry.values())
