"""Where a setting is stable, drifts, diverges or is refused: maps over substep and a parameter."""
