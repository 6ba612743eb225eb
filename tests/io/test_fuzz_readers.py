"""Damaged files: cut anywhere, bytes changed anywhere. A reader answers with a valid assembly or a `GeometryError`,
nothing else."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles_mesh_io import TETRAHEDRON, TETRAHEDRON_FACES, ascii_stl, binary_stl, fortran, plot3d_binary, tetrahedron

from patchwright.models import Assembly, GeometryError, Part, StructuredGrid
from patchwright.models.io import read, write

CRAFT = Assembly((Part("wing", tetrahedron(1 / 3)), Part("tail", tetrahedron(2.5, 0.1))))
OBJ = "o a\nv 0 0 0\nv 1.5e-3 0 0\nv 1 1 0 \\\n1\nv 0 1 0\nv -1 .5 0\ng b\nf 1 2 3 4 5\nf -1/2 -2/3/4 -3//1\n"
OFF = "COFF\n# c\n5 2 0\n0 0 0 1 1 1\n1 0 0 1 1 1\n1 1 0 1 1 1\n0 1 0 1 1 1\n-1 .5 0 1 1 1\n5 0 1 2 3 4 0.5\n3 0 1 2\n"
TRI = (
    "4 4\n"
    + "\n".join(" ".join(map(str, row)) for row in [*TETRAHEDRON.tolist(), *(TETRAHEDRON_FACES + 1).tolist()])
    + "\n1\n1\n2\n2\n"
)
TRI_RECORDS = fortran(
    *(
        a.astype(c).tobytes()
        for a, c in zip([np.array([4, 4]), TETRAHEDRON, TETRAHEDRON_FACES + 1], (">i4", ">f4", ">i4"), strict=True)
    ),
    order=">",
)
GRID = StructuredGrid(
    (np.random.default_rng(2).normal(size=(3, 2, 1, 3)), np.random.default_rng(3).normal(size=(2, 2, 2, 3)))
)


def _written(suffix: str, thing: object = tetrahedron(0.75), **options: bool) -> Callable[[Path], bytes]:
    def make(folder: Path) -> bytes:
        write(folder / f"seed{suffix}", thing, **options)
        return (folder / f"seed{suffix}").read_bytes()

    return make


SEEDS: dict[str, tuple[str, Callable[[Path], bytes]]] = {
    "stl text": (
        ".stl",
        lambda _: ascii_stl([("a", tetrahedron().corners), ("b c", tetrahedron(0.1).corners)]).encode(),
    ),
    "stl binary": (".stl", lambda _: binary_stl(tetrahedron().corners, head=b"solid x")),
    "stl packed": (".stl.gz", lambda _: gzip.compress(binary_stl(tetrahedron().corners))),
    "obj": (".obj", lambda _: OBJ.encode()),
    "obj written": (".obj", _written(".obj", CRAFT)),
    "ply text": (".ply", _written(".ply", ascii=True)),
    "ply binary": (".ply", _written(".ply")),
    "off": (".off", lambda _: OFF.encode()),
    "tri": (".tri", lambda _: TRI.encode()),
    "tri records": (".tri", lambda _: TRI_RECORDS),
    "plot3d records": (".xyz", _written(".xyz", GRID)),
    "plot3d stream": (".xyz", _written(".xyz", GRID, fortran=False, single=True, big_endian=True)),
    "plot3d text": (".xyz", _written(".fmt", GRID, iblank=True)),
    "plot3d blanked": (
        ".xyz",
        lambda _: plot3d_binary([GRID.blocks[0]], iblank=[np.array([[[0], [1]], [[1], [1]], [[2], [3]]])]),
    ),
}
EDITS = st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(0, 255)), max_size=4)


@pytest.mark.parametrize("seed", SEEDS)
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edits=EDITS,
    cut=st.one_of(st.none(), st.floats(0.0, 1.0)),
    word=st.sampled_from([b"", b"-1", b"nan", b"9" * 30, b"\n", b"1e999", b"0"]),
)
def test_damaged_files(
    tmp_path: Path, seed: str, edits: list[tuple[float, int]], cut: float | None, word: bytes
) -> None:
    suffix, make = SEEDS[seed]
    if not (tmp_path / "seed").exists():
        (tmp_path / "seed").write_bytes(make(tmp_path))
    content = bytearray((tmp_path / "seed").read_bytes())
    for where, byte in edits:
        content[int(where * (len(content) - 1))] = byte
    if cut is not None:
        place = int(cut * len(content))
        content = content[:place] + (word + content[place + len(word) :] if word else b"")
    (tmp_path / f"a{suffix}").write_bytes(bytes(content))
    sentence = ""
    try:
        assembly = read(tmp_path / f"a{suffix}")
    except GeometryError as error:
        sentence = str(error)
    if sentence:
        assert "\n" not in sentence
        assert str(tmp_path) in sentence
        return
    assert assembly.parts
    for part in assembly.parts:
        surface = part.triangulation
        assert len(surface) > 0
        assert np.isfinite(surface.vertices).all()
        assert surface.triangles.min() >= 0
        assert surface.triangles.max() < len(surface.vertices)
        assert len(np.unique(surface.vertices, axis=0)) == len(surface.vertices)
