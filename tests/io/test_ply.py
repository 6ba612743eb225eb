"""PLY: text and both byte orders, polygons, elements and properties that are skipped."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from oracles_mesh_io import TETRAHEDRON, TETRAHEDRON_FACES, same_surface, tetrahedron

from patchwright.models import Assembly, CorruptFile, Part, RepairWarning, UnsupportedEntity
from patchwright.models.io import read, write

HEADER = """ply
format {form} 1.0
comment made by hand
element camera 2
property list uchar short path
property double zoom
element vertex 4
property uchar red
property float x
property float y
property {z} z
element face 4
property uchar flags
property list {count} {index} {name}
property list uchar float texcoord
element edge 1
property int a
end_header
"""


def hand_made(
    form: str, z: str = "float", count: str = "uchar", index: str = "int", name: str = "vertex_indices"
) -> bytes:
    """A tetrahedron among things to be skipped, every row written by itself."""
    codes = {
        "uchar": "B",
        "short": "h",
        "ushort": "H",
        "int": "i",
        "uint": "I",
        "char": "b",
        "float": "f",
        "double": "d",
    }
    rows: list[tuple[str, tuple[float, ...]]] = [("Bhhd", (2, -1, 5, 0.5)), ("Bd", (0, 1.5))]
    rows += [("Bff" + codes[z], (200, x, y, int(w) if z == "short" else w)) for x, y, w in TETRAHEDRON.tolist()]
    rows += [
        ("B" + codes[count] + 3 * codes[index] + "Bff", (1, 3, *f, 2, 0.5, 0.25)) for f in TETRAHEDRON_FACES.tolist()
    ]
    rows += [("i", (0,))]
    head = HEADER.format(form=form, z=z, count=count, index=index, name=name).encode()
    if form == "ascii":
        return head + "\n".join(" ".join(map(str, values)) for _, values in rows).encode() + b"\n"
    order = "<" if "little" in form else ">"
    return head + b"".join(struct.pack(order + code, *values) for code, values in rows)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    ("z", "count", "index", "name"),
    [
        ("float", "uchar", "int", "vertex_indices"),
        ("double", "int", "uint", "vertex_index"),
        ("short", "char", "ushort", "vertex_indices"),
    ],
)
def test_every_form_with_things_to_skip(tmp_path: Path, form: str, z: str, count: str, index: str, name: str) -> None:
    (tmp_path / "a.ply").write_bytes(hand_made(form, z, count, index, name))
    assembly = read(tmp_path / "a.ply")
    assert assembly.names == ("a",)
    assert same_surface(assembly.triangulation, tetrahedron())


def test_polygons_of_different_sizes(tmp_path: Path) -> None:
    text = "ply\r\nformat ascii 1.0\r\nelement vertex 5\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\n"
    text += "element face 3\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    text += "0 0 0\r\n2 0 0\r\n2 2 0\r\n0 2 0\r\n3 1 0\r\n4 0 1 2 3\r\n3 1 4 2\r\n2 0 1\r\n"
    (tmp_path / "a.ply").write_bytes(text.encode())
    surface = read(tmp_path / "a.ply").triangulation
    assert len(surface) == 3
    assert surface.areas.sum() == pytest.approx(5.0)


@pytest.mark.parametrize("ascii_form", [False, True])
@pytest.mark.parametrize("name", ["a.ply", "a.ply.gz"])
def test_round_trip_bit_for_bit(tmp_path: Path, ascii_form: bool, name: str) -> None:
    write(tmp_path / name, tetrahedron(1 / 3, 1e-9), ascii=ascii_form)
    assert same_surface(read(tmp_path / name).triangulation, tetrahedron(1 / 3, 1e-9))


def test_names_lost_are_told_once(tmp_path: Path) -> None:
    craft = Assembly((Part("wing", tetrahedron()), Part("tail", tetrahedron(2.0))))
    with pytest.warns(RepairWarning, match="names of 2 parts") as caught:
        write(tmp_path / "a.ply", craft)
    assert len(caught) == 1


GOOD = hand_made("binary_little_endian")
TEXT = hand_made("ascii")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"plain text\n", "instead of 'ply'"),
        (b"ply\nformat ascii 1.0\n", "no 'end_header'"),
        (TEXT.replace(b"float x", b"quad x"), "line 9 of its header"),
        (TEXT.replace(b"format ascii", b"format morse"), "line 2 of its header"),
        (TEXT.replace(b"float x", b"float w"), "x, y and z"),
        (TEXT.replace(b"vertex_indices", b"corner"), "vertex_indices"),
        (TEXT.replace(b"0 1 3", b"0 1 4"), "face 2 uses vertex 4 .*has 4 vertices"),
        (TEXT.replace(b"0 1 3", b"0 -1 3"), "face 2 uses vertex -1"),
        (TEXT.replace(b"0 1 3", b"0 1.5 3"), "face 2 uses vertex -1"),
        (TEXT.replace(b"200 1.0 0.0", b"200 nan 0.0"), "vertex 2 has a coordinate"),
        (TEXT.replace(b"200 1.0 0.0", b"200 one 0.0"), "'one' where a number"),
        (TEXT.replace(b"vertex 4", b"vertex 400000000000"), "400000000000 rows of vertex"),
        (TEXT.replace(b"face 4", b"face 0"), "no face"),
        (TEXT.replace(b"element face 4", b"element facet 4"), "no face"),
        (GOOD[:-40], "4 rows of face, but the file ends after [123]"),
        (GOOD[: GOOD.index(b"end_header") + 40], "rows of (camera|vertex)"),
    ],
)
def test_faults_are_told_with_numbers(tmp_path: Path, content: bytes, expected: str) -> None:
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(CorruptFile, match=expected):
        read(tmp_path / "a.ply")


def test_strips_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(TEXT.replace(b"element camera", b"element tristrips"))
    with pytest.raises(UnsupportedEntity, match="strips"):
        read(tmp_path / "a.ply")


def test_vtk_opens_what_is_written(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    for form in (True, False):
        write(tmp_path / "a.ply", tetrahedron(3.0), ascii=form)
        mesh = pyvista.read(tmp_path / "a.ply")
        assert mesh.n_cells == 4
        assert mesh.volume == pytest.approx(27.0 / 6.0, rel=1e-6)
        assert np.array_equal(mesh.bounds, [0.0, 3.0] * 3)
