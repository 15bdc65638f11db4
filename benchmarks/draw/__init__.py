"""One picture a file: `draw(path)` writes it."""
