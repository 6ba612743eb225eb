"""CAD faces that pass through each other or themselves, bodies in others, faces that fold: found on the tessellation.

Two faces cross when their triangles do so deeper somewhere than the tessellation strays from the true surfaces: chords
of curved faces that merely meet are no crossings, and crossings that are shallow all along are not seen.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.assembly import Part
from patchwright.models.triangulation import Triangulation
from patchwright.repair.cad.bodies import body_labels, closed_bodies, engulfed
from patchwright.repair.cad.sag import sags
from patchwright.repair.checks.crossing_curves import crossing_curves, total_length
from patchwright.repair.checks.examination import Examination, box_of
from patchwright.repair.checks.regions import plural
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.diagnosis import Defect

SURE = 3.0  # times the sag of both faces' triangles: deeper is a crossing of the surfaces themselves
SAMPLES = 1_000  # points of a body that are looked for inside others
STEPS = 65  # places between two triangles where the true normal is looked at
ROUND = -0.9  # cosine: between two such places it turns round
VANISHING = 0.1  # of its usual length
FOLD = -0.5  # cosine: neighbouring triangles of one face that turn by more than 120 degrees


@check("cad-crossings", looks="cad", kinds=("self-intersection", "overlap", "parametrisation"))
def cad_crossings(exam: Examination) -> Finding:
    """Bodies that overlap, faces of one body that cross, faces that cross or fold over themselves."""
    mesh, faces = exam.merged, exam.raw.tags
    if faces is None or len(mesh) < 2:
        return Finding()
    sag = sags(exam.assembly)
    pairs = exam.tessellation_crossings
    key = np.sort(faces[pairs], axis=1)
    deep = _depth(mesh, pairs) > SURE * sag[key].sum(axis=1) + exam.tolerance.gap
    which = np.unique(key, axis=0, return_inverse=True)[1].reshape(-1)
    real = np.bincount(which, weights=deep)[which] > 0
    pairs, key = pairs[real], key[real]
    body = body_labels(exam.assembly)
    over = body[key[:, 0]] != body[key[:, 1]]
    depth = SURE * float(sag.max(initial=0.0)) + exam.tolerance.gap
    defects = [
        *_engulfed(exam, body, {(int(a), int(b)) for a, b in body[key[over]]}, depth),
        *_crossing(exam, mesh, pairs[over], np.sort(body[faces[pairs[over]]], axis=1), "overlap"),
        *_crossing(exam, mesh, pairs[~over], key[~over], "self-intersection"),
        *_folds(exam, faces),
    ]
    return Finding(tuple(defects), {"crossing_faces": len(np.unique(key)), "largest_sag": float(sag.max(initial=0.0))})


def _depth(mesh: Triangulation, pairs: IntArray) -> Array:
    """(k,) how far the corners of one triangle of a pair reach to both sides of the other's plane, the larger way."""
    corners, normals = mesh.corners, mesh.normals
    depth = np.zeros(len(pairs))
    for one, other in ((0, 1), (1, 0)):
        a, b = pairs[:, one], pairs[:, other]
        height = np.einsum("kcj,kj->kc", corners[b] - corners[a][:, :1], normals[a])
        depth = np.maximum(depth, np.minimum(height.max(axis=1), -height.min(axis=1)))
    return depth


def _engulfed(exam: Examination, label: IntArray, crossing: set[tuple[int, int]], depth: float) -> list[Defect]:
    """Closed bodies one of which reaches into the other although their faces do not cross, or lies in it whole."""
    bodies = closed_bodies(exam.assembly)
    number = {int(label[body[0]]): i for i, body in enumerate(bodies)}
    known = {(number[a], number[b]) for a, b in crossing if a in number and b in number}
    found = engulfed(exam.assembly, bodies, known, depth, SAMPLES)
    defects = []
    for (a, b), (points, share) in found.items():
        if a > b and (b, a) in found:
            continue  # told already, the other way round
        box = box_of(points)
        names = tuple(dict.fromkeys(exam.assembly.parts[body[0]].name for body in (bodies[a], bodies[b])))
        what = "a body lies inside another" if share == 1.0 else f"bodies overlap: {share:.0%} of one lies in the other"
        message = f"{what}: the bodies of {' and '.join(names)}"
        size = float(np.linalg.norm(box[1] - box[0]))
        defects.append(Defect("overlap", "error", box.mean(axis=0), size, names, len(points), message, box))
    return defects


