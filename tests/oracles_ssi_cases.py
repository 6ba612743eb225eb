"""Intersection cases collected from public projects, turned into our classes and judged by one convention.

Convention: arcs that continue each other smoothly through a branch point count as one curve; an isolated point counts
as one; lengths are total arc lengths. References: the printed exact length to 1e-6, else the figure of a contour or
another kernel to 1e-4. Unbounded cylinders are cut at four (largest) radii either side of their origin where the other
surface is unbounded too, which is how the reference lengths were made. Run as a script it prints every verdict.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from patchwright.models import Cone, Cylinder, GeometryError, Plane, Sphere, Torus
from patchwright.models.surface import Surface
from patchwright.ssi.intersection import Intersection

CASES = Path(os.environ.get("PATCHWRIGHT_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
CASES = CASES.parent / "peers" / "ssi_cases.json"
RADII = 4.0

# Printed figures that do not fit the convention, the closed form that replaces them, and why: (curves, arcs, length).
REPLACED: dict[str, tuple[int, int, float | None, str]] = {
    "occt-32850": (2, 4, None, "4 counts the arcs from the branch point; two of them continue the other two smoothly"),
    "occt-gt-quad-near": (
        1,
        1,
        8.0,
        "one line is printed at this tolerance, and it is 8 long; 16 is that of two lines",
    ),
}


@dataclass(frozen=True)
class Verdict:
    """`state` is "right", "wrong", "none" (no closed form) or "skipped"."""

    name: str
    state: str
    reason: str


def load() -> list[dict[str, Any]]:
    """All cases, [] where the file is absent."""
    return json.loads(CASES.read_text())["cases"] if CASES.exists() else []


def surface(spec: dict[str, Any], reach: float | None) -> Surface | None:
    """One of our classes, None for other types."""
    ranges = {k: tuple(spec[k]) for k in ("u", "v") if spec.get(k) is not None}
    x = spec.get("xdir")
    kind = spec["type"]
    if kind == "plane":
        return Plane(spec["origin"], spec["normal"], x, **ranges)
    if kind == "cylinder":
        if reach is not None and "v" not in ranges:
            ranges["v"] = (-reach, reach)
        return Cylinder(spec["origin"], spec["axis"], spec["radius"], x, **ranges)
    if kind == "cone":
        return Cone(spec["origin"], spec["axis"], math.radians(spec["half_angle_deg"]), spec["ref_radius"], x, **ranges)
    if kind == "sphere":
        return Sphere(spec["center"], spec["radius"])
    if kind == "torus":
        return Torus(spec["center"], spec["axis"], spec["major"], spec["minor"], x)
    return None


def pair(case: dict[str, Any]) -> tuple[Surface, Surface] | None:
    """Both surfaces, None unless both are analytic."""
    if not all(isinstance(case.get(k), dict) for k in "AB"):
        return None
    open_ended = {k: case[k].get("v") is None and case[k]["type"] in ("plane", "cylinder", "cone") for k in "AB"}
    reach = RADII * max(case[k].get("radius", 0.0) for k in "AB") if all(open_ended.values()) else None
    a, b = (surface(case[k], reach or None) for k in "AB")
    return None if a is None or b is None else (a, b)


def smooth_curves(found: Intersection) -> int:
    """How many curves there are when arcs that continue each other through a branch point are joined."""
    count = len(found.curves)
    ends = []
    for i, c in enumerate(found.curves):
        t0, t1 = c.curve.domain
        for t, sign in ((t0, 1.0), (t1, -1.0)):
            d = sign * c.curve(t, 1)
            ends.append((i, c.curve(t), d / np.linalg.norm(d)))
    branches = [p.point for p in found.points if p.kind == "branch"]
    parent = list(range(count))

    def root(i: int) -> int:
        while parent[i] != i:
            i = parent[i]
        return i

    for p in branches:
        near = [e for e in ends if np.linalg.norm(e[1] - p) <= 1e-6 * (1.0 + np.abs(p).max())]
        for k, e in enumerate(near):
            for f in near[k + 1 :]:
                if e[2] @ f[2] < -1.0 + 1e-6 and root(e[0]) != root(f[0]):
                    parent[root(e[0])] = root(f[0])
    return len({root(i) for i in range(count)})


def judge(case: dict[str, Any], found: Intersection | None) -> Verdict:
    """Compare count, length and singular points with what is printed."""
    name, expected = case["id"], case["expected"]
    if found is None:
        return Verdict(name, "none", "no closed form")
    if name in REPLACED:
        curves, arcs, length, reason = REPLACED[name]
        fits = (smooth_curves(found), len(found.curves)) == (curves, arcs)
        fits = fits and (length is None or abs(found.length - length) <= 1e-6 * length)
        return Verdict(name, "right" if fits else "wrong", reason)
    faults = []
    curves, lone = smooth_curves(found), sum(p.kind == "touch" for p in found.points)
    if "count" in expected and expected["count"] != curves + lone:
        faults.append(f"{curves} curves and {lone} points, printed {expected['count']}")
    if "n_curves" in expected and expected["n_curves"] != curves:
        faults.append(f"{curves} curves, printed {expected['n_curves']}")
    if "n_points" in expected and expected["n_points"] != lone:
        faults.append(f"{lone} points, printed {expected['n_points']}")
    if expected.get("overlap") and not found.overlaps:
        faults.append("no overlap")
    reference = case.get("reference_length", {}).get("value")
    if "length_exact" in expected:
        reference, accuracy = expected["length_exact"], 1e-6
    else:
        accuracy = 1e-4
    if reference and abs(found.length - reference) > accuracy * reference:
        faults.append(f"length {found.length:.9g}, printed {reference:.9g}")
    for p in expected.get("singular_points", []):
        if not any(np.linalg.norm(c.point - p) <= 1e-6 * (1.0 + np.abs(p).max()) for c in found.points):
            faults.append(f"no singular point at {p}")
    state = "wrong" if faults else "right"
    what = f"{curves} curves, {lone} points, length {found.length:.9g}, residual {found.residual:.1e}"
    return Verdict(name, state, "; ".join(faults) or what)


def verdicts(solve: Any, tolerance_share: float = 1e-10) -> list[Verdict]:
    """Every case through `solve(a, b, tolerance)`, the tolerance the case's own or a share of the smaller size."""
    out = []
    for case in load():
        both = pair(case)
        if both is None:
            out.append(Verdict(case["id"], "skipped", "not two analytic surfaces"))
            continue
        tolerance = case["expected"].get("tolerance", tolerance_share * _size(case))
        try:
            out.append(judge(case, solve(*both, tolerance)))
        except GeometryError as error:
            out.append(Verdict(case["id"], "skipped", str(error)))
    return out


def _size(case: dict[str, Any]) -> float:
    sizes = [float(case[k].get(n, 0.0) or 0.0) for k in "AB" for n in ("radius", "major", "ref_radius")]
    return 2.0 * max([*sizes, 1.0])


if __name__ == "__main__":
    from patchwright.ssi.closed_forms import closed_form

    rows = verdicts(closed_form)
    for v in rows:
        if v.state != "skipped" or "analytic" not in v.reason:
            print(f"{v.state:8}{v.name:28}{v.reason}")  # noqa: T201
    print({s: sum(v.state == s for v in rows) for s in ("right", "wrong", "none", "skipped")})  # noqa: T201
