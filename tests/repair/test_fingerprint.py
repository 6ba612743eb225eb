"""Fingerprints: the same thing keeps its label and its match under re-ordering and small changes, another does not."""

from __future__ import annotations

import numpy as np
import pytest
from oracles_shells import sphere, without

from patchwright.models import Triangulation
from patchwright.repair import diagnose
from patchwright.repair.fingerprint import fingerprint, labels, matched

A = fingerprint("gap", (0, 0, 0), 0.1, ("wing", "flap"))
B = fingerprint("gap", (1, 0, 0), 0.1, ("wing",))
C = fingerprint("opening", (1, 0, 0), 0.1)


def test_labels_do_not_depend_on_the_order_of_things_or_parts() -> None:
    turned = fingerprint("gap", (0, 0, 0), 0.1, ("flap", "wing"))
    assert labels([A, B, C], 2.0) == labels([turned, B, C], 2.0)
    assert dict(zip([A, B, C], labels([A, B, C], 2.0), strict=True)) == dict(
        zip([C, A, B], labels([C, A, B], 2.0), strict=True)
    )
    assert len(set(labels([A, A, B, C], 2.0))) == 4


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_small_changes_match_and_large_ones_do_not(scale: float) -> None:
    def gap(x: float, size: float) -> object:
        return fingerprint("gap", (scale * x, 0, 0), scale * size)

    old = [gap(0.0, 0.1), gap(0.2, 0.1)]
    assert matched(old, [gap(0.21, 0.11), gap(0.01, 0.09)], 2 * scale) == {0: 1, 1: 0}
    assert matched(old, [gap(0.5, 0.1)], 2 * scale) == {}, "elsewhere"
    assert matched(old, [gap(0.0, 0.2)], 2 * scale) == {}, "twice as large is another"
    assert matched(old, [fingerprint("opening", (0, 0, 0), 0.1 * scale)], 2 * scale) == {}, "of another kind"
    assert len(matched(old, [gap(0.0, 0.1)] * 3, 2 * scale)) == 1, "one to one"


def test_labels_of_a_diagnosis_survive_shuffled_triangles() -> None:
    t = without(sphere(32), np.array([40, 400, 700]))
    rng = np.random.default_rng(0)
    points = rng.permutation(len(t.vertices))
    shuffled = Triangulation(t.vertices[points], np.argsort(points)[t.triangles][rng.permutation(len(t))])
    first, second = ({d.id for d in diagnose(x).defects} for x in (t, shuffled))
    assert first == second
    assert len(first) == 3
