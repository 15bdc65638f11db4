"""Joints: scalar constraints between bodies, solved together."""
