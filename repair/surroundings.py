"""`Surroundings`: a domain resolved on a model: the triangles that bound it from outside, and its symmetry planes.

What the user does not say is guessed, each guess with a reason. A guessed far field is taken out of what tolerances are
born from and left as it came; a guessed symmetry plane is only told. What the user names is acted upon.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.domain import AXES, Domain

FAR = 4.0  # times the diagonal of everything else: a body that large around it is a far field
SCALED = 200.0  # times: larger still, a thing of the model's own size in another unit is likelier
OPEN = 0.6  # of the area: where area vectors add up to more, there is an open sheet
TOUCH, PROBES = 1e-3, 1000  # of the smaller thing's diagonal: so near it lies on the larger one; triangles looked at
PLANE = 1e-5  # of the diagonal: how flat a symmetry plane's rim or face is


@dataclass(frozen=True, slots=True)
class SymmetryPlane:
    """The plane where one coordinate has one value; `given` when the user named it, `part` the part it is, if any."""

    axis: int
    value: float
    given: bool
    part: str = ""
    reason: str = ""

    @property
    def name(self) -> str:
        """ "y = 0" and the like."""
        return f"{AXES[self.axis]} = {self.value:.6g}"


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """A domain as it lies round one model.

    Parameters
    ----------
    domain : what the user said
    aside : (m,) triangles of `assembly.triangulation` that bound the domain from outside and are no part of the body
    far_field : names of the parts the far field's triangles lie in
    planes : the symmetry planes the user named
    reasons : one sentence per decision
    """

    domain: Domain
    aside: BoolArray
    far_field: tuple[str, ...] = ()
    planes: tuple[SymmetryPlane, ...] = ()
    reasons: tuple[str, ...] = ()

    def body(self, model: Assembly) -> Assembly:
        """A triangulated model without what bounds the domain; parts that are nothing else go."""
        if not self.aside.any():
            return model
        parts, start = [], 0
        for part in model.parts:
            keep = ~self.aside[start : start + len(part.triangulation)]
            start += len(keep)
            if keep.all() or not len(keep):
                parts.append(part)
            elif keep.any():
                parts.append(replace(part, triangulation=part.triangulation.take(keep).compact()))
        return replace(model, parts=tuple(parts), topology=None, native=None)

    def body_size(self, model: Assembly) -> Assembly | Triangulation:
        """What tolerances are born from: the model without what bounds the domain."""
        if not self.aside.any() or self.aside.all():
            return model
        return model.triangulation.take(~self.aside).compact()

    def planned(self, points: Array, near: float) -> str:
        """Why a rim through these points (n, 3) is meant to stay open; "" when nothing says so.

        `near` is the distance up to which a point is on a symmetry plane.
        """
        for plane in self.planes:
            if (np.abs(points[:, plane.axis] - plane.value) <= near).all():
                return f"it lies in the symmetry plane {plane.name}"
        low, high = points.min(axis=0), points.max(axis=0)
        reach = 0.5 * float(np.linalg.norm(high - low))
        for place in self.domain.openings:
            if np.linalg.norm(np.asarray(place) - 0.5 * (low + high)) <= reach:
                x, y, z = place
                return f"it was named at ({x:.6g}, {y:.6g}, {z:.6g})"
        return ""

    def keeps_gaps(self, parts: Iterable[str]) -> str:
        """Why a gap along these parts stays; "" when it is to be mended."""
        kept = [name for name in parts if self.domain.gaps.get(name) == "keep"]
        return f"gaps along {', '.join(kept)} are kept as they were told to be" if kept else ""


def surroundings(model: Assembly, domain: Domain | None = None) -> Surroundings:
    """Resolve a domain on a model.

    Raises
    ------
    ParameterError : a name no part has, a symmetry part that is not planar, everything named far field.
    """
    domain = domain or Domain()
    mesh = model.triangulation
    aside = np.zeros(len(mesh), dtype=np.bool_)
    reasons: list[str] = []
    for names, what in ((domain.gaps, "gap policy"), (domain.tolerances, "tolerance")):
        for name in names:
            _tags(model, name, what)
    far: tuple[str, ...] = ()
    if domain.far_field is not None:
        for name in domain.far_field:
            aside |= np.isin(_tagged(mesh), _tags(model, name, "far field"))
            reasons.append(f"{name} is far field: it was named so")
        far = domain.far_field
    planes = []
    for word in domain.symmetry or ():
        plane, own = _plane(model, word)
        planes.append(plane)
        aside |= own
        reasons.append(f"{plane.name} is a symmetry plane: {plane.reason}")
    if domain.fluid is not None:
        shells = pieces_of(mesh, model.diagonal * PLANE if model.is_cad else 0.0)
        round_it = _around(mesh, shells, np.asarray(domain.fluid))
        aside |= round_it
        if round_it.any():
            count = len(np.unique(shells.label[round_it]))
            bodies = "1 body bounds" if count == 1 else f"{count} bodies bound"
            reasons.append(f"{bodies} the fluid from outside: the fluid point lies inside")
    if domain.far_field is None:
        pieces = faces_of(mesh) if model.is_cad else _by_part(mesh, pieces_of(mesh, 0.0))
        outer, reason = far_pieces(pieces.low, pieces.high)
        guessed = np.isin(pieces.label, outer)
        if len(outer) and _is_body(mesh, guessed):
            aside |= guessed
            far = tuple(model.names[k] for k in np.unique(_tagged(mesh)[guessed]))
            reasons.append(f"{', '.join(far) or 'a piece'} taken for a far field: {reason}")
    if len(aside) and aside.all():
        raise ParameterError("everything is named far field or symmetry plane: no body is left to work on")
    return Surroundings(domain, aside, far, tuple(planes), tuple(reasons))


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """CAD faces, or components connected through edges: (m,) label of each triangle, (p, 3) corners of the boxes."""

    label: IntArray
    low: Array
    high: Array


def pieces_of(mesh: Triangulation, distance: float) -> Pieces:
    """The components of a triangulation whose vertices within a distance are one."""
    from patchwright.repair.mender.weld import weld

    if not len(mesh):
        return _boxed(mesh, np.zeros(0, dtype=np.int64))
    return _boxed(mesh, np.asarray(Adjacency.of(weld(mesh, distance).triangulation).components(), dtype=np.int64))


def faces_of(mesh: Triangulation) -> Pieces:
    """The parts of a tagged triangulation that have triangles."""
    return _boxed(mesh, np.unique(_tagged(mesh), return_inverse=True)[1].reshape(-1).astype(np.int64))


def _by_part(mesh: Triangulation, pieces: Pieces) -> Pieces:
    """The pieces split where parts meet: a half model may be connected with its symmetry plane and far field."""
    tags = _tagged(mesh)
    if not len(mesh) or (tags == tags[0]).all():
        return pieces
    pairs = pieces.label * (int(tags.max()) + 1) + tags
    return _boxed(mesh, np.unique(pairs, return_inverse=True)[1].reshape(-1).astype(np.int64))


def _boxed(mesh: Triangulation, label: IntArray) -> Pieces:
    if not len(mesh):
        return Pieces(label, np.zeros((0, 3)), np.zeros((0, 3)))
    from patchwright.repair.mender._rims_kernel import boxes_of

    boxes = boxes_of(mesh.vertices, mesh.triangles, label, int(label.max()) + 1)
    return Pieces(label, boxes[:, :3].copy(), boxes[:, 3:].copy())


def far_pieces(low: Array, high: Array) -> tuple[IntArray, str]:
    """Pieces (by index) that reach far around all smaller ones: split by size where the size jumps most.

    Parameters
    ----------
    low, high : (p, 3) the pieces' boxes

    Returns
    -------
    The far pieces, none where nothing looks like a far field, and the reason in words.
    """
    nothing = np.zeros(0, dtype=np.int64)
    if len(low) < 2:
        return nothing, ""
    size = np.linalg.norm(high - low, axis=1)
    order = np.argsort(size)
    # what the pieces up to each size span together
    reach_low = np.minimum.accumulate(low[order])
    reach_high = np.maximum.accumulate(high[order])
    inner = np.linalg.norm(reach_high - reach_low, axis=1)
    jump = size[order][1:] / np.maximum(inner[:-1], np.finfo(float).tiny)
    k = int(np.argmax(jump))
    if not FAR <= jump[k] < SCALED:
        return nothing, ""
    outer = order[k + 1 :]
    outer_low, outer_high = low[outer].min(axis=0), high[outer].max(axis=0)
    reach = float(np.linalg.norm(outer_high - outer_low))
    slack = PLANE * reach
    if (reach_low[k] < outer_low - slack).any() or (reach_high[k] > outer_high + slack).any():
        return nothing, ""
    reason = f"{len(outer)} of {len(size)} pieces reach {reach:.3g} around a model of {inner[k]:.3g}"
    return outer.astype(np.int64), reason


def _is_body(mesh: Triangulation, outer: BoolArray) -> bool:
    """Whether the triangles that are not `outer` bound a body: a loose scrap of a large surface has none around it.

    The area vectors of a closed surface cancel, those of half a ball are half its area; and a body in a flow does not
    lie on what bounds that from outside.
    """
    inner = np.flatnonzero(~outer)
    vectors = mesh.take(inner).area_vectors
    if np.linalg.norm(vectors.sum(axis=0)) > OPEN * np.linalg.norm(vectors, axis=1).sum():
        return False
    some = inner[np.unique(np.linspace(0, len(inner) - 1, PROBES).astype(np.int64))]
    points = mesh.corners[some].reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(mesh.vertices[mesh.triangles[inner]].reshape(-1, 3), axis=0)))
    near = Tree.of(mesh.take(np.flatnonzero(outer))).closest(points).distance <= TOUCH * size
    return bool(near.mean() <= 0.5)


def _tagged(mesh: Triangulation) -> IntArray:
    """(m,) the part each triangle of an assembly's triangulation belongs to."""
    return np.zeros(len(mesh), dtype=np.int64) if mesh.tags is None else mesh.tags


