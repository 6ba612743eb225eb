"""The known families of hard pairs through `intersect`: as given, moved, scaled, exchanged and as NURBS.

`python tests/oracles_ssi_families.py` prints the whole table.
"""

from __future__ import annotations

import pytest
from oracles_ssi_families import CASES, VARIANTS, judged

QUICK = ("plain", "all")
NAMES = [f"{name}, {form}" for name, form in CASES]


@pytest.mark.parametrize("variant", QUICK)
@pytest.mark.parametrize(("name", "form"), CASES, ids=NAMES)
def test_family(name: str, form: str, variant: str) -> None:
    assert judged(name, form, variant)[0] == "right"


@pytest.mark.slow
@pytest.mark.parametrize("variant", [v for v in VARIANTS if v not in QUICK])
@pytest.mark.parametrize(("name", "form"), CASES, ids=NAMES)
def test_motion_scale_and_order_change_nothing(name: str, form: str, variant: str) -> None:
    assert judged(name, form, variant)[0] == "right"
