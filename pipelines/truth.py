"""A repaired sample held against what is known of it: distances to the true shape, and the injected defects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.tree import Tree
from patchwright.repair.deviation import sample_area
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.mesh_route import network_invented
from patchwright.repair.patches.tessellation import tessellation_within
from patchwright.repair.result import Repaired

if TYPE_CHECKING:
    from patchwright.models.samples.defects import Injected
    from patchwright.models.samples.truth import Truth

SAMPLES = 40_000
TRUE_CHORD = 1e-5  # of the diagonal: how far the tessellation compared with the truth may stray from the patches
MISSING = ("gap", "opening", "open-edge")  # kinds under which missing surface may be reported


def against_truth(repaired: Repaired, truth: Truth, diagonal: float) -> dict[str, Any]:
    """Distances in shares of the diagonal, both ways, invented surface left out, and the volume's relative error."""
    if repaired.network is None:
        return {}
    body = tessellation_within(repaired.network, TRUE_CHORD * diagonal)
    invented = network_invented(repaired.network, body)
    points, _ = sample_area(body.take(~invented), SAMPLES)
    out: dict[str, Any] = {}
    _spread(out, "result to truth", truth.distance(points) / diagonal)
    wanted = truth.sample(SAMPLES)
    closest = Tree.of(body).closest(wanted.points)
    seen = ~invented[closest.triangle]
    _spread(out, "truth to result", closest.distance[seen] / diagonal)
    out["volume of repaired.stl against truth"] = repaired.triangulation.volume / truth.volume - 1.0
    out["volume of the patches against truth"] = body.volume / truth.volume - 1.0
    return out


def _spread(out: dict[str, Any], label: str, shares: Array) -> None:
    for name, value in zip(
        ("median", "99 %", "largest"), (*np.percentile(shares, [50.0, 99.0]), shares.max()), strict=True
    ):
        out[f"{label}, {name} (of the diagonal)"] = float(value)


def against_injected(
    injected: Sequence[Injected], diagnosis: Diagnosis, repaired: Repaired, jitter: float
) -> dict[str, Any]:
    """Which injected holes and slits the diagnosis names: found, missed, and reports where nothing was injected."""
    holes = [i for i in injected if i.kind == "gap"]
    reports = [d for d in diagnosis.defects if d.kind in MISSING and d.count > 0 and d.severity != "info"]
    reports = [d for d in reports if not d.message.startswith("vertices are not merged")]
    boxes = np.array([[*i.box[0], *i.box[1]] for i in holes]).reshape(-1, 2, 3)
    found = np.zeros(len(holes), dtype=bool)
    false, slight = 0, 0
    for report in reports:
        low, high = np.asarray(report.box) + np.array([[-4.0 * jitter], [4.0 * jitter]])
        touches = ((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(axis=1)
        false += not touches.any()
        slight += not touches.any() and report.size <= 4.0 * jitter
        found |= touches
    injected_area = float(sum(i.area for i in holes))
    bridged = float(sum(e.area for e in repaired.ledger if e.what == "bridge"))
    return {
        "holes and slits injected": len(holes),
        "found": int(found.sum()),
        "missed": int((~found).sum()),
        "false": false,
        "false, no larger than four times the jitter": slight,
        "area injected as missing": injected_area,
        "area labelled as invented": bridged,
        "labelled to injected area": bridged / injected_area if injected_area else 0.0,
    }
