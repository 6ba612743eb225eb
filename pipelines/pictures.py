"""The pictures of a repair: before with its defects marked, after by rung, the deviation map."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.triangulation import Triangulation
from patchwright.pipelines.progress import Report
from patchwright.pipelines.scenes import Scene, draw_scenes
from patchwright.pipelines.study import Study
from patchwright.repair.result import Repaired, Rung, Verdict

MARKED = ("error", "warning")
KEPT_COLOUR, PATCH_COLOUR, INVENTED_COLOUR = (184, 196, 208), (122, 166, 194), (226, 140, 60)
MOST_DRAWN = 400_000  # triangles; a finer model is drawn from every k-th patch point
MOST_SPOTS = 6


def draw(study: Study, report: Report) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Draw the pictures of a study into its folder.

    Returns
    -------
    (file names, notes): the notes hold one sentence where there is no picture to be had.
    """
    report("drawing", 0.2)
    scenes = [_before(study)]
    scenes += _spots(study)
    if study.repaired is not None and study.repaired.verdict is not Verdict.REFUSED:
        scenes += _after(study, study.repaired)
    else:
        (study.folder / "after.png").unlink(missing_ok=True)
    sentence = draw_scenes(scenes)
    names = tuple(s.path.name for s in scenes if s.path.exists())
    return names, () if sentence is None else (sentence,)


def _before(study: Study) -> Scene:
    body = _welded(study)
    scene = Scene(study.folder / "before.png", f"before: {Path(study.source).name}", body.bounds)
    scene.surface(body)
    if study.before is not None:
        scene.lines(free_edges(body), colour="#c03030", width=2.5)
        where = [d.where for d in study.before.defects if d.severity in MARKED]
        scene.points(np.array(where, dtype=np.float64).reshape(-1, 3), colour="#c03030", width=8.0)
    return scene


def _welded(study: Study) -> Triangulation:
    """The input with its round-off welded: in a soup every edge is free, and a picture of them all shows nothing."""
    from patchwright.repair.mender.weld import weld, weld_distance

    body = _without_far_field(study)
    return weld(body, weld_distance(body, study.tolerance)[0]).triangulation


def _without_far_field(study: Study) -> Triangulation:
    """The input without the parts that bound the domain, beside which the model would be a dot."""
    body = study.assembly.triangulation
    far = [name for d in (study.before.defects if study.before else ()) if d.kind == "far-field" for name in d.parts]
    if not far or body.tags is None:
        return body
    keep = ~np.isin(np.array(body.tag_names)[body.tags], far)
    return body.take(keep).compact() if keep.any() else body


def _spots(study: Study) -> list[Scene]:
    """Close-ups of the gravest defects, one file each."""
    for old in study.folder.glob("defect-*.png"):
        old.unlink()
    if study.before is None:
        return []
    body = _welded(study)
    edges = free_edges(body)
    marked = [d for d in study.before.defects if d.severity in MARKED]
    spread: list[int] = []
    for kind in dict.fromkeys(d.kind for d in marked):  # one of each kind first, the largest
        own = [i for i, d in enumerate(marked) if d.kind == kind]
        spread.append(max(own, key=lambda i: marked[i].size))
    scenes = []
    for number, i in enumerate(spread[:MOST_SPOTS], start=1):
        defect = marked[i]
        reach = min(max(1.5 * defect.size, 0.02 * body.diagonal), 0.5 * body.diagonal)
        where = np.asarray(defect.where)
        box = np.stack([where - reach / 2, where + reach / 2])
        near = (np.abs(body.corners.mean(axis=1) - where) < 1.5 * reach).all(axis=1)
        scene = Scene(study.folder / f"defect-{number}.png", f"{defect.kind} at {_coordinates(where)}", box)
        scene.surface(body.take(near).compact(), edges=True)
        if len(edges):
            scene.lines(
                edges[(np.abs(edges.mean(axis=1) - where) < 1.5 * reach).all(axis=1)], colour="#c03030", width=3.0
            )
        scene.points(where[None], colour="#c03030", width=14.0)
        scenes.append(scene)
    return scenes


def _coordinates(where: Array) -> str:
    return "(" + ", ".join(f"{x:.5g}" for x in where) + ")"


