"""What patches are laid on: the true surfaces behind the tessellation of a CAD model, and distances from them."""
