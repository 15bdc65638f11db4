"""Twins of the Fetch environments of Gymnasium-Robotics (MuJoCo)."""
