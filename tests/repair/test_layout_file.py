"""Layouts saved and reloaded: bit for bit, still a layout after editing, and a sentence for what is none."""

from __future__ import annotations

import json

import numpy as np
import pytest
from quad_shapes import sphere_layout

from patchwright.models.errors import CorruptFile, GeometryError
from patchwright.repair.layout.layout_file import load_layout, save_layout

FIELDS = ("vertices", "quads", "quad_edges", "edge_reversed", "edges", "edge_quads", "sharp", "boundary", "tags")


def test_a_layout_comes_back_bit_for_bit(tmp_path):
    layout = sphere_layout(3)
    save_layout(tmp_path / "layout.json", layout)
    again = load_layout(tmp_path / "layout.json")
    for name in (*FIELDS, "path_offsets"):
        np.testing.assert_array_equal(getattr(again, name), getattr(layout, name))
    ends = np.concatenate([layout.path_offsets[:-1], layout.path_offsets[1:] - 1])  # those of a path are the vertices
    inner = np.setdiff1d(np.arange(len(layout.path_points)), ends)
    np.testing.assert_array_equal(again.path_points[inner], layout.path_points[inner])
    save_layout(tmp_path / "again.json", again)
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "layout.json").read_bytes()


def test_a_deleted_quad_leaves_a_layout_with_a_boundary(tmp_path):
    path = tmp_path / "layout.json"
    save_layout(path, sphere_layout(2))
    told = json.loads(path.read_text())
    told["quads"].pop()
    del told["tags"]
    told["edges"] = told["edges"][: len(told["edges"]) // 2]  # the others become straight
    path.write_text(json.dumps(told))
    layout = load_layout(path)
    assert len(layout) == 23
    assert layout.boundary.sum() == 4
    assert (np.diff(layout.path_offsets) >= 2).all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda told: told.update({"patchwright layout": 9}), "is no layout"),
        (lambda told: told["vertices"].append([0.0, float("nan"), 0.0]), "vertices must be"),
        (lambda told: told["quads"][0].__setitem__(0, 999), "quads name vertices"),
        (lambda told: told["quads"].append([0, 1]), "quads must be"),
        (lambda told: told["edges"][0].pop("ends"), "edge 0"),
        (lambda told: told["tags"].pop(), "tags"),
    ],
)
def test_what_is_no_layout_is_told(tmp_path, change, words):
    path = tmp_path / "layout.json"
    save_layout(path, sphere_layout(1))
    told = json.loads(path.read_text())
    change(told)
    path.write_text(json.dumps(told))
    with pytest.raises(CorruptFile, match=words):
        load_layout(path)


def test_a_third_quad_on_an_edge_is_told(tmp_path):
    path = tmp_path / "layout.json"
    save_layout(path, sphere_layout(1))
    told = json.loads(path.read_text())
    told["quads"].append(told["quads"][0])
    told["tags"].append(0)
    path.write_text(json.dumps(told))
    with pytest.raises(GeometryError, match="3 quads share the edge"):
        load_layout(path)


@pytest.mark.parametrize("text", ["", "{", "[]", "\x00"])
def test_no_json_is_told(tmp_path, text):
    path = tmp_path / "layout.json"
    path.write_text(text)
    with pytest.raises(CorruptFile, match=r"layout\.json"):
        load_layout(path)
    with pytest.raises(CorruptFile, match="no such layout"):
        load_layout(tmp_path / "other.json")
