"""When the compilation of kernels is announced: once, on a cold machine, and never before bad input is refused."""

from __future__ import annotations

import importlib

import pytest

from patchwright.models.errors import GeometryError
from patchwright.pipelines import warm
from patchwright.pipelines.progress import Terminal
from patchwright.pipelines.recipe import Recipe
from patchwright.pipelines.run import run

GOOD = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"


@pytest.fixture
def starts(monkeypatch):
    """The terminals `start` was called with, in place of starting anything."""
    calls = []
    monkeypatch.setattr(importlib.import_module("patchwright.pipelines.run"), "start", calls.append)
    return calls


@pytest.mark.parametrize("text", ["", "OFF\n0 0 0\n", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "OFF\n4 4 0\n0 0"])
def test_bad_input_is_refused_before_anything_is_announced(tmp_path, starts, text):
    source = tmp_path / "bad.off"
    source.write_text(text)
    with pytest.raises(GeometryError):
        run(Recipe(source, tmp_path / "out", ()), terminal=Terminal(quiet=True))
    assert starts == []


def test_a_meaningless_tolerance_is_refused_before_anything_is_announced(tmp_path, starts):
    source = tmp_path / "good.off"
    source.write_text(GOOD)
    with pytest.raises(GeometryError):
        run(Recipe(source, tmp_path / "out", (), tolerance=-1.0), terminal=Terminal(quiet=True))
    assert starts == []


def test_good_input_starts_the_compilation(tmp_path, starts):
    source = tmp_path / "good.off"
    source.write_text(GOOD)
    terminal = Terminal(quiet=True)
    run(Recipe(source, tmp_path / "out", ()), terminal=terminal)
    assert starts == [terminal]


def test_cold_until_the_kernels_are_there(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert warm.is_cold()
    (tmp_path / "repair").mkdir()
    (tmp_path / "repair" / "_remesh_kernel.split_pass-1.py311.nbi").touch()
    assert not warm.is_cold()


@pytest.mark.parametrize("cold", [True, False])
def test_said_once_and_only_when_cold(monkeypatch, capsys, cold):
    commands = []
    monkeypatch.setattr(warm, "_started", False)
    monkeypatch.setattr(warm, "is_cold", lambda: cold)
    monkeypatch.setattr(warm, "spare_collections", lambda: None)
    monkeypatch.setattr(warm.subprocess, "Popen", lambda command, **kinds: commands.append(command))
    for _ in range(2):
        warm.start(Terminal())
    assert capsys.readouterr().err.count("compiling kernels") == cold
    assert len(commands) == cold
