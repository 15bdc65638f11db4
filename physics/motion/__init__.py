"""How bodies move: integrator, kinematics, gravity and drives."""
