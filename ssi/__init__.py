"""Surface meets surface."""
