"""OFF: the spellings of its header, comments, colours, polygons; faults with their line or numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracles_mesh_io import same_surface, tetrahedron

from patchwright.models import Assembly, CorruptFile, UnsupportedEntity, UnsupportedFormat
from patchwright.models.io import read, write

VERTICES = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
FACES = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"


def given(tmp_path: Path, text: str) -> Assembly:
    (tmp_path / "body.off").write_text(text)
    return read(tmp_path / "body.off")


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n4 4 6\n" + VERTICES + FACES,
        "OFF 4 4 6\n" + VERTICES + FACES,
        "4 4 0\n" + VERTICES + FACES,
        "# first\n\nOFF # second\n# third\n4 4 0 # fourth\n\n" + VERTICES.replace("\n", " # corner\n\n") + FACES,
        "OFF\r\n4 4\r\n" + (VERTICES + FACES).replace("\n", "\r\n"),
        "COFF\n4 4 0\n" + VERTICES.replace("\n", " 255 0 0 255\n") + FACES.replace("\n", " 0.5 0.5 0.5\n"),
        "STCNOFF\n4 4 0\n" + VERTICES.replace("\n", " 0 0 1 9 9 9 1 0.5 0.5\n") + FACES.replace("\n", " 3\n"),
        "OFF\n4 4 0\n" + VERTICES + FACES[:-1],
    ],
)
def test_every_spelling(tmp_path: Path, text: str) -> None:
    assembly = given(tmp_path, text)
    assert assembly.names == ("body",)
    assert same_surface(assembly.triangulation, tetrahedron())


def test_polygons_are_cut_and_edges_left_out(tmp_path: Path) -> None:
    surface = given(
        tmp_path, "OFF 5 3 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n3 1 0\n5 0 1 4 2 3 255 0 0\n2 0 1\n0\n"
    ).triangulation
    assert len(surface) == 3
    assert surface.areas.sum() == pytest.approx(5.0)
    assert np.all(surface.normals[:, 2] > 0.999)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("hello\n", "'hello' instead of OFF"),
        ("OFF\n", "instead of OFF and the numbers|begins with"),
        ("OFF\n-4 4 0\n" + VERTICES + FACES, "begins with"),
        ("OFF\n4.5 4 0\n" + VERTICES + FACES, "begins with"),
        ("OFF\n4000000 4 0\n" + VERTICES + FACES, "4000000 vertices and 4 faces, but only"),
        ("OFF\n1e300 4 0\n" + VERTICES + FACES, "but only"),
        ("OFF\n5 1 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0          \n", "5 vertices, but the file ends after 4"),
        ("OFF\n4 5 0\n" + VERTICES + FACES, "5 faces, but the file ends after 4"),
        ("OFF\n4 4 0\n" + VERTICES.replace("1 0 0", "1 0") + FACES, "line 4 has|line 4"),
        ("OFF\n4 4 0\n" + VERTICES.replace("1 0 0", "1 zero 0") + FACES, "line 4 has 'zero' where vertices"),
        ("OFF\n4 4 0\n" + VERTICES.replace("1 0 0", "1 nan 0") + FACES, "vertex 2 "),
        (
            "OFF\n4 4 0\n" + VERTICES + FACES.replace("3 1 2 3", "3 1 2 4"),
            "line 9 has a face that uses vertex 4 .*has 4 vert",
        ),
        ("OFF\n4 4 0\n" + VERTICES + FACES.replace("3 1 2 3", "3 1 2 -1"), "line 9 has a face that uses vertex -1"),
        ("OFF\n4 4 0\n" + VERTICES + FACES.replace("3 1 2 3", "3 1 2.5 3"), "line 9 has '2.5' where faces"),
        ("OFF\n4 0 0\n" + VERTICES, "no triangle"),
    ],
)
def test_faults_are_told(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(CorruptFile, match=expected):
        given(tmp_path, text)


@pytest.mark.parametrize("head", ["OFF BINARY\n", "4OFF\n", "nOFF\n3\n"])
def test_other_kinds_are_refused(tmp_path: Path, head: str) -> None:
    with pytest.raises(UnsupportedEntity, match="plain text OFF"):
        given(tmp_path, head + "4 4 0\n" + VERTICES + FACES)


def test_writing_is_refused_with_what_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFormat, match=r"read but not written.*\.stl"):
        write(tmp_path / "a.off", tetrahedron())
