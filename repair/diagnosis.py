"""`Defect` and `Diagnosis`: what is wrong with a model, where, how large and in which parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from patchwright.models.arrays import Array, frozen
from patchwright.repair.fingerprint import Fingerprint, fingerprint

Severity = Literal["error", "warning", "info"]

KINDS: tuple[str, ...] = (
    "open-edge",
    "non-manifold-edge",
    "duplicate-face",
    "degenerate-face",
    "needle",
    "flipped",
    "gap",
    "opening",
    "overlap",
    "t-junction",
    "self-intersection",
    "component",
    "thin",
    "invalid-face",
    "loose-tolerance",
    "seam-gap",
    "seam-angle",
    "parametrisation",
    "far-field",
    "unit",
)


@dataclass(frozen=True, slots=True, eq=False)
class Defect:
    """One connected region of one kind of defect.

    Parameters
    ----------
    kind : one of `KINDS`; a hole (missing triangles) is a "gap" whose message says so
    severity : "error" must be mended, "warning" should be looked at, "info" is a fact worth knowing
    where : (3,) middle of the region, model length unit
    size : its extent: the diagonal of `box`, or the length the message names (a gap's width, an opening's diameter)
    parts : names of the parts it lies in
    count : how many edges, triangles or faces it is made of
    message : one sentence with numbers
    box : (2, 3) its bounding box
    id : "kind-hash", unique in its diagnosis and the same for the same place in a re-ordered model (`fingerprint`)
    curves : polylines (n, 3) where surfaces cross, for crossings; none otherwise
    """

    kind: str
    severity: Severity
    where: Array
    size: float
    parts: tuple[str, ...]
    count: int
    message: str
    box: Array
    id: str = ""
    curves: tuple[Array, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "where", frozen(self.where, np.float64))
        object.__setattr__(self, "box", frozen(self.box, np.float64))
        object.__setattr__(self, "curves", tuple(frozen(points, np.float64) for points in self.curves))

    @property
    def fingerprint(self) -> Fingerprint:
        """What it is known by again in a revised model."""
        return fingerprint(self.kind, self.where, self.size, self.parts)

    def to_json(self) -> dict[str, Any]:
        """The same as plain values."""
        return {
            "id": self.id,
            "kind": self.kind,
            "severity": self.severity,
            "where": self.where.tolist(),
            "size": float(self.size),
            "parts": list(self.parts),
            "count": int(self.count),
            "message": self.message,
            "box": self.box.tolist(),
            **({"curves": [points.tolist() for points in self.curves]} if self.curves else {}),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """Everything found in a model.

    Parameters
    ----------
    defects : errors first, then warnings, then facts; larger regions first within a kind
    summary : plain values by name: the counts before any repair, the free-edge curve, volume, watertightness
    """

    defects: tuple[Defect, ...]
    summary: Mapping[str, Any] = field(default_factory=dict)

    @property
    def clean(self) -> bool:
        """True when nothing is worse than "info".

        A kept opening is a "warning", so an open model is not clean: whether the opening is meant is the user's to say.
        """
        return all(defect.severity == "info" for defect in self.defects)

    @property
    def counts(self) -> dict[str, int]:
        """How many defects (regions) there are of each kind found."""
        return dict(Counter(defect.kind for defect in self.defects))

    def of(self, *kinds: str) -> tuple[Defect, ...]:
        """The defects of some kinds."""
        return tuple(defect for defect in self.defects if defect.kind in kinds)

    def to_json(self) -> dict[str, Any]:
        """Plain values only: fit for `json.dumps(..., allow_nan=False)`."""
        return {
            "clean": self.clean,
            "counts": self.counts,
            "summary": dict(self.summary),
            "defects": [defect.to_json() for defect in self.defects],
        }
