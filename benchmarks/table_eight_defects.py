"""The eight small cases that mesh repair tools are compared on, every installed tool in the same run, default options.

    python benchmarks/table_eight_defects.py [--shape NAME|all] [--seed N] [--size LENGTH] [--tools NAME ...]
        [--patches]

A cell is right (`ok`) when the result is closed, one component, of the right genus, consistently oriented, without
triangles that pass through each other, within 0.3 % of the volume that the undamaged triangulation encloses, and
nowhere farther than 1e-4 of the diagonal from what was undamaged. Otherwise it says what is wrong: OPEN, components
(2c), genus, crossing triangles (x), volume error in per cent, deviation (d, share of the diagonal), FAIL for an
exception. Tools that are not installed are left out; each runs in a process of its own. The peers are copyleft or
binary: optional, and used here only. `--patches` judges a tessellation of the fitted patches too; smooth patches stray
from coarse facets as these do from the smooth shape, so volume and deviation are told there and not judged.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.samples.eight import SHAPES, DefectCase, eight_defects
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation

LIMIT = 1800.0  # seconds of wall clock per tool and shape
CELL, OFFSET = 5.0, 0.1  # per cent of the diagonal: the alpha wrap's usual first choice


def patchwright(dirty: Triangulation, name: str, patches: bool = False) -> Triangulation:
    from patchwright.models import Assembly
    from patchwright.repair import repair

    result = repair(Assembly.of(dirty), openings="close" if name == "missface" else "keep")
    if result.verdict == "refused":
        raise RuntimeError("; ".join(problem.message for problem in result.problems))
    if patches:
        if result.network is None:
            raise RuntimeError("no patches")
        return welded(result.network.tessellate(8))
    return result.triangulation


def fitted(dirty: Triangulation, name: str) -> Triangulation:
    return patchwright(dirty, name, patches=True)


def welded(mesh: Triangulation) -> Triangulation:
    """Equal coordinates as one vertex, as every tool is given them and as every result is judged."""
    points, which = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
    triangles = which.reshape(-1)[mesh.triangles]
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return Triangulation(points, triangles[whole])


def trimesh(dirty: Triangulation, name: str) -> Triangulation:
    import trimesh as tool

    mesh = tool.Trimesh(np.array(dirty.vertices), np.array(dirty.triangles), process=True)
    mesh.update_faces(mesh.unique_faces())
    mesh.update_faces(mesh.nondegenerate_faces())
    tool.repair.fix_normals(mesh)
    tool.repair.fill_holes(mesh)
    tool.repair.fix_normals(mesh)
    return Triangulation(mesh.vertices, mesh.faces)


def pymeshfix(dirty: Triangulation, name: str) -> Triangulation:
    import pymeshfix as tool

    once = welded(dirty)
    mesh = tool.MeshFix(np.array(once.vertices), once.triangles.astype(np.int32))
    mesh.repair(joincomp=True, remove_smallest_components=False)
    return Triangulation(np.asarray(mesh.points), np.asarray(mesh.faces).astype(np.int64))


def alpha_wrap(dirty: Triangulation, name: str) -> Triangulation:
    import pymeshlab as tool

    session = tool.MeshSet(verbose=False)
    session.add_mesh(tool.Mesh(np.array(dirty.vertices), np.array(dirty.triangles)))
    session.generate_alpha_wrap(alpha=tool.PercentageValue(CELL), offset=tool.PercentageValue(OFFSET))
    mesh = session.current_mesh()
    return Triangulation(mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64))


def manifold3d(dirty: Triangulation, name: str) -> Triangulation:
    import manifold3d as tool

    once = welded(dirty)
    mesh = tool.Mesh(once.vertices.astype(np.float32), once.triangles.astype(np.uint32))
    mesh.merge()
    solid = tool.Manifold(mesh)
    if solid.status() != tool.Error.NoError:
        raise RuntimeError(str(solid.status()))
    out = solid.to_mesh()
    return Triangulation(
        np.asarray(out.vert_properties)[:, :3].astype(float), np.asarray(out.tri_verts).astype(np.int64)
    )


def trueform(dirty: Triangulation, name: str) -> Triangulation:
    import trueform as tool

    once = welded(dirty)
    shell = tool.outer_shell(tool.Mesh(once.triangles.astype(np.int32), once.vertices.astype(np.float32)))
    points, faces = (shell.points, shell.faces) if hasattr(shell, "points") else (shell[1], shell[0])
    return Triangulation(np.asarray(points, dtype=float), np.asarray(faces).astype(np.int64))


Facts = dict[str, Any]
Tool = Callable[[Triangulation, str], Triangulation]
TOOLS: dict[str, tuple[str, Tool]] = {
    "patchwright": ("patchwright", patchwright),
    "patches": ("patchwright", fitted),
    "trimesh": ("trimesh networkx", trimesh),
    "pymeshfix": ("pymeshfix", pymeshfix),
    "alpha wrap": ("pymeshlab", alpha_wrap),
    "manifold3d": ("manifold3d", manifold3d),
    "trueform": ("trueform", trueform),
}
"""Per row the packages it needs and what it does."""


def judge(case: DefectCase, result: Triangulation) -> Facts:
    """What is measured on one result; its vertices at one place are one first."""
    from patchwright.repair.mender.crossings import crossing_pairs

    body = welded(result)
    size = case.triangulation.diagonal
    if not len(body):
        return {"empty": True}
    adjacency = Adjacency.of(body)
    points = np.concatenate([case.kept.vertices, case.kept.corners.mean(axis=1)])
    return {
        "empty": False,
        "closed": bool((adjacency.use_count == 2).all()),
        "oriented": not bool(adjacency.inconsistent.any()),
        "components": int(adjacency.components().max()) + 1,
        "euler": len(np.unique(body.triangles)) - len(adjacency.edges) + len(body) - case.euler,
        "crossing": len(crossing_pairs(body, 1e-9 * size)),
        "volume": abs(abs(body.volume) / case.volume - 1.0),
        "deviation": float(Tree.of(body).closest(points).distance.max()) / size,
    }


def cell(found: Facts, smooth: bool) -> str:
    """One word per case, or what is wrong with it."""
    if found.get("fail"):
        return "FAIL"
    if found["empty"]:
        return "EMPTY"
    words = []
    if not found["closed"]:
        words.append("OPEN")
    if not found["oriented"]:
        words.append("turned")
    if found["components"] != 1:
        words.append(f"{found['components']}c")
    elif found["euler"] and found["closed"]:
        words.append("genus")
    if found["crossing"]:
        words.append(f"{found['crossing']}x")
    if not smooth:
        if found["volume"] > 3e-3:
            words.append(f"{100.0 * found['volume']:.1f}%")
        if found["deviation"] > 1e-4:
            words.append(f"d{found['deviation']:.0e}")
    elif not words:
        words.append(f"ok {100.0 * found['volume']:.1f}% d{found['deviation']:.0e}")
    return " ".join(words) or "ok"


def judged(tool: str, shape: str, seed: int, size: float) -> dict[str, Facts]:
    """`judge` on a tool's results by case, in a process of its own; what it does not come to is missing."""
    command = [sys.executable, __file__, "--row", json.dumps([tool, shape, seed, size])]
    try:
        out = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT).stdout
    except subprocess.TimeoutExpired as late:
        out = late.stdout.decode() if isinstance(late.stdout, bytes) else ""
    return dict(json.loads(line[4:]) for line in out.splitlines() if line.startswith("ROW "))


