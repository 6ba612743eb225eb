"""The command line run inside the tests' own process: exit code, stdout, stderr."""

from __future__ import annotations

import os

import pytest

from patchwright.pipelines.cli import main


def command(monkeypatch, capfd, *words) -> tuple[int, str, str]:
    """Run `patchwright WORDS`; capfd is the test's own fixture."""
    monkeypatch.setattr("sys.argv", ["patchwright", *map(str, words)])
    stdout = os.dup(1)  # the command sends descriptor 1 to stderr for good
    with pytest.raises(SystemExit) as leaving:
        main()
    os.dup2(stdout, 1)
    os.close(stdout)
    out, err = capfd.readouterr()
    return int(leaving.value.code or 0), out, err
