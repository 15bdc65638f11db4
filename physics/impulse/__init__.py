"""The impulse law: contact impulses by sequential sweeps."""
