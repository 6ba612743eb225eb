"""Triangulations mended with the least change: weld, cut, bridge, unite, wrap."""
