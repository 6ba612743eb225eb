"""CAD faces healed with the least change: kept, sewn, trimmed again, moved, replaced, united."""
