"""CAD faces damaged in known ways, or as files come, healed: what was kept, what the seams are, beside OCCT sewing.

    python benchmarks/table_cad_healing.py [--only WORD] [--no-gmsh] [--json FILE] [--limit CPU-SECONDS]

Cases: `featuretype.step` with three faces shifted, turned, cut back or shrunk by 0.1 or 1 % of its diagonal
(`tests/oracles_cad_damage.py`); the cube sphere with patches 0.1 to 10 % apart; five models damaged in seven ways each
(`cad_damage_cases.py`); the files of `PATCHWRIGHT_DATA` (default ../shared/data) that come with loose, open or invalid
faces. Each case runs in a process of its own that is stopped at the limit of processor time. Results are written as
STEP and judged on the file read back.

Columns: `kept` share of faces whose surface is identical to 1e-12; `gap` and `angle` the widest seam (share of the
diagonal) and the 99th percentile of seam angles (degrees) of the input and of the result; `far` the farthest that any
point of a result's face is from the damaged places, in gap widths, where it is off the undamaged model (damaged cases
only); `valid` and `closed` by the kernel's check and the edges' use (of a model that was open: as many free edges as it
had); `gmsh` whether gmsh meshes the result in 2-D as it is; `occt` the widest seam after OCCT sewing of the same file
at the damage's size.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cad_damage_cases
from rows import heading, limit_processor, line, print_row, row_of_child

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("PATCHWRIGHT_DATA", HERE.parent.parent / "shared" / "data"))
FILES = ("turbine_part.stp", "k1_loose_shells.stp", "t4mec.stp", "b1_invalid_faces.stp")
DAMAGE = ("shifted large", "shifted small", "turned", "pulled back", "shrunk")
SIZES = (1e-3, 1e-2)
APART = (0.001, 0.01, 0.05, 0.1)
COLUMNS = (
    ("case", "{:32s}"), ("verdict", "{:14s}"), ("faces", "{:>5d}"), ("kept", "{:>6.1%}"), ("gap in", "{:>8.1e}"),
    ("angle in", "{:>8.2f}"), ("gap", "{:>8.1e}"), ("angle", "{:>6.2f}"), ("far", "{:>6.2f}"), ("valid", "{:>5s}"),
    ("closed", "{:>6s}"), ("gmsh", "{:>5s}"), ("occt", "{:>8.1e}"), ("cpu s", "{:>6.1f}"),
)  # fmt: skip
GMSH = """
import sys, gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("Geometry.OCCAutoFix", 0)
gmsh.open(sys.argv[1])
gmsh.option.setNumber("Mesh.MeshSizeFactor", 1.0)
gmsh.model.mesh.generate(2)
faces = gmsh.model.getEntities(2)
empty = [tag for _, tag in faces if not len(gmsh.model.mesh.getElements(2, tag)[0])]
print(len(faces), len(empty))
gmsh.finalize()
"""


def cases() -> list[str]:
    """All names, in the order of the table."""
    return [
        *(f"featuretype {kind} {size:g}" for kind in DAMAGE for size in SIZES),
        *(f"cube sphere {gap:g}" for gap in APART),
        *cad_damage_cases.names(),
        *FILES,
    ]


def made(name: str, folder: Path) -> tuple[Path, Path | None, float]:
    """The case's file, the undamaged one where there is one, and the width of the damage as a length."""
    sys.path.insert(0, str(HERE.parent / "tests"))
    import numpy as np
    from oracles_cad_damage import faces_of, pulled_back, read_shape, shifted, shrunk, turned, written

    from patchwright.models import Assembly
    from patchwright.models.io import read, write
    from patchwright.models.samples.cube_sphere import cube_sphere_patches

    if name in FILES:
        return DATA / name, None, 0.0
    if ": " in name:
        return cad_damage_cases.made(name, folder)
    if name.startswith("cube"):
        gap = float(name.split()[-1])
        path = folder / "apart.step"
        write(path, Assembly.of([s for body in cube_sphere_patches(gap).bodies for s in body.surfaces]))
        return path, None, 0.5 * np.pi * gap
    kind, share = name.removeprefix("featuretype ").rsplit(" ", 1)
    whole = DATA / "featuretype.step"
    size = float(share) * read(whole).diagonal
    which = {"shifted large": (17, 22, 80), "shifted small": (0, 30, 78), "turned": (20, 24, 85)}.get(
        kind, (17, 50, 84)
    )
    rng = np.random.default_rng(sum(which))

    def unit() -> object:
        vector = rng.normal(size=3)
        return vector / np.linalg.norm(vector)

    def damaged(face: object) -> object:
        if kind.startswith("shifted"):
            return shifted(face, size * unit())
        if kind == "turned":
            return turned(face, unit(), size / 30.0)
        return pulled_back(face, size) if kind == "pulled back" else shrunk(face, 1.0 - float(share))

    faces = [damaged(f) if k in which else f for k, f in enumerate(faces_of(read_shape(whole)))]
    return written(folder / "damaged.step", faces, set(which)), whole, size


