"""Random dirty assemblies through the mender: no crash, no hang, and the answer judged by the shapes it was made of.

    python tests/fuzz_repair.py --cases 300 --seed 0

One to four closed bodies, overlapping, apart or inside one another, are damaged by a random choice of injectors. Each
case runs in a child process; one that takes longer than the limit or dies is counted and the child replaced. Judged: a
result is closed, consistently oriented and crosses itself nowhere, and winding numbers say inside and outside as the
undamaged bodies do at points that lie farther from these than the damage reaches. Refusals are counted, and results
with planar rims that were taken for planned openings and said to be kept.
"""

from __future__ import annotations

import argparse
import multiprocessing
import queue
import time
from collections import Counter
from functools import partial
from typing import Any

import numpy as np
import trimesh

from patchwright.models.adjacency import Adjacency
from patchwright.models.errors import GeometryError
from patchwright.models.samples import damage, duplicated, flipped, missing_triangles, needles, slit, unmerged
from patchwright.models.samples.splitting import degenerate, t_junctions
from patchwright.models.tolerance import Tolerance
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.models.winding import winding_number
from patchwright.repair.mender._clean_kernel import triangle_heights
from patchwright.repair.mender.mend import mend
from patchwright.ssi.mesh_mesh import mesh_intersection
from patchwright.ssi.mesh_topology import TRANSVERSAL

LIMIT = 120.0  # seconds on the clock for one case
AWAY = 0.012  # of the diagonal: points nearer to an undamaged body are not judged
POINTS = 6000
ROUND_OFF = 1e-10  # of the diagonal: how deep triangles may pass through each other


def bodies(rng: np.random.Generator) -> list[Triangulation]:
    """Closed bodies of about equal size, turned and moved at random."""
    out = []
    for _ in range(rng.integers(1, 5)):
        kind = rng.integers(6)
        if kind == 0:
            mesh = trimesh.creation.box(extents=rng.uniform(0.5, 1.5, 3)).subdivide().subdivide().subdivide()
        elif kind == 1:
            mesh = trimesh.creation.icosphere(subdivisions=3, radius=rng.uniform(0.4, 0.9))
        elif kind == 2:
            mesh = trimesh.creation.cylinder(radius=rng.uniform(0.2, 0.7), height=rng.uniform(0.5, 2), sections=40)
        elif kind == 3:
            mesh = trimesh.creation.torus(major_radius=0.8, minor_radius=rng.uniform(0.1, 0.3))
        elif kind == 4:
            mesh = trimesh.creation.icosphere(subdivisions=3)
            mesh.apply_scale(rng.uniform(0.15, 1.0, 3))
        else:
            mesh = trimesh.creation.capsule(height=rng.uniform(0.3, 1.5), radius=rng.uniform(0.2, 0.5), count=[24, 24])
        if rng.random() < 0.7:
            mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
        mesh.apply_translation(rng.uniform(-0.7, 0.7, 3) if rng.random() < 0.8 else np.round(rng.uniform(-2, 2, 3)))
        out.append(Triangulation(np.asarray(mesh.vertices), np.asarray(mesh.faces)))
    return out


def case(seed: int, index: int) -> tuple[list[Triangulation], Triangulation, str]:
    """The undamaged bodies, the dirty triangulation, and the damage in words."""
    rng = np.random.default_rng((seed, index))
    clean = bodies(rng)
    scale, shift = 10.0 ** rng.uniform(-3, 3), rng.uniform(-5, 5, 3) * (rng.random() < 0.3)
    clean = [Triangulation(scale * (b.vertices + shift), b.triangles) for b in clean]
    offsets = np.cumsum([0] + [len(b.vertices) for b in clean])
    whole = Triangulation(
        np.concatenate([b.vertices for b in clean]),
        np.concatenate([b.triangles + k for b, k in zip(clean, offsets[:-1], strict=True)]),
        tags=np.repeat(np.arange(len(clean)), [len(b) for b in clean]),
        tag_names=tuple(f"body{k}" for k in range(len(clean))),
    )
    size = min(b.diagonal for b in clean)
    normal = rng.normal(size=3)
    cuts = partial(
        slit, point=clean[0].vertices.mean(axis=0), normal=normal, width=10.0 ** rng.uniform(-3, -2) * size,
        only=("body0",),
    )  # fmt: skip
    choices: dict[str, Any] = {
        "slit": cuts, "missing": partial(missing_triangles, share=rng.uniform(0.001, 0.01)),
        "t": partial(t_junctions, share=0.01), "needle": partial(needles, share=0.005),
        "flat": partial(degenerate, share=0.01), "double": partial(duplicated, share=0.01),
        "flip": partial(flipped, share=0.02),
        "soup": partial(unmerged, radius=rng.choice([0.0, 1e-7, 1e-5]) * size),
    }  # fmt: skip
    names = [name for name in choices if rng.random() < 0.35]
    dirty = damage(whole, [choices[name] for name in names], seed=int(rng.integers(2**31)))
    return clean, dirty.triangulation, f"{len(clean)} bodies " + ("+".join(names) or "clean")


