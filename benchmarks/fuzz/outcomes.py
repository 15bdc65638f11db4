"""What comes of a scene: refused with a reason, run, diverged with a reason, or a finding."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.fuzz.families import Family
from benchmarks.fuzz.scenes import draw_scene
from physics import ContactOverflow, Features, SimulationDiverged, World

SUBSTEPS = 50  # that a scene runs
REFUSED, RAN, DIVERGED, FINDING = "refused", "ran", "diverged", "finding"
# what a message names: a field of a class, or an argument or parameter by itself
FIELD = re.compile(
    r"\b[A-Z][A-Za-z]+\.[a-z_]+"
    r"|\b(scene|fidelity|count|threads|time|mass|size|friction|restitution|measure_work)\b"
)


class Outcome(NamedTuple):
    """What came of a scene.

    Attributes:
        kind: REFUSED, RAN, DIVERGED or FINDING.
        reason: the message; of a finding also what is wrong with it.
        features: of its World; None if there is none.
    """

    kind: str
    reason: str = ""
    features: Features | None = None


def outcome_of(family: Family, number: int) -> Outcome:
    """Builds and runs scene `number` of a family."""
    try:
        scene, fidelity = draw_scene(family, number)
        world = World(scene, fidelity, threads=1)
    except (TypeError, ValueError) as error:
        if FIELD.search(str(error)):
            return Outcome(REFUSED, str(error))
        return Outcome(FINDING, f"a message that names no field: {error}")
    except MemoryError as error:  # says what is needed and what is free
        known = "memory are free" in str(error)
        return Outcome(REFUSED if known else FINDING, str(error))
    except Exception as error:
        return Outcome(FINDING, f"{type(error).__name__} at construction: {error}")
    try:
        for _ in range(SUBSTEPS):
            world.advance(fidelity.substep)
    except SimulationDiverged as error:
        known = "likely cause" in str(error)
        return Outcome(DIVERGED if known else FINDING, str(error), world.features)
    except ContactOverflow as error:  # overlapping deeply, or a wide skin; of particles alone
        particles = family.fidelity.get("geometry") == "particle"
        return Outcome(REFUSED if particles else FINDING, str(error), world.features)
    except Exception as error:
        return Outcome(FINDING, f"{type(error).__name__} in a step: {error}", world.features)
    if not np.isfinite(world.read().rows).all():
        return Outcome(FINDING, "a state that is not finite, without an error", world.features)
    return Outcome(RAN, "", world.features)


def save(folder: Path, family: Family, number: int, outcome: Outcome) -> Path:
    """Writes a script that runs a scene again, with what came of it."""
    folder.mkdir(exist_ok=True)
    path = folder / f"fuzz_{family.name.replace(' ', '_').replace(',', '')}_{number}.py"
    try:
        scene, fidelity = draw_scene(family, number)
        body = (
            f"world = World(Scene.from_json({scene.to_json()!r}),\n"
            f"              Fidelity.from_json({fidelity.to_json()!r}))\n"
            f"for _ in range({SUBSTEPS}):\n    world.advance(world.fidelity.substep)\n"
        )
    except (TypeError, ValueError) as error:
        body = f"# the scene itself is refused: {error}\n"
    path.write_text(
        f'"""{outcome.kind}: {outcome.reason}"""\n\nfrom physics import Fidelity, Scene, World\n\n'
        + body,
        encoding="utf-8",
    )
    return path
