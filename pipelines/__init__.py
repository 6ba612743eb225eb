"""Stages, recipes, reports, pictures and the command line."""
