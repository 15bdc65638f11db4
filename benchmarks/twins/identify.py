"""What twins take from recorded motions: servo, pressed hands, braking of a puck."""

import numpy as np
from scipy.optimize import least_squares, minimize

from benchmarks.twins.recordings import Recording
from physics import World
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
        lacking = np.maximum(fetch.RESTING - hand[step, :, 2] - free[:, 2], 0.0)
        below.append(lacking)
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


def pressing(recording: Recording) -> tuple[float, float, float]:
    """`SLIDING`, `CREEPING` and `SINKING` of Fetch hands that press on the table.

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
        return np.asarray(fetch.braked(before[:, 2], free, *parameters) - kept)

    sliding, creeping = least_squares(lack, (1.0, 0.5)).x
    below = np.maximum(fetch.RESTING - before[:, 2] - free[:, 2], 0.0)
    sinking = below @ (fetch.RESTING - after[:, 2]) / (below @ below)
    return float(sliding), float(creeping), float(sinking)


def glides(recording: Recording) -> tuple[float, float]:
    """5 and 95 % quantiles in m/s of how fast pucks glide at the end of their episode.

    Of those that the hand hasn't been near for 12 steps, and whose speed has changed by less than
    12 mm/s in the last 8.
    """
    hand, puck = recording.observations[..., :3], recording.observations[..., 3:6]
    speed = np.linalg.norm(np.diff(puck[..., :2], axis=0), axis=2) / FRAME
    far = (np.linalg.norm((puck - hand)[-12:, :, :2], axis=2) > 0.07).all(axis=0)
    used = far & (puck[-1, :, 2] > 0.41) & (np.abs(speed[-1] - speed[-9]) < 0.012)
    low, high = np.quantile(speed[-4:, used].mean(axis=0), (0.05, 0.95))
    return float(low), float(high)


def braking(recording: Recording) -> tuple[float, float, float]:
    """`SLIDING`, `CREEPING` and `GLIDING` of FetchSlide from slides that nothing touches."""
    puck = recording.observations[..., 3:6]
    hand = recording.observations[..., :3]
    velocity = (recording.observations[..., 14:17] + recording.observations[..., 20:23]) / FRAME
    free = (np.linalg.norm((puck - hand)[..., :2], axis=-1) > 0.07) & (puck[..., 2] > 0.41)
    used = free[:-1] & free[1:] & (np.linalg.norm(velocity[:-1, :, :2], axis=-1) > 0.02)
    before, after = velocity[:-1, :, :2][used], velocity[1:, :, :2][used]

    def lack(parameters: Array) -> float:
        v = before
        for _ in range(4):
            v = v + 0.25 * FRAME * slide.braking(v, *parameters)
        return float(np.abs(v - after).mean())

    found = minimize(lack, (1.0, 5.0, 0.05), method="Nelder-Mead").x
    return float(found[0]), float(found[1]), float(found[2])
