"""Find defects; mend with the least change; lay out, project, fill, fit, connect."""
