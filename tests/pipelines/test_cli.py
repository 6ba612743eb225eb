"""The command line as a new user meets it: exit codes, one sentence for bad input, clean stdout."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
CUBE_FACES = np.array(
    [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ]
)


def patchwright(*words, cwd=None, limit=600):
    return subprocess.run(
        [sys.executable, "-m", "patchwright.pipelines.cli", *map(str, words)],
        capture_output=True, text=True, timeout=limit, cwd=cwd, check=False,
    )  # fmt: skip


def write_off(path, vertices, faces):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(map(repr, map(float, v))) for v in vertices] + ["3 " + " ".join(map(str, f)) for f in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def binary_stl(path, claimed, triangles):
    record = np.zeros(triangles, dtype=[("normal", "<3f4"), ("corners", "<9f4"), ("attribute", "<u2")])
    record["corners"] = np.random.default_rng(0).random((triangles, 9))
    path.write_bytes(b"\0" * 80 + np.uint32(claimed).tobytes() + record.tobytes())
    return path


def bad_inputs(folder):
    """name -> path of every kind of bad input the command line must answer with one sentence."""
    empty = folder / "empty.stl"
    empty.touch()
    text = folder / "text.stl"
    text.write_text("dear reader,\nthis is a letter and no geometry\n" * 20)
    nan = folder / "nan.stl"
    nan.write_text(
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\nvertex 1 0 0\nvertex 0 1 0\n"
        "endloop\nendfacet\nendsolid a\n"
    )
    inf = folder / "inf.obj"
    inf.write_text("v 0 0 inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    step = folder / "no_faces.step"
    step.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    unknown = folder / "model.docx"
    unknown.write_text("x")
    zeros = folder / "zeros.stl"
    with zeros.open("wb") as stream:
        stream.truncate(2 * 1024**3)  # sparse: takes no disk
    directory = folder / "folder.stl"
    directory.mkdir()
    return {
        "empty file": empty,
        "text renamed": text,
        "truncated binary STL": binary_stl(folder / "truncated.stl", 1000, 10),
        "zero triangles": binary_stl(folder / "none.stl", 0, 0),
        "NaN coordinates": nan,
        "infinite coordinates": inf,
        "STEP without faces": step,
        "a directory": directory,
        "unknown suffix": unknown,
        "2 GB of zeros": zeros,
        "no such file": folder / "missing.stl",
        "one triangle": write_off(folder / "one.off", np.eye(3), [[0, 1, 2]]),
    }


KINDS = (
    "empty file", "text renamed", "truncated binary STL", "zero triangles", "NaN coordinates", "infinite coordinates",
    "STEP without faces", "a directory", "unknown suffix", "2 GB of zeros", "no such file", "one triangle",
)  # fmt: skip


@pytest.fixture(scope="module")
def bad(tmp_path_factory):
    return bad_inputs(tmp_path_factory.mktemp("bad"))


@pytest.mark.parametrize("kind", KINDS)
def test_bad_input_gets_one_sentence_and_exit_code_2(bad, kind, tmp_path):
    done = patchwright("repair", bad[kind], "-o", tmp_path / "out")
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    lines = [line for line in done.stderr.splitlines() if line.startswith("patchwright: ")]
    assert len(lines) == 1, done.stderr
    assert bad[kind].name in lines[0]
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_named(tmp_path):
    path = write_off(tmp_path / "secret.off", CUBE, CUBE_FACES)
    path.chmod(0)
    done = patchwright("check", path)
    assert done.returncode == 2
    assert "secret.off" in done.stderr


def test_check_tells_clean_from_broken(tmp_path):
    whole = write_off(tmp_path / "whole.off", CUBE, CUBE_FACES)
    done = patchwright("check", whole, "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout)["clean"] is True
    broken = write_off(tmp_path / "broken.off", CUBE, CUBE_FACES[1:])
    done = patchwright("check", broken, "--json")
    assert done.returncode == 1
    assert {d["kind"] for d in json.loads(done.stdout)["defects"]} & {"open-edge", "opening", "gap"}


def test_usage_errors_are_exit_code_2():
    assert patchwright("repair").returncode == 2
    assert patchwright("mend", "x.stl").returncode == 2
    assert patchwright("repair", "x.stl", "--scope", "most").returncode == 2


def test_help_names_every_command_and_imports_nothing_heavy():
    done = patchwright("--help")
    assert done.returncode == 0
    for command in ("check", "repair", "convert", "run", "demo"):
        assert command in done.stdout
    listing = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "patchwright.pipelines.cli", "--help"],
        capture_output=True, text=True, check=True, timeout=60,
    ).stderr  # fmt: skip
    for heavy in ("numba", "scipy", "open3d", "OCP", "pyvista", "manifold3d"):
        assert f"| {heavy}\n" not in listing.replace("|   ", "| ").replace("  ", "")


def test_convert_keeps_every_triangle(tmp_path):
    source = write_off(tmp_path / "cube.off", CUBE, CUBE_FACES)
    done = patchwright("convert", source, tmp_path / "cube.stl")
    assert done.returncode == 0, done.stderr
    from patchwright.models.io import read

    assert len(read(tmp_path / "cube.stl").triangulation) == 12
    assert patchwright("convert", source, tmp_path / "cube.docx").returncode == 2
    assert not (tmp_path / "cube.docx").exists()


def test_recipes_say_what_is_wrong_with_them(tmp_path):
    recipe = tmp_path / "recipe.toml"
    for text, word in (
        ("source = ", "TOML"),
        ("folder = 'x'", "source"),
        ("source = 'x.stl'", "stage"),
        ("source = 'x.stl'\n[[stage]]\nname = 'polish'", "polish"),
        ("source = 'x.stl'\n[[stage]]\nname = 'repair'\nscop = 'all'", "scop"),
        ("source = 'x.stl'\ncolour = 1\n[[stage]]\nname = 'repair'", "colour"),
    ):
        recipe.write_text(text)
        done = patchwright("run", recipe)
        assert done.returncode == 2
        assert word in done.stderr


def test_a_recipe_runs_the_stages_it_names(tmp_path):
    write_off(tmp_path / "cube.off", CUBE, CUBE_FACES)
    (tmp_path / "recipe.toml").write_text("source = 'cube.off'\nfolder = 'out'\n[[stage]]\nname = 'diagnose'\n")
    done = patchwright("run", tmp_path / "recipe.toml", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [s["stage"] for s in told["stages"]] == ["read", "diagnose"]
    assert told["before"]["clean"] is True if "clean" in told["before"] else True