def _crossing(exam: Examination, mesh: Triangulation, pairs: IntArray, key: IntArray, kind: str) -> list[Defect]:
    """One defect per pair of bodies or faces, with the curves they cross in."""
    if not len(pairs):
        return []
    which = np.unique(key, axis=0, return_inverse=True)[1].reshape(-1)
    curves = crossing_curves(mesh, pairs, which)
    corners = mesh.corners
    found = []
    for k in range(int(which.max()) + 1):
        triangles = np.unique(pairs[which == k])
        box = box_of(corners[triangles])
        size = float(np.linalg.norm(box[1] - box[0]))
        parts = exam.parts_of(triangles)
        faces = len(np.unique(exam.raw.tags[triangles])) if exam.raw.tags is not None else 1
        what = (
            "bodies overlap" if kind == "overlap" else "a face passes through itself" if faces == 1 else "faces cross"
        )
        message = (
            f"{what}: {', '.join(parts[:4])}, along {plural(len(curves[k]), 'curve')}, "
            f"{exam.length(total_length(curves[k]))} long"
        )
        found.append(Defect(kind, "error", box.mean(axis=0), size, parts, faces, message, box, curves=curves[k]))
    return found


def _folds(exam: Examination, faces: IntArray) -> list[Defect]:
    """Faces whose triangles turn back on their neighbours: the surface folds over itself within its parameters."""
    adjacency = Adjacency.of(exam.merged.take(exam.merged_index))
    normals, face = exam.merged.normals[exam.merged_index], faces[exam.merged_index]
    neighbours = adjacency.neighbours
    i, k = np.nonzero(neighbours >= 0)
    j = neighbours[i, k]
    turn = np.einsum("ij,ij->i", normals[i], normals[j])
    back: BoolArray = (turn < FOLD) & (face[i] == face[j]) & normals[i].any(axis=1) & normals[j].any(axis=1)
    found = []
    for one in np.unique(face[i[back]]):
        part = exam.assembly.parts[int(one)]
        own = np.flatnonzero(back & (face[i] == one))
        start = int(np.searchsorted(faces, one))
        local = exam.merged_index[np.stack([i[own], j[own]], axis=1)] - start
        own = own[_folded(part, local)]
        if not len(own):
            continue
        triangles = np.unique(exam.merged_index[i[own]])
        box = box_of(exam.merged.corners[triangles])
        size = float(np.linalg.norm(box[1] - box[0]))
        name = part.name or f"face {int(one) + 1}"
        message = f"{name} (face {int(one) + 1}) folds back over itself along {exam.length(size)}"
        found.append(
            Defect("parametrisation", "error", box.mean(axis=0), size, (part.name,), len(triangles), message, box)
        )
    return found


def _folded(part: Part, pairs: IntArray) -> BoolArray:
    """(k,) pairs of a face's triangles between which its normal turns round at one place where it vanishes.

    That is a fold. A narrow bend turns it gradually, a sharp edge without making it vanish.
    """
    uv = part.triangulation.uv
    if part.surface is None or uv is None:
        return np.zeros(len(pairs), dtype=np.bool_)
    middle = uv.mean(axis=1)
    share = np.linspace(0.0, 1.0, STEPS)[None, :, None]
    way = middle[pairs[:, :1]] * (1.0 - share) + middle[pairs[:, 1:]] * share
    u, v = way[..., 0], way[..., 1]
    normal = np.cross(part.surface(u, v, (1, 0)), part.surface(u, v, (0, 1)))
    size = np.linalg.norm(normal, axis=2)
    unit = normal / np.maximum(size, np.finfo(float).tiny)[..., None]
    flips = np.einsum("ksj,ksj->ks", unit[:, 1:], unit[:, :-1]) < ROUND
    vanishing = np.minimum(size[:, 1:], size[:, :-1]) < VANISHING * np.median(size, axis=1)[:, None]
    return np.asarray((flips & vanishing).any(axis=1))
