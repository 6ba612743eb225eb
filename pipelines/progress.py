"""Progress on the terminal: a bar for whatever lasts, nothing for what is over at once, nothing on stdout."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

PATIENCE = 1.0  # seconds before a bar is shown

Report = Callable[[str, float], None]


class Terminal:
    """Shows the latest label and share on stderr once a stage has lasted longer than `PATIENCE`.

    On a terminal it is a bar; elsewhere one line per label, so that log files stay readable.
    """

    def __init__(self, quiet: bool = False) -> None:
        self._quiet = quiet
        self._started = time.perf_counter()
        self._bars: Bars | None = None
        self._task: TaskID | None = None
        self._label = ""
        self._stage = ""

    @contextmanager
    def stage(self, name: str) -> Iterator[Report]:
        """A stage; yields the function that takes (label, share in [0, 1])."""
        self._started, self._stage, self._label = time.perf_counter(), name, ""
        try:
            yield self._report
        finally:
            if self._bars is not None:
                self._bars.stop()
                self._bars = self._task = None

    def line(self, text: str) -> None:
        """One line on stderr."""
        if not self._quiet:
            print(text, file=sys.stderr, flush=True)  # noqa: T201 - the terminal is this class's business

    def _report(self, label: str, share: float) -> None:
        if self._quiet or time.perf_counter() - self._started < PATIENCE:
            return
        if not sys.stderr.isatty():
            if label != self._label:
                self._label = label
                self.line(f"  {self._stage}: {label}")
            return
        if self._bars is None:
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bars

            columns = (TextColumn("{task.description:<32}"), BarColumn(), TimeElapsedColumn())
            self._bars = Bars(*columns, console=Console(stderr=True), transient=True)
            self._bars.start()
            self._task = self._bars.add_task(label, total=1.0)
        if self._task is not None:
            self._bars.update(self._task, description=f"{self._stage}: {label}", completed=min(max(share, 0.0), 1.0))
