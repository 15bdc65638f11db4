"""Replays a saved failure: every step of its episode, and every substep of the worst one."""

from pathlib import Path

import numpy as np

from benchmarks.adversarial.balance import Balance, energy, start_energy, work
from benchmarks.adversarial.failures import load
from benchmarks.adversarial.measured_runner import MeasuredRunner
from physics import SimulationDiverged, World
from physics.step.time_layers import substep_count

Array = np.ndarray

NOBODY = np.zeros(1, dtype=bool)
HEAD = "      time s  kinetic mJ   drives mJ  elastic mJ potential mJ     work mJ     gain mJ"


def replay(path: Path) -> None:
    """Prints what happens."""
    failure = load(path)
    runner = MeasuredRunner(failure.task, failure.preset, failure.parameters, 1, 1)
    runner.start_episode(failure.seed, failure.episode)
    world, balance = runner.world, Balance(runner.world)
    print(f"{failure.task} at {failure.preset}, {failure.parameters} parameters: {failure.what}")
    print(f"seed {failure.seed}, episode {failure.episode}; parameters {world.parameters}")
    print(HEAD)
    begin = start_energy(world)[0]
    print(_line(world, begin))
    worst, rise, gain = 0, -np.inf, 0.0
    for step, action in enumerate(np.array(failure.actions)):
        before = world.snapshot()
        try:
            runner.step(action[None])
        except SimulationDiverged as error:
            print(error)
            worst, saved = step, before
            break
        balance.update(world, NOBODY)
        print(f"{_line(world, begin)}  step {step}")
        if balance.gain[0] - gain > rise:
            worst, rise, saved = step, balance.gain[0] - gain, before
        gain = balance.gain[0]
    if failure.actions:
        print(f"substeps of step {worst}:\n{HEAD}")
        world.restore(saved)
        runner.command(np.array(failure.actions)[worst][None])
        _show_substeps(world, runner.task.frame, begin)


def _show_substeps(world: World, frame: float, begin: float) -> None:
    """Prints every substep of a step, and the contacts after it."""
    count = substep_count(frame, world.fidelity.substep)
    for _ in range(count):
        try:
            world.advance(frame / count)
        except SimulationDiverged as error:
            print(error)
            return
        print(_line(world, begin))
        contacts = world.contacts()
        touching: dict[tuple[str, str], tuple[float, float, int]] = {}
        for names, penetration, normal, force in zip(
            contacts.names, contacts.penetration, contacts.normal, contacts.force, strict=True
        ):
            deepest, pressing, points = touching.get(names, (0.0, 0.0, 0))
            pressing += float(force @ normal)
            touching[names] = (max(deepest, float(penetration)), pressing, points + 1)
        for names, (deepest, pressing, points) in touching.items():
            print(
                f"{'':14}{names[0]} on {names[1]}: {points} points, "
                f"{1e3 * deepest:.4g} mm, {pressing:.4g} N"
            )


def _line(world: World, begin: float) -> str:
    """Energies in mJ, and what they exceed those at the start and the servos' work by."""
    parts = (
        world.kinetic_energy()[0], world.drive_energy()[0].sum(), world.elastic_energy()[0],
        world.potential_energy()[0], work(world)[0], energy(world)[0] - begin - work(world)[0],
    )  # fmt: skip
    return f"{world.time[0]:12.4f}" + "".join(f"{1e3 * part:12.4f}" for part in parts)
