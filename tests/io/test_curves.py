"""Curves written and read back by an independent reader."""

import numpy as np
import pytest

from patchwright.models import NurbsCurve
from patchwright.models.errors import UnsupportedFormat
from patchwright.models.io.curves import write_curves

LINE = NurbsCurve(1, [0.0, 0.0, 2.0, 2.0], [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]])
QUARTER = NurbsCurve(
    2, [0, 0, 0, 1, 1, 1], [[1.0, 0, 0], [1, 1, 0], [0, 1, 0]], np.array([1.0, np.sqrt(0.5), 1.0])
)  # a quarter of the unit circle
CURVES = (LINE, QUARTER)
POLYLINES = tuple(c(np.linspace(*c.domain, 9)) for c in CURVES)


@pytest.mark.parametrize("suffix", [".step", ".igs"])
def test_cad_files_hold_the_curves_themselves(tmp_path, suffix):
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_AbscissaPoint
    from OCP.IGESControl import IGESControl_Reader
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    path = tmp_path / f"curves{suffix}"
    write_curves(path, CURVES, POLYLINES, unit="mm")
    reader = STEPControl_Reader() if suffix == ".step" else IGESControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    walk, lengths = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_EDGE), []
    while walk.More():
        lengths.append(GCPnts_AbscissaPoint.Length_s(BRepAdaptor_Curve(TopoDS.Edge(walk.Current())), 1e-12))
        walk.Next()
    assert sorted(lengths) == pytest.approx(sorted([np.sqrt(14.0), np.pi / 2]), rel=1e-9)


@pytest.mark.parametrize("suffix", [".vtp", ".vtk"])
def test_vtk_reads_the_polylines(tmp_path, suffix):
    import pyvista

    path = tmp_path / f"curves{suffix}"
    write_curves(path, CURVES, POLYLINES)
    mesh = pyvista.read(path)
    assert mesh.n_lines == 2
    assert np.array_equal(np.asarray(mesh.points), np.concatenate(POLYLINES))


def test_plot3d_holds_one_block_a_curve(tmp_path):
    from patchwright.models.io import read_grid

    path = tmp_path / "curves.p3d"
    write_curves(path, CURVES, POLYLINES)
    blocks = read_grid(path).blocks
    assert [b.size // 3 for b in blocks] == [9, 9]
    assert np.array_equal(blocks[1].reshape(-1, 3), POLYLINES[1])


def test_formats_without_curves_are_refused(tmp_path):
    with pytest.raises(UnsupportedFormat, match="no curves"):
        write_curves(tmp_path / "curves.stl", CURVES, POLYLINES)
    with pytest.raises(UnsupportedFormat, match="no curve"):
        write_curves(tmp_path / "curves.step", (), ())
