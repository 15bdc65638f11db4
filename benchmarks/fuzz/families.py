"""Families of scenes: what decides the kernel is fixed, so that each is compiled once.

A kernel depends on the kinds of solids and laws, not on sizes, masses or materials above zero. A
family therefore fixes the shapes, the statics, the drives, the fields, the joints and the laws.
"""

from typing import Any, NamedTuple


class Family(NamedTuple):
    """Scenes of the same kinds of solids and settings, with one kernel or a few.

    Attributes:
        name: of the family.
        shapes: of the bodies, in order: "ball", "box", "capsule", "cylinder", "torus", "compound".
        statics: "ground", or a shape.
        drives: shapes of drives, or "gripper".
        fields: "spring", "attractor", "drag".
        joint: class of a joint between the first two bodies, or "".
        smooth: without friction.
        resists: with rolling and spinning resistance.
        tilted: gravity in any direction; otherwise downwards.
        fidelity: fields of Fidelity that the kernel depends on.
    """

    name: str
    shapes: tuple[str, ...]
    statics: tuple[str, ...] = ("ground",)
    drives: tuple[str, ...] = ()
    fields: tuple[str, ...] = ()
    joint: str = ""
    smooth: bool = False
    resists: bool = False
    tilted: bool = False
    fidelity: dict[str, Any] = {}

    @property
    def share(self) -> float:
        """How many scenes, relative to others: where the step varies, one takes far longer."""
        varies = self.fidelity.get("integrator") == "adaptive" or "time_control" in self.fidelity
        return 0.05 if varies else 1.0


IMPULSE = {"law": "impulse"}
NEWTON = {"law": "impulse", "solver": "newton"}

FAMILIES: tuple[Family, ...] = (
    Family("one ball", ("ball",)),
    Family("one ball, impulses", ("ball",), fidelity=IMPULSE),
    Family("smooth balls", ("ball", "ball", "ball"), smooth=True),
    Family("balls", ("ball",) * 6),
    Family("one box", ("box",)),
    Family("one box, tilted", ("box",), tilted=True),
    Family("boxes, tilted", ("box", "box"), statics=("ground", "box"), tilted=True),
    Family("boxes", ("box", "box", "box")),
    Family("boxes, impulses", ("box", "box", "box"), fidelity=IMPULSE),
    Family("boxes, Newton", ("box", "box", "ball"), fidelity=NEWTON),
    Family("boxes, swept, Newton", ("box", "box"), fidelity={"time_control": "swept", **NEWTON}),
    Family("boxes, dashpot", ("box", "box"), fidelity={"damping": "dashpot"}),
    Family("boxes, viscous", ("box", "box"), fidelity={"friction": "viscous"}),
    Family("boxes, euler", ("box", "box"), fidelity={"integrator": "euler"}),
    Family("boxes, halved", ("box", "box"), fidelity={"time_control": "adaptive"}),
    Family("boxes, halved impulses", ("box", "box"), fidelity={"time_control": "adaptive",
                                                              **IMPULSE}),
    Family("boxes, bisection", ("box", "box"), fidelity={"time_control": "bisection", **IMPULSE}),
    Family("boxes, swept", ("box", "box"), fidelity={"time_control": "swept", **IMPULSE}),
    Family("boxes, particles", ("box", "box"), fidelity={"geometry": "particle"}),
    Family("box on a slab", ("box", "ball"), statics=("box",)),
    Family("box on a slab, impulses", ("box", "ball"), statics=("box",), fidelity=IMPULSE),
    Family("mixture", ("ball", "box", "capsule", "ball", "box", "capsule")),
    Family("mixture, impulses", ("ball", "box", "capsule", "ball", "box", "capsule"),
           fidelity=IMPULSE),
    Family("capsules that resist", ("capsule", "capsule"), resists=True),
    Family("cylinders", ("cylinder", "cylinder", "box")),
    Family("cylinders, impulses", ("cylinder", "cylinder", "box"), fidelity=IMPULSE),
    Family("torus", ("torus", "ball")),
    Family("compounds", ("compound", "compound")),
    Family("compounds, impulses", ("compound", "compound"), fidelity=IMPULSE),
    Family("drive", ("box", "ball"), drives=("ball",)),
    Family("gripper", ("box",), drives=("gripper",)),
    Family("gripper, impulses", ("box",), drives=("gripper",), fidelity=IMPULSE),
    Family("fields", ("box", "ball"), fields=("spring", "attractor", "drag")),
    Family("fields alone, rk4", ("box",), statics=(), fields=("spring", "attractor", "drag"),
           fidelity={"integrator": "rk4"}),
    Family("fields alone, adaptive", ("box",), statics=(), fields=("spring", "attractor", "drag"),
           fidelity={"integrator": "adaptive"}),
    Family("hinge", ("box", "box"), joint="Hinge"),
    Family("ball joint, impulses", ("box", "box"), joint="BallJoint", fidelity=IMPULSE),
)  # fmt: skip
