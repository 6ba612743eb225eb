"""Rows of the tables: one line of text from named columns, and a process of its own for a row that may not end."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
from typing import Any

Columns = tuple[tuple[str, str], ...]
WALL = 10.0  # times the limit: a process that takes so long on the clock hangs
MARK = "ROW "  # before the line of output that is the row


def line(row: dict[str, Any], columns: Columns) -> str:
    """The row in its columns, a dash where it has no figure, and why something went wrong."""
    cells = [form.format(row[name]) if row.get(name) is not None else "-".rjust(_width(form)) for name, form in columns]
    return " ".join(cells) + (f"  {row['why']}" if row.get("why") else "")


def heading(columns: Columns) -> str:
    """The names over their columns."""
    return " ".join(f"{name:{'>' if '>' in form else '<'}{_width(form)}}" for name, form in columns)


def _width(form: str) -> int:
    return int(form.split(":")[1].strip("<>}").split(".")[0].rstrip("dsfe%"))


def row_of_child(script: str, arguments: list[str], limit: float) -> dict[str, Any]:
    """The row that `script` prints with `print_row`, or why there is none.

    The process is stopped after `limit` seconds of processor time, or ten times as long on the clock. A row without
    figures has "why", and "how" it ended: "hangs", "over time", "unreadable" (our own error, so bad input), "crashed".
    """
    command = [sys.executable, script, *arguments, "--limit", str(limit)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=WALL * limit)
    except subprocess.TimeoutExpired:
        return {"how": "hangs", "why": f"not done after {WALL * limit:g} s"}
    if done.returncode == -signal.SIGXCPU:
        return {"how": "over time", "why": f"not done after {limit:g} s of processor time"}
    rows = [text for text in done.stdout.splitlines() if text.startswith(MARK)]
    if rows:
        return dict(json.loads(rows[-1].removeprefix(MARK)))
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    bad_input = last.startswith("patchwright.models.errors.")
    return {"how": "unreadable" if bad_input else "crashed", "why": f"exit code {done.returncode}: {last}"}


def limit_processor(limit: float) -> None:
    """This process is stopped after so many seconds of processor time."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))


def print_row(row: dict[str, Any]) -> None:
    """Hand a row to `row_of_child`."""
    print(MARK + json.dumps(row))
