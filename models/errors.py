"""The error tree: every failure a caller may want to tell apart, its text saying what, where and what to do."""

from __future__ import annotations


class GeometryError(Exception):
    """Base of every error patchwright raises on purpose; its text is one sentence fit for a terminal."""


class KnotError(GeometryError):
    """A knot vector is decreasing, too short, too long or of too high multiplicity."""


class ParameterError(GeometryError, ValueError):
    """An argument has no meaning: NaN coordinates, a radius of zero, a tolerance that is not positive."""


class UnsupportedFormat(GeometryError):
    """The file's suffix is not registered, or the format cannot hold what was asked of it."""


class CorruptFile(GeometryError):
    """The file cannot be read as what its suffix says; the text names the file and the first fault."""


class UnsupportedEntity(GeometryError):
    """A well-formed file holds an entity patchwright cannot represent."""


class EngineError(GeometryError):
    """A native engine (CAD kernel, quad mesher, boolean) crashed, hung or returned an invalid result."""


class RepairWarning(UserWarning):
    """Something usable was produced, but something was lost; the text says what."""
