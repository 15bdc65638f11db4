"""What a fidelity means for a scene, and the cheapest one that is accurate enough for it."""
