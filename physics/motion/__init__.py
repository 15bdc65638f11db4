"""How bodies move: kinematics, gravity and drives."""
