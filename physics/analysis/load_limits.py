"""Checks before per-world parameters are used that no body is too light for what presses on it.

Where no material gives a stiffness, the springs of contacts are as stiff as the lighter body's mass
and the substep allow: k = m omega^2 (softer for plates and rods). A load of force F that arrives
with kinetic energy E is stopped at the depth d where k d^2 / 2 = F d + E. At half the width of a
body its centre is at the surface, at its whole width it is on the other side: it may stay there, or
come out with energy that nothing gave it. What can press on a body, all at once:

- a drive, with its force limit F along an axis. It strikes at about the speed v = F / (M omega_s)
  that this force gives its mass M in the time 1 / omega_s in which its servo responds, so
  E = M v^2 / 2 = F^2 / (2 M omega_s^2);
- other bodies on top, with their weight.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from physics.analysis.step_limits import given_stiffness
from physics.model.build import build
from physics.scene.drives import Gripper
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene

Array = np.ndarray

# deepest that loads may press a body into a static, as a fraction of its width
DEEPEST = 0.75


class _DriveLoad(NamedTuple):
    """A drive: its name, force limit in N, and energy in J with which it strikes."""

    name: str
    force: float
    energy: float


class LoadLimits:
    """The least mass of each body of a scene at a fidelity.

    The scene itself is accepted: who wrote it knows the loads. A body that is lighter in the scene
    than all that can press on it asks for may be as light in relation to that at other sizes and
    masses, too.

    Args:
        scene: the scene.
        fidelity: how it is simulated.
    """

    def __init__(self, scene: Scene, fidelity: Fidelity) -> None:
        """Finds what can press on each body, and how stiff its contact with statics is."""
        bodies, self._own = len(scene.bodies), Parameters.of(scene).mass
        self._scene, self._fidelity = scene, fidelity
        self._gravity = math.hypot(*scene.gravity)
        self._widths = np.array([body.shape.width for body in scene.bodies])
        # [bodies] N/m per kg; infinite where no load counts: no static can touch the body, or a
        # material gives a stiffness, so that contacts don't depend on masses
        self._stiffness = np.full(bodies, np.inf)
        self._drives: list[set[_DriveLoad]] = [set() for _ in range(bodies)]
        self._others: list[set[int]] = [set() for _ in range(bodies)]
        self._accepted = np.ones((1, bodies))  # part of the needed mass that the scene's body has
        if given_stiffness(scene):
            return
        model, _ = build(scene, fidelity)
        drives = _drive_loads(scene)
        for row in model.half_pair:
            i, j = sorted((int(row["owner"]), int(row["surface"])))
            if i >= bodies:
                continue
            if j >= len(model.dynamic):
                per_mass = float(row["stiffness"]) / self._own[0, i]
                self._stiffness[i] = min(self._stiffness[i], per_mass)
            elif j >= bodies:
                self._drives[i].add(drives[j - bodies])
            else:
                self._others[i].add(j)
                self._others[j].add(i)
        needed = self._needed(Parameters.of(scene))
        self._accepted = self._own / np.maximum(needed, self._own)

    def least_masses(self, p: Parameters) -> Array:
        """[n, bodies] kg, the least mass of each body at its size and the masses of the others."""
        return self._needed(p) * self._accepted

    def check(self, p: Parameters, worlds: Any = None) -> None:
        """Raises an error if a body is too light.

        Args:
            p: [n, bodies].
            worlds: [n] indices of the worlds, for the message.

        Raises:
            ValueError: it names the body, its mass, the largest load, and the least mass.
        """
        least = self.least_masses(p)
        light = p.mass < least * (1.0 - 1e-9)
        if not light.any():
            return
        row, i = (int(k) for k in np.argwhere(light)[0])
        where = "" if worlds is None else f" in world {worlds[row]}"
        largest, _ = max(self._loads(i, p), key=lambda load: float(load[1][row]))
        width = self._widths[i] * p.size[row, i]
        raise ValueError(
            f"mass {p.mass[row, i]:g} kg of {self._scene.solid_names[i]}{where} is too small for "
            f"Fidelity.substep {self._fidelity.substep:g} s: {largest} could press it into what it "
            f"lies on by {DEEPEST:g} of its width of {width:g} m; use at least "
            f"{_above(float(least[row, i]))} kg, a shorter substep, or build the World with "
            "allow_unstable=True"
        )

    def _needed(self, p: Parameters) -> Array:
        """[n, bodies] kg, masses of which all loads together press each body by `DEEPEST`."""
        masses = np.zeros(p.mass.shape)
        for i, stiffness in enumerate(self._stiffness):
            for _, needed in self._loads(i, p):
                masses[:, i] += needed / stiffness
        return masses

    def _loads(self, i: int, p: Parameters) -> Iterator[tuple[str, Array]]:
        """What can press on body i: its name, and the stiffness [n] in N/m that it needs."""
        depth = DEEPEST * self._widths[i] * p.size[:, i]
        for name, force, energy in sorted(self._drives[i]):
            yield name, 2.0 * (force * depth + energy) / depth**2
        for j in sorted(self._others[i]):
            yield self._scene.solid_names[j], 2.0 * p.mass[:, j] * self._gravity / depth


def _above(x: float) -> str:
    """Three digits of a positive number, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(x)) - 2)
    return f"{math.ceil(x / unit * (1.0 - 1e-12)) * unit:.3g}"


def _drive_loads(scene: Scene) -> list[_DriveLoad]:
    """That of each driven body: a finger has its gripper's, whose fingers press together."""
    found: list[_DriveLoad] = []
    for drive in scene.drives:
        fingers = 2 if isinstance(drive, Gripper) else 1
        energy = 0.5 * drive.force_limit**2 / (fingers * drive.mass * drive.frequency**2)
        name = scene.solid_names[len(scene.bodies) + len(found)]
        found += [_DriveLoad(name, drive.force_limit, energy)] * fingers
    return found
