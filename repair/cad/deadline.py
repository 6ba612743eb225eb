"""A time limit that is handed from step to step: who is asked last gets what is left.

What counts is work: processor time of this thread and of the CAD kernel's process on its behalf. So a slow or busy
machine mends what a fast one does; the clock stops only what takes `WALL` times as long.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from patchwright.models.cad.contained import WALL, spent

LEAST = 5.0  # seconds a call that is begun at all is given


@dataclass(frozen=True, slots=True)
class Deadline:
    """When nothing new is to be begun.

    Parameters
    ----------
    until : by `work()`, seconds
    late : by the monotonic clock, seconds
    limit : the limit it came from, seconds of processor time
    """

    until: float
    late: float
    limit: float

    @classmethod
    def after(cls, seconds: float) -> Deadline:
        """So many seconds of processor time from now."""
        return cls(work() + seconds, time.monotonic() + WALL * seconds, seconds)

    @property
    def passed(self) -> bool:
        """Whether the time is up."""
        return work() > self.until or time.monotonic() > self.late

    def left(self, at_most: float, least: float = LEAST) -> float:
        """Seconds left, no more than a limit of one's own and no fewer than a call needs to answer at all."""
        remaining = min(self.until - work(), (self.late - time.monotonic()) / WALL)
        return max(min(at_most, remaining), min(least, at_most))


def work() -> float:
    """Seconds of processor time that this thread, and the CAD kernel's process for it, have needed so far."""
    return time.thread_time() + spent()
