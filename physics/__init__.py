"""A rigid-body engine: bodies sampled by particles, thousands of worlds at once, by numba."""

from physics.analysis.diagnostics import Contacts
from physics.errors import ContactOverflow, SimulationDiverged
from physics.model.features import Features
from physics.scene.compound import Compound
from physics.scene.fidelity import PRESETS, Fidelity
from physics.scene.parameters import Parameters
from physics.scene.part import Part
from physics.scene.scene import Body, Drive, Gripper, Ground, Material, Scene, Static
from physics.scene.shapes import Box, Capsule, Sphere
from physics.step.readout import Readout
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
