"""A rigid-body engine on numba. It simulates thousands of worlds at once on CPU threads."""

from physics.errors import ContactOverflow, SimulationDiverged, StepVanished
from physics.model.contacts import Contacts
from physics.model.features import Features
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.drives import Drive, Gripper
from physics.scene.fidelity import PRESETS, Fidelity
from physics.scene.fields import Attractor, Drag, PointSpring, SurfaceDrag
from physics.scene.joints import BallJoint, Distance, Hinge, Motor, Slider, Weld
from physics.scene.material import Material
from physics.scene.mesh import Mesh
from physics.scene.parameters import Parameters
from physics.scene.part import Part
from physics.scene.particles import Particles
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.scene.torus import Torus
from physics.step.readout import Readout
from physics.tuning.explain import explain
from physics.tuning.tune import Tuned, tune
from physics.world import Snapshot, World

__all__ = [
    "PRESETS",
    "Attractor",
    "BallJoint",
    "Body",
    "Box",
    "Capsule",
    "Compound",
    "ContactOverflow",
    "Contacts",
    "Cylinder",
    "Distance",
    "Drag",
    "Drive",
    "Features",
    "Fidelity",
    "Gripper",
    "Ground",
    "Hinge",
    "Material",
    "Mesh",
    "Motor",
    "Parameters",
    "Part",
    "Particles",
    "PointSpring",
    "Readout",
    "Scene",
    "SimulationDiverged",
    "Slider",
    "Snapshot",
    "Sphere",
    "Static",
    "StepVanished",
    "SurfaceDrag",
    "Torus",
    "Tuned",
    "Weld",
    "World",
    "explain",
    "tune",
]
