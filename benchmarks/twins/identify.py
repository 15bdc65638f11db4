"""What twins take from recorded motions: servo, braking of a puck, answers of the arms."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from scipy.optimize import least_squares, minimize

from benchmarks.twins import scripts
from benchmarks.twins.recordings import Kind, Recording, record
from rigid_envs.twins.arm import MOVED, Arm
from rigid_envs.twins.fetch import hand as fetch
from rigid_envs.twins.fetch import slide
from rigid_envs.twins.panda import hand as panda
from rigid_envs.twins.servo import Servo

Array = np.ndarray

FRAME = 0.04  # s

# of the arms' networks
EPISODES, STEPS, SEEDS = 250, 49, 7  # recorded for each seed of actions
HIDDEN, EPOCHS, BATCH, RATE = 128, 200, 2048, 8e-3


class Robot(NamedTuple):
    """Of which motions an arm is identified.

    Attributes:
        env_id: id of the original that is recorded.
        arm: what is identified.
        low: [3] m, lower corner of the box in which the hand wanders.
        high: [3] m, its upper corner.
        free: m, least height of a hand that doesn't touch the table.
        base: [3] m, of the origin of the arm's positions.
        velocity: first component of the hand's velocity in observations.
        per_step: whether that velocity is the displacement per step.
    """

    env_id: str
    arm: Arm
    low: Array
    high: Array
    free: float
    base: Array
    velocity: int
    per_step: bool


ROBOTS = {
    "Fetch": Robot(
        "FetchReach-v4", fetch.ARM, np.array([1.1, 0.4, 0.43]), np.array([1.95, 1.1, 0.72]),
        0.425, np.array([fetch.BASE, 0.0, 0.0]), 5, True,
    ),
    "Panda": Robot(
        "PandaReach-v3", panda.ARM, np.array([-0.25, -0.22, 0.03]), np.array([0.22, 0.22, 0.34]),
        0.01, np.zeros(3), 3, False,
    ),
}  # fmt: skip


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


def pressing(recording: Recording) -> tuple[float, float]:
    """`SLIDING` and `CREEPING` of Fetch hands that press on the table, from their last steps."""
    hand = recording.observations[..., :3]
    velocity = recording.observations[..., 5:8] / FRAME
    steps = range(len(recording.actions) - 3, len(recording.actions))
    before = np.concatenate([hand[step] for step in steps])
    free, _ = fetch.ARM.answer(
        before - (fetch.BASE, 0.0, 0.0),
        np.concatenate([velocity[step] for step in steps]),
        fetch.ARM.stride * np.concatenate([recording.actions[step, :, :3] for step in steps]),
        FRAME,
    )
    found = np.concatenate([hand[step + 1] for step in steps]) - before

    def lack(parameters: Array) -> Array:
        kept = fetch.braked(before[:, 2], free, *parameters)
        return np.asarray(kept - found[:, 1] / free[:, 1])

    sliding, creeping = least_squares(lack, (1.0, 0.5)).x
    return float(sliding), float(creeping)


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


def arm(robot: Robot, python: Path | None) -> str:
    """Records a robot's hand, trains its network and writes it; returns the errors."""
    episodes = []
    for seed in range(SEEDS):
        kind = Kind(
            robot.env_id, EPISODES, STEPS,
            lambda n, size, seed=seed: scripts.wandering(n, size, robot.low, robot.high, seed),  # type: ignore[misc]
        )  # fmt: skip
        episodes.append(record(kind, python))
    return train_arm(robot, episodes)


def train_arm(robot: Robot, recordings: list[Recording]) -> str:
    """Trains a robot's network with recordings and writes it; returns the errors.

    A tenth of the steps isn't trained on: the errors are theirs.
    """
    inputs, outputs = [], []
    for played in recordings:
        hand = played.observations[..., :3]
        velocity = played.observations[..., robot.velocity : robot.velocity + 3]
        velocity = velocity / FRAME if robot.per_step else velocity
        for step, actions in enumerate(played.actions):
            free = np.minimum(hand[step, :, 2], hand[step + 1, :, 2]) > robot.free
            asked = _asked(robot, hand[step], actions)
            x = robot.arm.inputs(hand[step] - robot.base, velocity[step], asked)
            moved = hand[step + 1] - hand[step], FRAME * velocity[step + 1]
            inputs.append(x[free])
            outputs.append((np.concatenate(moved, axis=1) / MOVED)[free])
    held = np.concatenate([np.full(len(x), i % 10 == 0) for i, x in enumerate(inputs)])
    known, answers = (
        torch.tensor(np.concatenate(part), dtype=torch.float32) for part in (inputs, outputs)
    )
    layers = _train(known[~held], answers[~held])
    with torch.no_grad():
        errors = 1e3 * MOVED * (layers(known[held]) - answers[held])[:, :3].norm(dim=-1)
    linear = [one for one in layers if isinstance(one, torch.nn.Linear)]
    numbers = {}
    for i, one in enumerate(linear):
        numbers[f"w{i}"] = np.ascontiguousarray(one.weight.detach().numpy().T)
        numbers[f"b{i}"] = one.bias.detach().numpy()
    np.savez(robot.arm.file, allow_pickle=False, **numbers)
    quantiles = torch.quantile(errors, torch.tensor([0.5, 0.9]))
    return f"displacement in a step: median error {quantiles[0]:.2f} mm, 90 % {quantiles[1]:.2f} mm"


def _asked(robot: Robot, position: Array, actions: Array) -> Array:
    """Displacement [n, 3] m that actions ask for."""
    if robot.arm is panda.ARM:
        return panda.asked_displacement(position, actions)
    return np.asarray(robot.arm.stride * actions[:, :3])


def _train(x: "torch.Tensor", y: "torch.Tensor") -> "torch.nn.Sequential":
    """A network of two hidden layers from inputs [n, 9] to outputs [n, 6]."""
    torch.manual_seed(0)
    layers = torch.nn.Sequential(
        torch.nn.Linear(x.shape[1], HIDDEN), torch.nn.Softsign(),
        torch.nn.Linear(HIDDEN, HIDDEN), torch.nn.Softsign(),
        torch.nn.Linear(HIDDEN, y.shape[1]),
    )  # fmt: skip
    optimizer = torch.optim.Adam(layers.parameters())
    steps = EPOCHS * (len(x) // BATCH)
    rates = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
    for _ in range(EPOCHS):
        order = torch.randperm(len(x))
        for first in range(0, len(x) - BATCH + 1, BATCH):
            batch = order[first : first + BATCH]
            loss = torch.nn.functional.smooth_l1_loss(layers(x[batch]), y[batch], beta=0.1)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            rates.step()
    return layers