def row(tool: str, shape: str, seed: int, size: float) -> None:
    """Print a line per case as soon as it is judged."""
    for name, case in eight_defects(shape, seed=seed, size=size).items():
        try:
            found = judge(case, TOOLS[tool][1](case.triangulation, name))
        except Exception as error:  # noqa: BLE001  (a peer may raise anything: that is its result)
            found = {"fail": True, "why": f"{type(error).__name__}: {error}"}
        print("ROW " + json.dumps([name, found]), flush=True)


def installed(packages: str) -> bool:
    from importlib.util import find_spec

    return all(find_spec(package) is not None for package in packages.split())


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--shape", choices=[*SHAPES, "all"], default="sphere")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--size", type=float, default=1.0)
    arguments.add_argument("--tools", nargs="*", choices=list(TOOLS))
    arguments.add_argument("--patches", action="store_true", help="judge a tessellation of the fitted patches too")
    arguments.add_argument("--row", help=argparse.SUPPRESS)
    asked = arguments.parse_args()
    if asked.row:
        row(*json.loads(asked.row))
        return
    tools = asked.tools or [t for t in TOOLS if t != "patches" or asked.patches]
    tools = [t for t in tools if installed(TOOLS[t][0])]
    for shape in SHAPES if asked.shape == "all" else [asked.shape]:
        names = list(eight_defects(shape, seed=asked.seed, size=asked.size))
        print(f"\n{shape}, seed {asked.seed}, size {asked.size:g}")
        print(f"{'tool':12s} " + " ".join(f"{name:>18s}" for name in names) + "   right  seconds")
        for tool in tools:
            start = time.perf_counter()
            found = judged(tool, shape, asked.seed, asked.size)
            cells = [cell(found.get(name, {"fail": True}), tool == "patches") for name in names]
            right = sum(c.startswith("ok") for c in cells)
            spent = time.perf_counter() - start
            print(f"{tool:12s} " + " ".join(f"{c:>18s}" for c in cells) + f"   {right} of 8  {spent:6.1f}", flush=True)


if __name__ == "__main__":
    main()
