"""What twins take from recorded motions: the Fetch hand's servo, the Panda arm's answer."""

from pathlib import Path

import numpy as np
import torch
from scipy.optimize import least_squares, minimize

from benchmarks.twins import scripts
from benchmarks.twins.recordings import Kind, Recording, record
from rigid_envs.twins.fetch import slide
from rigid_envs.twins.panda import arm
from rigid_envs.twins.servo import Servo

Array = np.ndarray

FRAME = 0.04  # s

# of the Panda arm's network
EPISODES, STEPS, SEEDS = 250, 49, 7  # recorded for each seed of actions
HIDDEN, EPOCHS, BATCH, RATE = 64, 60, 2048, 8e-3
LOW, HIGH = np.array([-0.25, -0.22, 0.03]), np.array([0.22, 0.22, 0.34])  # m


def servo(recording: Recording) -> tuple[float, float, float, Array]:
    """Frequency, damping, stride and sag of the Fetch hand.

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

    frequency, damping, stride = least_squares(lack, (50.0, 1.0, 0.05)).x
    M = Servo(frequency, damping).transition(FRAME)
    return frequency, damping, stride, np.array([one[2, 0] for one in laws]) / (1.0 - M[0, 0])


def braking(recording: Recording) -> tuple[float, float]:
    """`SLIDING` and `CREEPING` of FetchSlide from slides that nothing touches."""
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

    found = minimize(lack, (1.0, 4.0), method="Nelder-Mead").x
    return float(found[0]), float(found[1])


def panda_arm(python: Path | None, file: Path = arm.FILE) -> str:
    """Records the Panda's hand, trains the network of `arm` and writes it; returns its errors."""
    inputs, outputs = [], []
    for seed in range(SEEDS):
        kind = Kind(
            "PandaReach-v3", EPISODES, STEPS,
            lambda n, size, seed=seed: scripts.wandering(n, size, LOW, HIGH, seed),  # type: ignore[misc]
        )  # fmt: skip
        played = record(kind, python)
        hand, velocity = played.observations[..., :3], played.observations[..., 3:]
        for step, actions in enumerate(played.actions):
            asked = arm.asked_displacement(hand[step], actions)
            inputs.append(arm.inputs(hand[step], velocity[step], asked))
            moved = hand[step + 1] - hand[step], FRAME * velocity[step + 1]
            outputs.append(np.concatenate(moved, axis=1) / arm.MOVED)
    x, y = (torch.tensor(np.array(part), dtype=torch.float32) for part in (inputs, outputs))
    held = torch.arange(len(x)) % STEPS % 10 == 0  # steps that are not trained on
    layers = _train(x[~held].flatten(0, 1), y[~held].flatten(0, 1))
    with torch.no_grad():
        errors = 1e3 * arm.MOVED * (layers(x[held]) - y[held])[..., :3].norm(dim=-1).flatten()
    linear = [one for one in layers if isinstance(one, torch.nn.Linear)]
    numbers = {}
    for i, one in enumerate(linear):
        numbers[f"w{i}"] = np.ascontiguousarray(one.weight.detach().numpy().T)
        numbers[f"b{i}"] = one.bias.detach().numpy()
    np.savez(file, allow_pickle=False, **numbers)
    quantiles = torch.quantile(errors, torch.tensor([0.5, 0.9]))
    return f"displacement in a step: median error {quantiles[0]:.2f} mm, 90 % {quantiles[1]:.2f} mm"


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
