"""A software renderer: cameras, what is shown of a world, the window."""
