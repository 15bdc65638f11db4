"""Many bodies in one world: pairs of bodies in vector lanes, parallel within the world."""
