"""Which scenes an integrator can advance."""

from physics.model.tables import Model
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene


def check_integrator(scene: Scene, fidelity: Fidelity, model: Model) -> None:
    """Raises an error if the forces of a scene don't follow from its state alone.

    Runge-Kutta methods evaluate forces several times a step, at trial states. Contacts and the set
    points of servos remember the step before, so there their forces are undefined. Joints hold by
    impulses that belong to the midpoint integrator's step.

    Raises:
        ValueError: another integrator than midpoint with joints; a Runge-Kutta method with solids
            that can touch or with drives.
    """
    if scene.joints and fidelity.integrator != "midpoint":
        raise ValueError(
            f"Fidelity.integrator {fidelity.integrator!r} can't hold joints, which act in the "
            f"middle and at the end of a step; the scene has {len(scene.joints)}: use "
            'integrator="midpoint"'
        )
    if fidelity.integrator not in ("rk4", "adaptive"):
        return
    problem = f"Fidelity.integrator {fidelity.integrator!r} evaluates forces at trial states, "
    others = 'or use integrator="midpoint" or "euler"'
    if scene.drives:
        raise ValueError(
            f"{problem}where those of a drive, whose set point moves once a step, are undefined; "
            f"the scene has {len(scene.driven_bodies)}: remove them, {others}"
        )
    if len(model.half_pair):
        pair = model.half_pair[0]
        one, two = sorted((int(pair["owner"]), int(pair["surface"])))
        names = scene.solid_names
        raise ValueError(
            f"{problem}where those of a contact, which remembers the step before, are undefined; "
            f"{names[one]} and {names[two]} can touch: give solids a group and a mask with which "
            f"none can, such as mask=0, {others}"
        )
