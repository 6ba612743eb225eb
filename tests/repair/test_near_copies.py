"""Doubled triangles with scattered corners, and triangles without area that hang on a surface."""

from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Tolerance, Triangulation
from patchwright.models.adjacency import Adjacency
from patchwright.models.samples import duplicated, unmerged
from patchwright.models.samples.splitting import degenerate, t_junctions
from patchwright.repair.mender.clean import drop_hanging_flats
from patchwright.repair.mender.mend import mend
from patchwright.repair.mender.near_copies import near_copies


@pytest.mark.parametrize("jitter", [0.0, 1e-7, 1e-4])
def test_near_copies_take_the_corners_of_their_first(jitter: float) -> None:
    ball = shapes.sphere(3)
    twice = duplicated(ball, 0.05, seed=3)
    torn = unmerged(twice.triangulation, jitter, seed=4).triangulation
    order = np.random.default_rng(0).permutation(len(torn))  # copies come before and after, either way round
    mixed = np.where(order[:, None] % 2 == 0, torn.triangles[order], torn.triangles[order][:, ::-1])
    found, changed = near_copies(Triangulation(torn.vertices, mixed), max(2.5 * jitter, 1e-9))
    assert len(changed) == len(twice.triangulation) - len(ball)
    rows, times = np.unique(np.sort(found.triangles, axis=1), axis=0, return_counts=True)
    assert len(rows) == len(ball)
    assert times.max() == 2
    assert (found.vertices == torn.vertices).all()


def test_skins_farther_apart_than_the_distance_are_no_copies() -> None:
    ball = shapes.sphere(3)
    torn = shapes.soup(shapes.together(ball, Triangulation(1.01 * ball.vertices, ball.triangles)))
    assert not len(near_copies(torn, 5e-3)[1])
    assert len(near_copies(torn, 0.02)[1]) == len(ball)
    assert not len(near_copies(ball, 0.02)[1]), "a closed surface holds none"


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_doubled_soup_is_mended_as_if_it_were_not_doubled(scale: float) -> None:
    ball = shapes.sphere(3, radius=scale)
    torn = unmerged(duplicated(ball, 0.05, seed=1).triangulation, 1e-6 * scale, seed=2).triangulation
    made = mend(torn, Tolerance.of(torn))
    assert made.closed
    assert not made.problems
    assert made.triangulation.volume == pytest.approx(ball.volume, rel=1e-5)
    assert len(made.triangulation) == len(ball)


def test_hanging_flats_go_and_flats_that_fill_a_t_junction_stay() -> None:
    box = shapes.box()
    hung = degenerate(box, 0.1, seed=0).triangulation
    cleaned = drop_hanging_flats(hung, 1e-12)
    assert (np.sort(cleaned.parents) == np.arange(len(box))).all()
    split = t_junctions(box, 0.1, seed=0).triangulation
    rims = Adjacency.of(split).boundary_loops()
    flats = np.array([rim for rim in rims if len(rim) == 3])[:, ::-1]
    assert len(flats), "the injector leaves rims of three collinear vertices"
    filled = Triangulation(split.vertices, np.concatenate([split.triangles, flats]))
    assert (filled.areas[len(split) :] < 1e-15).all()
    assert not len(drop_hanging_flats(filled, 1e-12).removed)


def test_bodies_with_hanging_flats_are_united() -> None:
    two = shapes.together(shapes.box(), shapes.box(at=(0.4, 0.3, 0.2)))
    flat = degenerate(two, 0.05, seed=5).triangulation
    made, plain = (mend(t, Tolerance.of(t)) for t in (flat, two))
    assert made.closed
    assert not made.problems
    assert made.triangulation.volume == pytest.approx(plain.triangulation.volume, rel=1e-12)
