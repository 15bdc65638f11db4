"""Checks before per-world parameters are used that no body is too light for what presses it.

Where no material gives a stiffness, contacts are as stiff as the lighter body's mass and the
substep allow: k = m omega^2. A load of force F that arrives with kinetic energy E is stopped at the
depth d where k d^2 / 2 = F d + E. A body that is pressed in by its whole width is on the other side
of the surface: it may stay there, or come out with energy that nothing gave it. What presses:

- a drive, with its force limit F along an axis. It strikes at about the speed v = F / (M omega_s)
  that this force gives its mass M in the time 1 / omega_s in which its servo responds, so
  E = M v^2 / 2 = F^2 / (2 M omega_s^2);
- a heavier body on top, with its weight.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from physics.model.build import build
from physics.scene.drives import Gripper
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene

Array = np.ndarray


class _Striker(NamedTuple):
    """A drive: its name, force limit in N, and energy in J with which it strikes."""

    name: str
    force: float
    energy: float


class LoadLimits:
    """The least mass of each body of a scene at a fidelity.

    The masses in the scene are accepted, for who wrote it knows what presses; parameters must not
    make it worse. How small a body may become at these masses is left to `step_limits`.

    Args:
        scene: the scene.
        fidelity: how it is simulated.
    """

    def __init__(self, scene: Scene, fidelity: Fidelity) -> None:
        """Finds what can press each body, and how stiff its contact with statics is."""
        bodies = len(scene.bodies)
        self._scene, self._fidelity = scene, fidelity
        self._gravity = math.hypot(*scene.gravity)
        own = Parameters.of(scene).mass[0]
        self._widths = np.array([body.shape.width for body in scene.bodies])
        # [bodies] N/m per kg; infinite where no load counts: no static can touch the body, or a
        # material gives a stiffness, which doesn't depend on masses
        self._stiffness = np.full(bodies, np.inf)
        self._strikers: list[set[_Striker]] = [set() for _ in range(bodies)]
        self._others: list[set[int]] = [set() for _ in range(bodies)]
        solids = (*scene.bodies, *scene.driven_bodies, *scene.statics)
        if any(solid.material.stiffness is not None for solid in solids):
            return
        model, _ = build(scene, fidelity)
        strikers = _strikers(scene)
        for row in model.half_pair:
            i, j = sorted((int(row["owner"]), int(row["surface"])))
            if i >= bodies:
                continue
            if j >= len(model.dynamic):
                softest = float(min(row["stiffness"], row["sweep_stiffness"]))
                self._stiffness[i] = min(self._stiffness[i], softest / own[i])
            elif j >= bodies:
                self._strikers[i].add(strikers[j - bodies])
            else:
                self._others[i].add(j)
                self._others[j].add(i)

    def least_masses(self, p: Parameters) -> Array:
        """[n, bodies] kg, the least mass of each body at its size and the masses of the others."""
        own = Parameters.of(self._scene, len(p.mass))._replace(size=p.size)
        accepted = np.maximum(self._bearing(own) / own.mass, 1.0)
        return self._bearing(p) / accepted

    def _bearing(self, p: Parameters) -> Array:
        """[n, bodies] kg, masses whose contacts are stiff enough for all loads."""
        least = np.zeros(p.mass.shape)
        for i, stiffness in enumerate(self._stiffness):
            for _, needed in self._loads(i, p):
                least[:, i] = np.maximum(least[:, i], needed / stiffness)
        return least

    def check(self, p: Parameters, worlds: Any = None) -> None:
        """Raises an error if a body is too light.

        Args:
            p: [n, bodies].
            worlds: [n] indices of the worlds, for the message.

        Raises:
            ValueError: it names the body, its mass, what presses it, and the least mass.
        """
        least = self.least_masses(p)
        light = p.mass < least * (1.0 - 1e-9)
        if not light.any():
            return
        row, i = (int(k) for k in np.argwhere(light)[0])
        where = "" if worlds is None else f" in world {worlds[row]}"
        load = max(self._loads(i, p), key=lambda load: float(load[1][row]))[0]
        raise ValueError(
            f"mass {p.mass[row, i]:g} kg of {self._scene.solid_names[i]}{where} is too small for "
            f"Fidelity.substep {self._fidelity.substep:g} s: {load} could press it through what it "
            f"lies on, by its width of {self._widths[i] * p.size[row, i]:g} m; use at least "
            f"{_above(float(least[row, i]))} kg, a shorter substep, or build the World with "
            "allow_unstable=True"
        )

    def _loads(self, i: int, p: Parameters) -> Iterator[tuple[str, Array]]:
        """What can press body i: its name, and the stiffness [n] in N/m that stops it."""
        depth = self._widths[i] * p.size[:, i]
        for name, force, energy in sorted(self._strikers[i]):
            yield name, 2.0 * (force * depth + energy) / depth**2
        for j in sorted(self._others[i]):
            yield self._scene.solid_names[j], 2.0 * p.mass[:, j] * self._gravity / depth


def _above(x: float) -> str:
    """Three digits of a positive number, rounded up."""
    unit = 10.0 ** (math.floor(math.log10(x)) - 2)
    return f"{math.ceil(x / unit * (1.0 - 1e-12)) * unit:.3g}"


def _strikers(scene: Scene) -> list[_Striker]:
    """The drive of each driven body: for a finger its gripper, whose fingers press together."""
    found: list[_Striker] = []
    for drive in scene.drives:
        fingers = 2 if isinstance(drive, Gripper) else 1
        energy = 0.5 * drive.force_limit**2 / (fingers * drive.mass * drive.frequency**2)
        name = scene.solid_names[len(scene.bodies) + len(found)]
        found += [_Striker(name, drive.force_limit, energy)] * fingers
    return found
