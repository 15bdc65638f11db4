"""What `explain` says of bodies that stand: where soft contacts let them tip, and what a pull does.

The derivation is in `analysis.standing`.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from physics.analysis.solver_limits import check_solver
from physics.analysis.standing import base, pull, tipping
from physics.analysis.step_limits import given_stiffness
from physics.engines import choose_engine
from physics.model.rocking import outward_sides
from physics.model.tables import Model
from physics.rotation import rotate_back
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.fidelity import NEWTON, Fidelity
from physics.scene.mesh import Mesh
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Samples
from physics.tuning.description import code

_PULL = 0.9  # of the friction limit: a pull that is named
_LOSS = 0.05  # of the angle at which a body tips: above it a better setting is named


def standing(scene: Scene, fidelity: Fidelity, model: Model, names: list[str]) -> Iterator[str]:
    """Lines about each kind of body that stands on a static or ground as the scene begins.

    Args:
        scene: the scene.
        fidelity: the fidelity.
        model: its tables.
        names: of all solids; bodies with equal names count as one kind.
    """
    gravity = np.array(scene.gravity)
    if not np.any(gravity):
        return
    known: set[str] = set()
    for row in model.half_pair:
        i, j = int(row["owner"]), int(row["surface"])
        pair = f"{names[i]} on {names[j]}"
        if i >= len(scene.bodies) or j < len(model.dynamic) or pair in known:
            continue
        lines = list(_of_body(scene, fidelity, model, row))
        if lines:
            known.add(pair)
            yield pair
            yield from (f"  {line}" for line in lines)


def _of_body(scene: Scene, fidelity: Fidelity, model: Model, row: Any) -> Iterator[str]:
    body, first = scene.bodies[int(row["owner"])], int(row["first_sample"])
    g = math.hypot(*scene.gravity)
    down = rotate_back(np.array(body.orientation), np.array(scene.gravity) / g)
    columns = model.sample[:, first : first + int(row["sample_count"])]
    radius = float(row["owner_radius"])
    samples = Samples(columns[:3].T, columns[3], radius, bool(row["axial"]))
    shape = body.shape
    if isinstance(shape, Mesh):  # its samples are another set with each setting
        return
    stands = base(samples, outward_sides(shape), down)
    if stands is None:
        return
    mass, stiffness = float(row["pair_mass"]), float(row["stiffness"])
    sink = g * mass / stiffness
    found = tipping(stands, sink)
    # what has no edges is as round as it touches
    edge = radius if isinstance(shape, Box | Cylinder | Compound) else 0.0
    sharp = math.atan2(float(stands.arms[0]) + edge, stands.height)
    rigid, gradual, sudden = (
        f"{max(math.degrees(angle), 0.0):.3g}°" for angle in (sharp, found.gradual, found.sudden)
    )
    yield (
        f"tips at {rigid} if it were rigid and sharp; here at {gradual} under a load that grows "
        f"slowly, and from {sudden} on when set down without overlap"
    )
    friction = float(row["friction"])
    holds = fidelity.law == "spring" and fidelity.friction == "coulomb"
    if holds and 0.0 < friction < math.tan(found.gradual):  # it slides before it tips
        shear = g * mass / float(row["shear_stiffness"])
        half, most = (pull(stands, sink, shear, friction, part, g) for part in (0.5, _PULL))
        yield (
            f"a pull of half its friction moves it by {1e3 * half.gradual:.3g} mm, twice that at "
            f"most if it comes at once; {_PULL:g} of it at once by up to {1e3 * most.sudden:.3g} mm"
        )
    loss = (found.rigid - found.sudden) / found.rigid
    if loss > _LOSS:
        better = _better(scene, fidelity, loss)
        yield f"to lose at most {100.0 * _LOSS:g} % of that angle by sinking: {better}"


def _better(scene: Scene, fidelity: Fidelity, loss: float) -> str:
    """The setting at which `_LOSS` of the angle is lost instead of `loss`."""
    if given_stiffness(scene):  # the loss is proportional to 1 / sqrt(stiffness)
        return f"materials {(loss / _LOSS) ** 2:.2g} times as stiff"
    shorter = f"substep={fidelity.substep * _LOSS / loss:.2g}"
    if fidelity.solver == "newton":
        return shorter
    try:
        check_solver(scene, NEWTON, choose_engine(scene, NEWTON))
    except ValueError:
        return shorter
    return f"{shorter}, or {code(NEWTON)}"
