"""Recorded actions played in twins, and how far the paths differ."""

from typing import NamedTuple

import numpy as np

from benchmarks.twins.recordings import Recording
from physics import World
from rigid_envs.twins import TWINS
from rigid_envs.twins.grasping_twin import GraspingTwin
from rigid_envs.twins.twin import Twin

Array = np.ndarray

# first component of the object's position in observations, by the first word of names
OBJECT = {"fetch": 3, "panda": 6}
FINGERS = 9  # first component of the two fingers, of Fetch


class Replay(NamedTuple):
    """What a twin does with recorded actions.

    Attributes:
        hand: [steps + 1, episodes, 3] m.
        body: [steps + 1, episodes, 3] m, of the object; no steps if there is none.
        opening: [steps + 1, episodes] m, how far each finger is open; 0 of closed hands.
    """

    hand: Array
    body: Array
    opening: Array


def replay(recording: Recording, twin: Twin, fidelity: str = "balanced") -> Replay:
    """Plays recorded actions from the recorded starts, in all episodes at once."""
    count = recording.actions.shape[1]
    world = World(twin.scene(), fidelity, count)
    first = OBJECT[type(twin).__name__[:5].lower()]
    bodies = len(world.scene.bodies)
    twin.start(world, np.ones(count, dtype=bool), np.full((count, twin.draw_count), 0.5))
    if bodies:
        world.set_state(position=recording.observations[0, :, None, first : first + 3])
    hands, body, opening = [], [], []
    hand = twin.hand  # type: ignore[attr-defined]
    now = world.read()
    for step in range(len(recording.actions) + 1):
        hands.append(np.array(hand.position(now)))
        opening.append(hand.opening(now) if isinstance(twin, GraspingTwin) else np.zeros(count))
        if bodies:
            body.append(np.array(now.position[:, 0]))
        if step < len(recording.actions):
            twin.advance(world, now, recording.actions[step])
            now = world.read()
    return Replay(np.array(hands), np.array(body), np.array(opening))


def hand_errors(recording: Recording, found: Replay, steps: int = 12) -> Array:
    """Distance [episodes] m of the hands after some steps."""
    offset = found.hand[steps] - recording.observations[steps, :, :3]
    return np.asarray(np.linalg.norm(offset, axis=1))


def finger_errors(recording: Recording, found: Replay) -> Array:
    """How far the fingers [episodes] m of Fetch hands are off after the last step."""
    there = recording.observations[-1, :, FINGERS : FINGERS + 2].mean(axis=1)
    return np.asarray(np.abs(found.opening[-1] - there))


def body_errors(recording: Recording, found: Replay, first: int) -> Array:
    """Distance [episodes] m of the objects after the last step."""
    offset = found.body[-1] - recording.observations[-1, :, first : first + 3]
    return np.asarray(np.linalg.norm(offset, axis=1))


def speed_ratios(recording: Recording, found: Replay) -> Array:
    """Largest speed [episodes] of Fetch's objects, in a step along the table, over that there."""
    here, there = (
        np.linalg.norm(np.diff(path[..., :2], axis=0), axis=2).max(axis=0)
        for path in (found.body, recording.observations[..., OBJECT["fetch"] :])
    )
    return np.asarray(here / there)


PRESSED = 20  # steps after which hands have moved along the table for five
# recordings by name: the twin that plays them
REPLAYED = {
    "fetch-axes": "fetch_reach",
    "fetch-motions": "fetch_reach",
    "fetch-presses": "fetch_reach",
    "fetch-grips": "fetch_pick_and_place",
    "fetch-pushes": "fetch_push",
    "fetch-slides": "fetch_slide",
    "panda-axes": "panda_reach",
    "panda-motions": "panda_reach",
    "panda-presses": "panda_reach",
    "panda-pushes": "panda_push",
}


def summary() -> list[str]:
    """A line for each recording: errors of the hand or fingers; of objects, at two presets."""
    lines = []
    for name, twin in REPLAYED.items():
        recording = Recording.load(name)
        found = replay(recording, TWINS[twin]())
        if name == "fetch-grips":
            errors = finger_errors(recording, found)
            lines.append(_line(name, "fingers after the last step", errors))
        elif len(found.body):
            for fidelity in ("balanced", "solid"):
                found = replay(recording, TWINS[twin](), fidelity)
                errors = body_errors(recording, found, OBJECT[name[:5]])
                lines.append(_line(name, f"object after the last step, {fidelity}", errors))
                if name == "fetch-slides":
                    low, middle, high = np.quantile(speed_ratios(recording, found), (0.1, 0.5, 0.9))
                    lines.append(
                        f"{name:14} {f'largest speed of the puck, {fidelity}':38} median "
                        f"{middle:.2f} of that there, 80 % {low:.2f} to {high:.2f}"
                    )
        else:
            steps = PRESSED if name.endswith("presses") else 12
            errors = hand_errors(recording, found, steps)
            lines.append(_line(name, f"hand after {steps} steps", errors))
    return lines


def _line(name: str, what: str, errors: Array) -> str:
    median, most = 1e3 * np.median(errors), 1e3 * np.quantile(errors, 0.9)
    return f"{name:14} {what:38} median {median:6.2f} mm, 90 % within {most:6.2f} mm"
