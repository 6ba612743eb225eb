"""Cart3D .tri: text and Fortran records of both byte orders give the same components."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracles_mesh_io import TETRAHEDRON, TETRAHEDRON_FACES, fortran, tetrahedron

from patchwright.models import CorruptFile
from patchwright.models.io import read

FACES = TETRAHEDRON_FACES + 1
COMPONENTS = np.array([3, 1, 3, 1])


def text(components: bool = True) -> str:
    rows = [
        "4 4",
        *(" ".join(map(repr, row)) for row in TETRAHEDRON.tolist()),
        *(" ".join(map(str, row)) for row in FACES.tolist()),
    ]
    return "\n".join(rows + ([str(c) for c in COMPONENTS.tolist()] if components else [])) + "\n"


def records(order: str, width: int, components: bool = True) -> bytes:
    parts = [np.array([4, 4], order + "i4"), TETRAHEDRON.astype(f"{order}f{width}"), FACES.astype(order + "i4")]
    parts += [COMPONENTS.astype(order + "i4")] if components else []
    return fortran(*(part.tobytes() for part in parts), order=order)


@pytest.mark.parametrize("components", [True, False])
@pytest.mark.parametrize("form", ["text", "<4", "<8", ">4", ">8"])
def test_every_form(tmp_path: Path, form: str, components: bool) -> None:
    path = tmp_path / "a.tri"
    path.write_bytes(text(components).encode() if form == "text" else records(form[0], int(form[1]), components))
    assembly = read(path)
    corners = tetrahedron().corners
    if components:
        assert assembly.names == ("component1", "component3")
        assert np.array_equal(assembly.parts[0].triangulation.corners, corners[[1, 3]])
        assert np.array_equal(assembly.parts[1].triangulation.corners, corners[[0, 2]])
    else:
        assert assembly.names == ("a",)
        assert np.array_equal(assembly.triangulation.corners, corners)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"hello\n", "'hello'"),
        (b"4\n", "does not begin with"),
        (b"-4 4\n1 2 3\n", "does not begin with"),
        (text()[:-4].encode(), "need 24 numbers, or 28 with components, but 26 follow"),
        (text().replace("1 3 2", "1 3 5").encode(), "triangle 1 uses vertices .*5.*has 4"),
        (text().replace("1 3 2", "1 3 0").encode(), "triangle 1 uses"),
        (text().replace("1 3 2", "1 3.5 2").encode(), "whole number"),
        (text().replace("1 3 2", "1 1e30 2").encode(), "whole number"),
        (text().replace("0.0", "inf", 1).encode(), "vertex 1 "),
        (records(">", 4)[:-8], "do not fit"),
        (records(">", 4).replace(b"\0\0\0\x30", b"\0\0\0\x31"), "do not fit"),
        (b"\0" * 100, "neither text nor Fortran"),
    ],
)
def test_faults_are_told(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "a.tri"
    path.write_bytes(content)
    with pytest.raises(CorruptFile, match=expected):
        read(path)
