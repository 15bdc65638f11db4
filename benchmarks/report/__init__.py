"""Tables, the saved results, timing of sides that take turns, and child processes."""
