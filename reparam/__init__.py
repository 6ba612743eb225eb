"""New parametrisations for old shapes."""