def crossings(result: Triangulation) -> int:
    """Pairs of triangles that pass through each other by more than what rounding to double does.

    A triangle no higher than that has no plane to pass through: the direction of its normal is chance.
    """
    found = mesh_intersection(result)
    pairs = found.sources[np.isin(found.sources[:, 0], np.flatnonzero(found.kinds == TRANSVERSAL)), 1:]
    if not len(pairs):
        return 0
    depth = np.full(len(pairs), np.inf)
    for a, b in (pairs.T, pairs.T[::-1]):
        height = np.einsum("ijk,ik->ij", result.corners[a] - result.corners[b][:, :1], result.normals[b])
        flat = triangle_heights(result.vertices, result.triangles[b]) <= ROUND_OFF * result.diagonal
        depth = np.minimum(depth, np.where(flat, 0.0, np.minimum(height.max(axis=1), -height.min(axis=1))))
    return int((depth > ROUND_OFF * result.diagonal).sum())


def judged(clean: list[Triangulation], result: Triangulation, rng: np.random.Generator, rims: int) -> str:
    """What is wrong with a result; "" when nothing is. `rims` edges bound the openings it says it kept."""
    adjacency = Adjacency.of(result)
    if adjacency.free.sum() != rims or adjacency.non_manifold.any():
        return f"{(adjacency.use_count != 2).sum()} edges are not shared by two"
    if adjacency.inconsistent.any():
        return "inconsistent orientation"
    count = crossings(result)
    if count:
        return f"{count} crossings"
    low = np.min([b.bounds[0] for b in clean], axis=0)
    high = np.max([b.bounds[1] for b in clean], axis=0)
    diagonal = float(np.linalg.norm(high - low))
    middle = np.concatenate([b.corners.mean(axis=1) for b in clean])
    normal = np.concatenate([b.normals for b in clean])
    pick = rng.integers(len(middle), size=POINTS // 2)
    near = middle[pick] + normal[pick] * diagonal * rng.uniform(-0.04, 0.04, (len(pick), 1))
    points = np.concatenate([rng.uniform(low, high, (POINTS // 2, 3)), near])
    away = np.min([Tree.of(b).closest(points).distance for b in clean], axis=0) > AWAY * diagonal
    points = points[away]
    wanted = np.any([np.abs(winding_number(b, points)) > 0.5 for b in clean], axis=0)
    got = np.abs(winding_number(result, points)) > 0.5
    wrong = (wanted != got) & (rims == 0)  # beside an opening the winding number is between
    return f"{wrong.sum()} of {len(points)} points on the wrong side" if wrong.any() else ""


def run(seed: int, index: int, answers: Any) -> None:
    """One case, its outcome put into a queue."""
    begin = time.process_time()
    clean, dirty, words = case(seed, index)
    try:
        mended = mend(dirty, Tolerance.of(dirty))
        if mended.problems:
            state, what = "refused", "; ".join(p.message for p in mended.problems)[:150]
        else:
            what = judged(clean, mended.triangulation, np.random.default_rng(index), sum(map(len, mended.openings)))
            state = "wrong" if what else "open" if mended.openings else "right"
    except GeometryError as error:
        state, what = "refused", str(error)[:150]
    except Exception as error:  # noqa: BLE001 - a fault of the program is what this looks for
        state, what = "crash", f"{type(error).__name__}: {error}"[:200]
    answers.put((index, words, state, what, time.process_time() - begin))


def worker(seed: int, jobs: Any, answers: Any) -> None:
    """Cases from a queue until None."""
    while (index := jobs.get()) is not None:
        run(seed, index, answers)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--cases", type=int, default=300)
    arguments.add_argument("--first", type=int, default=0)
    arguments.add_argument("--seed", type=int, default=0)
    asked = arguments.parse_args()
    context = multiprocessing.get_context("spawn")
    counts: Counter[str] = Counter()
    slowest = 0.0
    child: Any = None
    for index in range(asked.first, asked.first + asked.cases):
        if child is None:
            jobs, answers = context.Queue(), context.Queue()
            child = context.Process(target=worker, args=(asked.seed, jobs, answers), daemon=True)
            child.start()
        jobs.put(index)
        end = time.monotonic() + LIMIT
        answer = None
        while answer is None and time.monotonic() < end and child.is_alive():
            try:
                answer = answers.get(timeout=0.5)
            except queue.Empty:  # the child still works, or has died
                continue
        if answer is None:
            state = "hang" if child.is_alive() else "died"
            child.kill()
            child = None
            answer = (index, case(asked.seed, index)[2], state, "", LIMIT)
        counts[answer[2]] += 1
        slowest = max(slowest, answer[4])
        if answer[2] != "right":
            print(f"{answer[0]:5d} {answer[1]:<40} {answer[2]:<8} {answer[3]}", flush=True)  # noqa: T201
    print(", ".join(f"{n} {state}" for state, n in counts.most_common()) + f"; slowest {slowest:.1f} s")  # noqa: T201
    if child is not None:
        jobs.put(None)
        child.join(5)


if __name__ == "__main__":
    main()
