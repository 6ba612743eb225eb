"""The cases other projects published, through `intersect`: nearly all right, each other one known by name and reason.

`python tests/oracles_ssi_cases.py` prints the whole table.
"""

from __future__ import annotations

import pytest
from oracles_ssi_cases import UNKNOWN, load, verdict

from patchwright.ssi import Intersection, intersect

# What is not right, and why; all of it says so itself (`complete` is False).
OPEN = {
    "sgm-sphere_cone-11": "the apex lies on the sphere and one ruling is tangent to it there",
}
SHARE = 0.95  # of the judged cases that are to be right

CASES = load()


def solve(a: object, b: object, tolerance: float) -> Intersection:
    return intersect(a, b, tolerance=tolerance)  # type: ignore[arg-type]


@pytest.mark.skipif(not CASES, reason="the published cases are not here")
def test_at_least_95_of_100_are_judged_and_right() -> None:
    judged = [case["id"] for case in CASES if case["id"] not in UNKNOWN]
    assert len(judged) >= 140
    assert len(judged) - len(OPEN) >= SHARE * len(judged)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_case(case: dict[str, object]) -> None:
    found = verdict(case, solve)
    if found.name in UNKNOWN:
        assert found.state == "skipped"
    else:
        assert found.state == ("unresolved" if found.name in OPEN else "right"), found.reason
