"""A time limit that is handed from step to step: who is asked last gets what is left."""

from __future__ import annotations

import time
from dataclasses import dataclass

LEAST = 5.0  # seconds a call that is begun at all is given


@dataclass(frozen=True, slots=True)
class Deadline:
    """When (monotonic seconds) nothing new is to be begun, and the limit it came from in seconds."""

    until: float
    limit: float

    @classmethod
    def after(cls, seconds: float) -> Deadline:
        """So many seconds from now."""
        return cls(time.monotonic() + seconds, seconds)

    @property
    def passed(self) -> bool:
        """Whether the time is up."""
        return time.monotonic() > self.until

    def left(self, at_most: float) -> float:
        """Seconds left, no more than a limit of one's own and no fewer than a call needs to answer at all."""
        return max(min(at_most, self.until - time.monotonic()), min(LEAST, at_most))
