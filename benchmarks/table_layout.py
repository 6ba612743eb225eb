"""Automatic layouts, one row each: what is covered, whether features lie on block borders, blocks, corners, seams.

    python benchmarks/table_layout.py [NAME or FILE ...] [--limit CPU-SECONDS] [--json FILE]

Without arguments: samples of `models.samples`, the shapes of `tests/layout_shapes.py` and the triangulated models in
`PATCHWRIGHT_DATA` (default ../shared/data). Each is repaired with the default options in a process of its own that is
stopped at the limit.

Columns: `in`, `out` are the shares of the area within the fit tolerance, input to patches and patches to input;
`features` is the share of the length of feature curves longer than 1 % of the diagonal that lies on block borders,
measured by points along them (`-` where there are none); `quads`, `blocks`, `irregular` inner vertices off the
features; `corner`, the smallest angle at a block's corner; largest normal angles over smooth seams in degrees: the 99th
percentile and the largest between regular vertices (four edges, off the features), the same at irregular ones, and how
many of all smooth seams are above 30.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

from rows import heading, limit_processor, line, print_row, row_of_child

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("PATCHWRIGHT_DATA", HERE.parent.parent / "shared" / "data"))
MESH = (".stl", ".obj", ".ply", ".off", ".tri")
SAMPLES = ("sphere", "ellipsoid", "torus", "cube", "blade", "car", "slotted_flap", "capsule", "two_spheres", "demo")
SHAPES = ("cube", "wedge", "cylinder", "sphere", "torus", "plate_with_hole")
LONG = 0.01  # of the diagonal: shorter features do not count
ON = 1e-6  # of the diagonal: as near a point lies on a block border
STEP = 1e-3  # of the diagonal, between points along features
STEEP = 30.0  # degrees
COLUMNS = (
    ("name", "{:22s}"), ("in", "{:>8.3%}"), ("out", "{:>8.3%}"), ("features", "{:>8.3%}"), ("quads", "{:>6d}"),
    ("blocks", "{:>6d}"), ("irregular", "{:>9d}"), ("corner", "{:>6.1f}"), ("regular 99%", "{:>11.3f}"),
    ("largest", "{:>8.2f}"), ("irregular 99%", "{:>13.3f}"), ("worst", "{:>8.2f}"), ("above 30", "{:>8d}"),
    ("cpu s", "{:>6.1f}"), ("MB", "{:>6.0f}"),
)  # fmt: skip


def model(name: str) -> Any:
    """The triangulation or assembly a name stands for: `sample:NAME`, `shape:NAME` or a file."""
    source, _, own = name.partition(":")
    if source == "sample":
        from patchwright.models import samples

        if own == "demo":
            return samples.demo_aircraft().assembly
        return getattr(samples, own)().assembly
    if source == "shape":
        sys.path.insert(0, str(HERE.parent / "tests"))
        import layout_shapes

        return getattr(layout_shapes, own)()
    from patchwright.models.io import read

    return read(Path(name))


def judge(name: str) -> dict[str, object]:
    """One row of the table."""
    import numpy as np

    from patchwright.models.errors import GeometryError
    from patchwright.repair import repair
    from patchwright.repair.layout.blocks import find_blocks, smallest_corner
    from patchwright.repair.patches.joins import seam_angles, side_normals, smooth_edges

    start = time.process_time()
    repaired = repair(model(name))
    network = repaired.network
    if network is None or repaired.deviation is None:
        raise GeometryError("; ".join(problem.message for problem in repaired.problems) or "no patches")
    layout = network.layout
    blocks = find_blocks(layout)
    crease = layout.sharp | layout.boundary
    degree = np.bincount(layout.edges.reshape(-1), minlength=len(layout.vertices))
    on_feature = np.zeros(len(degree), dtype=bool)
    on_feature[layout.edges[crease].reshape(-1)] = True
    regular = ((degree == 4) & ~on_feature)[layout.edges].all(axis=1)
    irregular = ((degree != 4) & ~on_feature)[layout.edges].any(axis=1)
    angle, smooth = seam_angles(layout, side_normals(layout, network.nets)), smooth_edges(layout)

    def worst(which: Any) -> tuple[float | None, float | None]:
        own = angle[smooth & which]
        return (float(np.percentile(own, 99.0)), float(own.max())) if len(own) else (None, None)

    row: dict[str, object] = {
        "in": repaired.deviation.input_to_output.coverage,
        "out": repaired.deviation.output_to_input.coverage,
        "features": feature_share(repaired.triangulation, layout, blocks),
        "quads": len(layout.quads),
        "blocks": len(blocks),
        "irregular": int(((degree != 4) & (degree > 0) & ~on_feature).sum()),
        "corner": smallest_corner(layout, blocks),
        "above 30": int((smooth & (angle > STEEP)).sum()),
    }
    row["regular 99%"], row["largest"] = worst(regular)
    row["irregular 99%"], row["worst"] = worst(irregular)
    row["cpu s"] = time.process_time() - start
    row["MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return row


def feature_share(triangulation: Any, layout: Any, blocks: Any) -> float | None:
    """Share of the points along long feature curves that lie on the paths of block borders."""
    import numpy as np
    from scipy.spatial import cKDTree

    from patchwright.repair.layout.features import find_features

    features = find_features(triangulation)
    size = triangulation.diagonal
    curves = np.flatnonzero(features.lengths > LONG * size)
    points = [
        _even(features.body.vertices[features.vertices[features.offsets[c] : features.offsets[c + 1]]], STEP * size)
        for c in curves
    ]
    if not points:
        return None
    asked = np.concatenate(points)
    paths = [layout.path(int(e)) for e in np.flatnonzero(blocks.wall)]
    first, second = (np.concatenate([path[part] for path in paths]) for part in (slice(None, -1), slice(1, None)))
    # the segments that may be nearest: those whose middle is within the nearest end's distance and half a segment
    middle, reach = 0.5 * (first + second), 0.5 * float(np.linalg.norm(second - first, axis=1).max())
    near = cKDTree(middle).query_ball_point(asked, reach + ON * size)
    count = np.array([len(n) for n in near])
    which, owner = (
        np.concatenate([np.asarray(n, dtype=np.int64) for n in near]),
        np.repeat(np.arange(len(asked)), count),
    )
    along = second[which] - first[which]
    square = np.maximum((along * along).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((asked[owner] - first[which]) * along).sum(axis=1) / square, 0.0, 1.0)
    off = np.linalg.norm(first[which] + share[:, None] * along - asked[owner], axis=1)
    nearest = np.full(len(asked), np.inf)
    np.minimum.at(nearest, owner, off)
    return float((nearest <= ON * size).mean())


def _even(line: Any, step: float) -> Any:
    """Points along a polyline, about `step` apart, each standing for the same length."""
    import numpy as np

    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    count = max(1, round(along[-1] / step))
    at = (np.arange(count) + 0.5) / count * along[-1]
    return np.stack([np.interp(at, along, line[:, d]) for d in range(3)], axis=1)


def judged(name: str, limit: float) -> dict[str, object]:
    """`judge` in a process of its own; a row in any case."""
    return row_of_child(__file__, ["--row", name], limit)


def everything() -> list[str]:
    """All names of the table."""
    names = [f"sample:{name}" for name in SAMPLES] + [f"shape:{name}" for name in SHAPES]
    files = sorted(DATA.iterdir()) if DATA.is_dir() else []
    return names + [str(f) for f in files if "".join(f.suffixes).removesuffix(".gz").endswith(MESH)]


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("names", nargs="*")
    arguments.add_argument("--limit", type=float, default=600.0, help="seconds of processor time per model")
    arguments.add_argument("--json", type=Path, help="write the rows there too")
    arguments.add_argument("--row", help=argparse.SUPPRESS)
    asked = arguments.parse_args()
    if asked.row:
        limit_processor(asked.limit)
        print_row(judge(asked.row))
        return
    print(heading(COLUMNS))
    rows = []
    for name in asked.names or everything():
        rows.append({"name": Path(name).name[:22], **judged(name, asked.limit)})
        print(line(rows[-1], COLUMNS), flush=True)
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
