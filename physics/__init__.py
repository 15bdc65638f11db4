"""A rigid-body engine: bodies sampled by particles, thousands of worlds at once, by numba."""

from physics.compound import Compound
from physics.diagnostics import Contacts
from physics.errors import ContactOverflow, SimulationDiverged
from physics.features import Features
from physics.fidelity import PRESETS, Fidelity
from physics.parameters import Parameters
from physics.part import Part
from physics.readout import Readout
from physics.scene import Body, Drive, Gripper, Ground, Material, Scene, Static
from physics.shapes import Box, Capsule, Sphere
from physics.world import Snapshot, World

__all__ = [
    "PRESETS",
    "Body",
    "Box",
    "Capsule",
    "Compound",
    "ContactOverflow",
    "Contacts",
    "Drive",
    "Features",
    "Fidelity",
    "Gripper",
    "Ground",
    "Material",
    "Parameters",
    "Part",
    "Readout",
    "Scene",
    "SimulationDiverged",
    "Snapshot",
    "Sphere",
    "Static",
    "World",
]
