"""Quad layouts over a triangulation: features, sizes, quads along them, structured blocks."""
