"""The checks of a diagnosis: one concept per module, found through the registry in the order they are reported."""
