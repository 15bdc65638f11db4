"""What twins take from recorded motions: servo, pressed hands, hits and braking of a puck."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize

from benchmarks.twins.recordings import Recording
from benchmarks.twins.replay import replay, speed_ratios
from physics import Body, Material, World
from rigid_envs.twins.fetch import hand as fetch
from rigid_envs.twins.fetch import slide
from rigid_envs.twins.fetch.pick_and_place import FetchPickAndPlace
from rigid_envs.twins.fetch.reach import FetchReach
from rigid_envs.twins.servo import Servo

Array = np.ndarray

FRAME = 0.04  # s


def servo(recording: Recording) -> tuple[float, float]:
    """Frequency and damping of the Fetch hand, where the arm isn't stretched.

    By least squares, a linear law of one step: displacement and next velocity along each axis from
    action, velocity and a constant. Then the servo whose law is nearest.
    """
    hand, velocity = recording.observations[..., :3], recording.observations[..., 5:8] / FRAME
    x = np.stack([recording.actions[..., :3], velocity[:-1], np.ones_like(velocity[:-1])], axis=-1)
    y = np.stack([np.diff(hand, axis=0), velocity[1:]], axis=-1)
    laws = [
        np.linalg.lstsq(x[:, :, axis].reshape(-1, 3), y[:, :, axis].reshape(-1, 2), rcond=None)[0]
        for axis in range(3)
    ]
    law = np.mean(laws, axis=0)

    def lack(parameters: Array) -> Array:
        frequency, damping, stride = parameters
        M = Servo.transition.__wrapped__(Servo(frequency, damping), FRAME)
        found = np.array([[stride * (1.0 - M[0, 0]), -stride * M[1, 0]], [M[0, 1], M[1, 1]]])
        return np.asarray((found - law[:2]) * ((1.0, FRAME), (1.0 / FRAME, 1.0))).ravel()

    frequency, damping, _ = least_squares(lack, (50.0, 1.0, 0.05)).x
    return frequency, damping


def grips(recording: Recording) -> tuple[float, float]:
    """`HOLDING` and `FINGER_CREEPING` of Fetch hands that close while they press on the table.

    Of the steps in which a free finger would move by more than a millimetre.
    """
    hand, velocity = recording.observations[..., :3], recording.observations[..., 20:23] / FRAME
    fingers = recording.observations[..., 9:11].mean(axis=-1)
    speeds = recording.observations[..., 23:25].mean(axis=-1) / FRAME
    task = FetchPickAndPlace()
    world = World(task.scene(), count=hand.shape[1])
    ahead, before, below, moved = [], [], [], []
    for step, actions in enumerate(recording.actions):
        asked = fetch.STRIDE * actions[:, :3]
        free = task.hand.arm.respond(world, hand[step], velocity[step], asked, FRAME).moved[:, -1]
        world.advance(FRAME)
        below.append(fetch.lifted(hand[step, :, 2], free[:, 2])[1])
        ahead.append(np.clip(fingers[step] + actions[:, 3], 0.0, fetch.FARTHEST) - fingers[step])
        before.append(speeds[step])
        moved.append(fingers[step + 1] - fingers[step])
    parts = [np.concatenate(x) for x in (ahead, before, below, moved)]
    used = (parts[0] < -1e-3) & (parts[2] > 1e-3)
    a, v, b, m = (x[used] for x in parts)

    def lack(parameters: Array) -> float:
        return float(np.abs(fetch.fingers_move(a, v, b, FRAME, *parameters)[0] - m).mean())

    found = minimize(lack, (2.0, 0.01), method="Nelder-Mead").x
    return float(found[0]), float(found[1])


def pressing(recording: Recording) -> tuple[float, float, float, float]:
    """`SLIDING`, `CREEPING`, `SINKING` and `FIRM` of Fetch hands that press on the table.

    From their last steps.
    """
    hand, velocity = recording.observations[..., :3], recording.observations[..., 5:8] / FRAME
    world = World(FetchReach().scene(), count=hand.shape[1])
    steps = []
    for step, actions in enumerate(recording.actions):
        asked = fetch.STRIDE * actions[:, :3]
        arm = FetchReach.hand.arm
        moved = arm.respond(world, hand[step], velocity[step], asked, FRAME).moved[:, -1]
        world.advance(FRAME)
        steps.append((hand[step], hand[step + 1], moved))
    before, after, free = (np.concatenate(parts) for parts in zip(*steps[-3:], strict=True))
    kept = (after - before)[:, 1] / free[:, 1]

    def lack(parameters: Array) -> Array:
        return np.asarray(fetch.braked(before[:, 2], free, *parameters)[:, 1] - kept)

    sliding, creeping = least_squares(lack, (1.0, 0.5)).x
    below = fetch.lifted(before[:, 2], free[:, 2])[1]

    def deeper(parameters: Array) -> Array:
        return np.asarray(1e3 * (fetch.sunk(below, *parameters) - fetch.RESTING + after[:, 2]))

    sinking, firm = least_squares(deeper, (0.1, 3e-3)).x
    return float(sliding), float(creeping), float(sinking), float(firm)


class FetchSlideWith(slide.FetchSlide):
    """FetchSlide with another restitution of the puck."""

    def __init__(self, restitution: float) -> None:
        super().__init__()
        self._material = Material(1.0, restitution)

    def object(self) -> Body:
        return replace(super().object(), material=self._material)


def restitution(recording: Recording) -> float:
    """`RESTITUTION` of FetchSlide's puck, with which it is as fast as there when it is hit.

    In the median of the ratios of the largest speeds, at `balanced`.
    """

    tried = np.linspace(0.0, 0.8, 9)
    ratios = [
        np.median(speed_ratios(recording, replay(recording, FetchSlideWith(e)))) for e in tried
    ]
    return float(np.interp(1.0, ratios, tried))


class Slides(NamedTuple):
    """Pucks from where the hand has left them to the end of their episode.

    Attributes:
        position: [n, 2] m, at the start.
        velocity: [n, 2] m/s, at the start.
        steps: [n], left in the episode.
        end: [n, 2] m, where they are then.
    """

    position: Array
    velocity: Array
    steps: Array
    end: Array

    @classmethod
    def of(cls, recording: Recording) -> "Slides":
        """Those of a recording that are on the table and faster than 0.3 m/s."""
        hand, puck = recording.observations[..., :3], recording.observations[..., 3:6]
        velocity = recording.observations[..., 14:17] + recording.observations[..., 20:23]
        near = np.linalg.norm((puck - hand)[..., :2], axis=-1) < 0.075
        last = len(near) - 1
        start = np.minimum(last - np.argmax(near[::-1], axis=0) + 2, last)
        episodes = np.arange(len(start))
        v = velocity[start, episodes, :2] / FRAME
        used = (start < last - 14) & (puck[-1, :, 2] > 0.41) & (np.linalg.norm(v, axis=1) > 0.3)
        return cls(puck[start, episodes, :2][used], v[used], (last - start)[used],
                   puck[-1, used, :2])  # fmt: skip

    def miss(self, deceleration: float, damping: float, gliding: Any) -> Array:
        """How far [n, 2] m beyond its end a law has each puck; as the twin, a frame at a time."""
        position, velocity = self.position, self.velocity
        for step in range(self.steps.max()):
            after = velocity + FRAME * slide.braking(velocity, deceleration, damping, gliding)
            moving = (step < self.steps)[:, None]
            position = position + np.where(moving, 0.5 * FRAME * (velocity + after), 0.0)
            velocity = after
        return position - self.end

    def braking(self) -> tuple[float, float, float]:
        """`DECELERATION`, `DAMPING` and a `GLIDING` with which all are nearest to their end."""

        def lack(parameters: Array) -> float:
            deceleration, damping, gliding = parameters
            miss = self.miss(deceleration, damping, max(gliding, 0.0))
            return float(np.linalg.norm(miss, axis=1).mean())

        found = minimize(lack, (1.0, 7.0, 0.03), method="Nelder-Mead").x
        return float(found[0]), float(found[1]), float(found[2])

    def misses(self) -> float:
        """Median distance in m of their ends from those with the braking of the twin."""
        miss = self.miss(slide.DECELERATION, slide.DAMPING, slide.GLIDING)
        return float(np.median(np.linalg.norm(miss, axis=1)))

    def glides(self, deceleration: float, damping: float) -> tuple[float, float]:
        """5 and 95 % quantiles of the speeds in m/s of gliding, one for each puck."""
        direction = self.velocity / np.linalg.norm(self.velocity, axis=1, keepdims=True)
        tried = np.linspace(0.0, 0.12, 49)
        along = [np.sum(self.miss(deceleration, damping, g) * direction, axis=1) for g in tried]
        each = [np.interp(0.0, row, tried) for row in np.array(along).T]
        low, high = np.quantile(each, (0.05, 0.95))
        return float(low), float(high)
