"""Friction of MuJoCo's pyramid, and the puck of FetchSlide that it brakes."""

import math

import numpy as np
import pytest

from benchmarks.twins.identify import Slides
from benchmarks.twins.recordings import Recording
from rigid_envs.twins.fetch.pyramid import friction
from rigid_envs.twins.fetch.slide import DAMPING, DECELERATION, GLIDING, braking, predicted


def test_friction_is_the_sum_of_four_forces_that_share_its_limit():
    rng = np.random.default_rng(0)
    slip, limit, creeping = rng.normal(scale=0.3, size=(400, 2)), 1.3, 5.0
    found = friction(slip, limit, creeping)
    assert (found * slip).max() <= 0.0
    # the forces: each at least 0, and with one level for all in each case
    part = 0.5 * creeping / limit * np.concatenate([-slip, slip], axis=1)
    low, high = np.full(400, -50.0), np.full(400, 1.0)
    for _ in range(60):
        level = 0.5 * (low + high)
        more = np.maximum(part + level[:, None], 0.0).sum(axis=1) > 1.0
        low, high = np.where(more, low, level), np.where(more, level, high)
    forces = limit * np.maximum(part + low[:, None], 0.0)
    assert found == pytest.approx(forces[:, :2] - forces[:, 2:], abs=1e-9)
    for regime in (1, 2, 3, 4):  # all occur
        assert ((forces > 1e-9).sum(axis=1) == regime).any()


def test_a_puck_slides_creeps_and_glides():
    fast = np.array([[1.0, 0.0], [0.0, -1.0], [0.8, 0.8], [1.2, 0.3]])
    found = braking(fast)
    assert np.abs(found).sum(axis=1) == pytest.approx(np.full(4, DECELERATION))
    assert found[2] == pytest.approx([-0.5 * DECELERATION, -0.5 * DECELERATION])
    assert found[3] == pytest.approx([-DECELERATION, 0.0])  # the faster component first
    slow = np.array([[GLIDING, 0.0], [0.0, 0.5 * GLIDING], [0.0, 0.0]])
    assert braking(slow) == pytest.approx(np.zeros((3, 2)))  # it glides on, or rests
    assert braking((GLIDING + 0.02) * np.array([[0.6, -0.8]]))[0] == pytest.approx(
        0.02 * DAMPING * np.array([-0.6, 0.8])
    )


def test_where_a_puck_will_be_follows_from_the_law():
    # along an axis, with w the speed above that of gliding: w' = -s, from w = 2 s / k on
    # w' = -(s + k w) / 3, and from w = s / (2 k) on w' = -k w
    v, s, k, g, time = 1.0, DECELERATION, DAMPING, GLIDING, 1.6
    first = (v - g - 2.0 * s / k) / s
    far = ((v - g) ** 2 - (2.0 * s / k) ** 2) / (2.0 * s)
    second = 3.0 * math.log(2.0) / k
    far += s * (4.5 - 3.0 * math.log(2.0)) / k**2
    far += s / (2.0 * k * k) * (1.0 - math.exp(-k * (time - first - second)))
    found = predicted(np.zeros((1, 2)), np.array([[v, 0.0]]), time)[0]
    assert found == pytest.approx([far + g * time, 0.0], abs=8e-3)


def test_pucks_end_where_those_of_the_original_do():
    slides = Slides.of(Recording.load("fetch-slides"))
    miss = slides.miss(DECELERATION, DAMPING, GLIDING)
    assert len(miss) >= 30
    far = np.linalg.norm(slides.end - slides.position, axis=1)
    assert np.median(np.linalg.norm(miss, axis=1)) < 0.017 < 0.1 * np.median(far)
    # the law has no bias towards the axes: a pyramid without softness has 15 mm
    direction = slides.velocity / np.linalg.norm(slides.velocity, axis=1, keepdims=True)
    aside = direction[:, 0] * miss[:, 1] - direction[:, 1] * miss[:, 0]
    assert abs(np.mean(aside * np.sign(slides.velocity[:, 0] * slides.velocity[:, 1]))) < 5e-3