def judge(name: str, with_gmsh: bool) -> dict[str, object]:
    """One row of the table."""
    import numpy as np

    from patchwright.models.cad import brep_status, measure_seams, surface_difference
    from patchwright.models.cad.sewing import sew
    from patchwright.models.errors import GeometryError
    from patchwright.models.io import read, write
    from patchwright.models.tree import Tree
    from patchwright.repair import repair

    with tempfile.TemporaryDirectory() as place:
        path, whole, size = made(name, Path(place))
        before = read(path)
        start = time.process_time()
        result = repair(before, openings="close" if name.endswith("missing") else "keep")
        row: dict[str, object] = {
            "cpu s": time.process_time() - start,
            "verdict": result.verdict.value.replace("repaired with invented surface", "invented"),
            "faces": len(before.parts),
            "why": "; ".join(problem.message[:100] for problem in result.problems[:2]),
        }
        diagonal = before.diagonal
        row["gap in"], row["angle in"] = _seams(measure_seams(before), diagonal)
        try:
            sewn = sew(before, max(size, 1e-3 * diagonal)).assembly
            row["occt"] = _seams(measure_seams(sewn), diagonal)[0]
        except GeometryError:
            pass  # the kernel's sewing fails or gives nothing to measure
        if not result.faces:
            return row
        written = Path(place, "healed.step")
        write(written, result.to_assembly())
        after = read(written)
        own = {part.name: part.surface for part in result.to_assembly().parts}
        here = [part.name for part in before.parts if part.name in own]  # copies of faces may be gone
        there = {part.name: part.surface for part in before.parts}
        row["kept"] = float(np.mean([surface_difference(there[name], own[name]) <= 1e-12 for name in here]))
        row["gap"], row["angle"] = _seams(measure_seams(after), diagonal)
        row["valid"] = "yes" if not brep_status(after).invalid else "no"
        assert after.topology is not None
        points = [np.ptp(c(np.linspace(*c.domain, 5)), axis=0).max() <= 1e-9 * diagonal for c in after.topology.curves]
        free = int((after.topology.use_counts() != 2)[~np.array(points)].sum())
        row["closed"] = "yes" if free <= (0 if whole is None else _free(read(whole))) else "no"
        if whole is not None:
            good = read(whole)
            corners = after.triangulation.vertices
            off = Tree.of(good.triangulation).closest(corners).distance
            moved = corners[off > 4.0 * 2e-4 * diagonal + 1e-9]  # beyond what two tessellations differ by
            if size > 0.0:
                row["far"] = float(off.max() / size) if not len(moved) else _far(moved, before, good, size)
        if with_gmsh:
            row["gmsh"] = _meshed(written)
    return row


def _seams(seams: list[object], diagonal: float) -> tuple[float, float]:
    import numpy as np

    gap = max((seam.gap for seam in seams), default=0.0) / diagonal  # type: ignore[attr-defined]
    angles = [seam.typical for seam in seams]  # type: ignore[attr-defined]
    return gap, float(np.percentile([a for a in angles if a < 30.0] or [0.0], 99.0))


def _free(model: object) -> int:
    """Edges used once (or more than twice), poles left out."""
    import numpy as np

    topology = model.topology  # type: ignore[attr-defined]
    long = [np.ptp(c(np.linspace(*c.domain, 5)), axis=0).max() > 1e-9 * model.diagonal for c in topology.curves]  # type: ignore[attr-defined]
    return int((topology.use_counts() != 2)[np.array(long)].sum())


def _far(moved: object, before: object, good: object, size: float) -> float:
    """The largest distance of moved points from the damaged faces as they were, in gap widths."""
    import numpy as np

    from patchwright.models.cad import surface_difference
    from patchwright.models.tree import Tree
    from patchwright.models.triangulation import concatenate

    sound = [p.surface for p in good.parts]  # type: ignore[attr-defined]
    bad = [
        p.triangulation
        for p in before.parts  # type: ignore[attr-defined]
        if min(surface_difference(p.surface, s) for s in sound) > 1e-12
    ]
    if not bad:
        return float("nan")
    return float(np.max(Tree.of(concatenate(bad)).closest(moved).distance) / size)


def _meshed(path: Path) -> str:
    """Whether gmsh gives every face triangles, in a child process, with its own fixing switched off."""
    try:
        done = subprocess.run([sys.executable, "-c", GMSH, str(path)], capture_output=True, text=True, timeout=300)
    except subprocess.TimeoutExpired:
        return "late"
    if done.returncode or not done.stdout.strip():
        return "no"
    faces, empty = map(int, done.stdout.split()[-2:])
    return "yes" if faces and not empty else f"-{empty}"


def judged(name: str, limit: float, with_gmsh: bool) -> dict[str, object]:
    """`judge` in a process of its own; a row in any case."""
    row = row_of_child(__file__, ["--row", name, *([] if with_gmsh else ["--no-gmsh"])], limit)
    return {"verdict": row.pop("how").upper(), **row} if "how" in row else row


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--only", default="", help="cases whose name holds this word")
    arguments.add_argument("--no-gmsh", action="store_true")
    arguments.add_argument("--limit", type=float, default=600.0, help="seconds of processor time per case")
    arguments.add_argument("--json", type=Path, help="write the rows there too")
    arguments.add_argument("--row", help=argparse.SUPPRESS)
    asked = arguments.parse_args()
    if asked.row:
        limit_processor(asked.limit)
        print_row(judge(asked.row, not asked.no_gmsh))
        return
    print(heading(COLUMNS))
    rows = []
    for name in cases():
        if asked.only in name:
            rows.append({"case": name, **judged(name, asked.limit, not asked.no_gmsh)})
            print(line(rows[-1], COLUMNS), flush=True)
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