def _after(study: Study, repaired: Repaired) -> list[Scene]:
    body, colours, borders = output_surface(repaired)
    scene = Scene(study.folder / "after.png", f"after: {repaired.verdict.value}", body.bounds)
    scene.surface(body, colours=colours)
    scene.lines(joints(repaired), colour="#8fa9bd", width=0.8).lines(borders, colour="#33475a", width=1.4)
    scenes = [scene]
    if repaired.network is not None and repaired.deviation is not None:
        from patchwright.models.tree import Tree

        # corners of the drawn triangles lie on the patches, their middles below them
        distance = Tree.of(study.assembly.triangulation).closest(body.vertices).distance[body.triangles].mean(axis=1)
        bar = "distance to the input"
        limit = [0.0, max(2.0 * repaired.deviation.output_to_input.tolerance, 1e-300)]
        deviation = Scene(study.folder / "deviation.png", "deviation from the input", body.bounds)
        scenes.append(deviation.surface(body, values=distance, range=limit, bar=bar))
    return scenes


def output_surface(repaired: Repaired) -> tuple[Triangulation, Any, Array]:
    """Triangles of the output, their colours by rung, and the borders of the faces as segments (k, 2, 3)."""
    if repaired.network is None:
        body = repaired.triangulation
        colours = np.tile(np.array(KEPT_COLOUR, dtype=np.uint8), (len(body), 1))
        if body.tags is not None and len(repaired.faces) == len(body.tag_names):
            kept = np.array([f.rung in (Rung.KEEP, Rung.WELD) for f in repaired.faces])
            colours[~kept[body.tags]] = INVENTED_COLOUR
        return body, colours, face_borders(body)
    network = repaired.network
    intervals = int(np.clip(np.sqrt(MOST_DRAWN / (2 * len(network))), 4, 12)) // 4 * 4
    body = network.tessellate(intervals)
    from patchwright.repair.mesh_route import network_invented

    colours = np.tile(np.array(PATCH_COLOUR, dtype=np.uint8), (len(body), 1))
    colours[network_invented(network, body)] = INVENTED_COLOUR
    return body, colours, _edge_segments(repaired, joined=False)


def joints(repaired: Repaired) -> Array:
    """(k, 2, 3) segments along the joints of patches inside the faces."""
    return _edge_segments(repaired, joined=True) if repaired.network is not None else np.zeros((0, 2, 3))


def _edge_segments(repaired: Repaired, *, joined: bool) -> Array:
    """(k, 2, 3) along the seams of fitted patches that lie inside faces, or between them."""
    assert repaired.network is not None
    inside = np.array([len(seam.faces) == 2 and seam.faces[0] == seam.faces[1] for seam in repaired.seams])
    along = repaired.network.edges.sample(9)[inside == joined]
    return np.stack([along[:, :-1], along[:, 1:]], axis=2).reshape(-1, 2, 3)


def free_edges(body: Triangulation) -> Array:
    """(k, 2, 3) edges one triangle uses, vertices at the same place counted as one."""
    from patchwright.models.adjacency import Adjacency

    places, where = np.unique(body.vertices, axis=0, return_inverse=True)
    merged = where.reshape(-1)[body.triangles]
    adjacency = Adjacency.of(Triangulation(places, merged))
    return np.asarray(places[adjacency.edges[adjacency.free]])


def face_borders(body: Triangulation) -> Array:
    """(k, 2, 3) edges between triangles of different tags, and free edges."""
    from patchwright.models.adjacency import Adjacency

    places, where = np.unique(body.vertices, axis=0, return_inverse=True)
    merged = Triangulation(places, where.reshape(-1)[body.triangles])
    adjacency = Adjacency.of(merged)
    border = adjacency.free.copy()
    if body.tags is not None:
        low = np.full(len(adjacency.edges), np.iinfo(np.int64).max)
        high = np.full(len(adjacency.edges), -1)
        for k in range(3):
            np.minimum.at(low, adjacency.triangle_edges[:, k], body.tags)
            np.maximum.at(high, adjacency.triangle_edges[:, k], body.tags)
        border |= low != high
    return np.asarray(places[adjacency.edges[border]])