def _tags(model: Assembly, name: str, what: str) -> IntArray:
    """Indices of the parts with a name, or of the faces of a body with it."""
    own = [i for i, part in enumerate(model.parts) if name and name in (part.name, part.body)]
    if not own:
        known = ", ".join(dict.fromkeys(n for n in model.names if n)) or "none (the file names no parts)"
        raise ParameterError(f"{what}: no part is called {name!r}; the parts are {known}")
    return np.array(own, dtype=np.int64)


def _plane(model: Assembly, word: str) -> tuple[SymmetryPlane, BoolArray]:
    """The plane of a word, and the triangles of the part it names."""
    mesh = model.triangulation
    if word in AXES and word not in model.names:
        axis = AXES.index(word)
        return SymmetryPlane(axis, 0.0, True, reason="it was named so"), np.zeros(len(mesh), dtype=np.bool_)
    if word not in model.names and not any(word == part.body for part in model.parts):
        known = ", ".join((*AXES, *dict.fromkeys(n for n in model.names if n)))
        raise ParameterError(f"symmetry: {word!r} is neither x, y, z nor a part; known are {known}")
    own = np.isin(_tagged(mesh), _tags(model, word, "symmetry"))
    corners = mesh.corners[own].reshape(-1, 3)
    if not len(corners):
        raise ParameterError(f"symmetry: part {word!r} has no triangles to take a plane from")
    spread = np.ptp(corners, axis=0)
    axis = int(np.argmin(spread))
    if spread[axis] > PLANE * mesh.diagonal:
        raise ParameterError(
            f"symmetry: part {word!r} does not lie in a coordinate plane: it is {spread[axis]:.3g} deep along "
            f"{AXES[axis]}; turn the model so that its symmetry plane is one"
        )
    value = float(np.median(corners[:, axis]))
    near = abs(value) <= PLANE * mesh.diagonal
    return SymmetryPlane(axis, 0.0 if near else value, True, word, f"it is the plane of {word}"), own


def _around(mesh: Triangulation, pieces: Pieces, point: Array) -> BoolArray:
    """(m,) triangles of the pieces whose winding number round a point is not zero."""
    from patchwright.repair.mender.untangle import winding

    maybe = ((pieces.low < point) & (point < pieces.high)).all(axis=1)
    around = np.zeros(len(mesh), dtype=np.bool_)
    corners = mesh.corners
    for k in np.flatnonzero(maybe):
        own = pieces.label == k
        if abs(winding(corners[own], point)) > 0.5:
            around |= own
    return around
