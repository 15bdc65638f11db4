"""The part of a goal that a T covers: closed forms, symmetries, and counted points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.tasks.coverage import AREA, BAR, STEM, UNIT, common_area, uncovered
from rigid_envs.tasks.goals import distance

ORIGIN = (0.0, 0.0, 1.0, 0.0)


def pose(x=0.0, y=0.0, yaw=0.0):
    return np.array([x, y, np.cos(yaw), np.sin(yaw)])


def covered(a, b):
    return 1.0 - distance(a, b, uncovered)


def test_the_t_is_seven_squares_about_its_centre_of_mass():
    areas = np.array([4.0 * half[1] * half[2] for half in (BAR, STEM)])
    np.testing.assert_allclose(areas, [4.0 * UNIT**2, 3.0 * UNIT**2])
    np.testing.assert_allclose(areas.sum(), AREA)
    np.testing.assert_allclose(areas @ [BAR[0], STEM[0]], 0.0, atol=1e-18)
    np.testing.assert_allclose(BAR[0] - BAR[2], STEM[0] + STEM[2])


@pytest.mark.parametrize("yaw", np.arange(0.0, 6.4, 0.1))
def test_a_t_covers_itself(yaw):
    at = pose(0.03, -0.2, yaw)
    np.testing.assert_allclose(covered(at, at), 1.0, rtol=1e-11)


@pytest.mark.parametrize(
    ("shift", "squares"),
    [
        ((0.0, 0.0), 7.0),
        ((1.0, 0.0), 3.0),  # of the bar; the stems lie side by side
        ((2.0, 0.0), 2.0),
        ((0.5, 0.0), 3.5 + 1.5),
        ((0.0, 0.5), 2.0 + 2.5 + 0.5),
        ((0.0, 1.0), 2.0 + 1.0),  # of the stem, and where the stem of one lies on the other's bar
        ((0.0, -1.0), 2.0 + 1.0),
        ((4.0, 0.0), 0.0),
        ((0.0, 4.0), 0.0),
    ],
)
def test_a_shifted_t_covers_a_number_of_squares(shift, squares):
    x, y = UNIT * np.array(shift)
    for yaw in (0.0, 0.7, np.pi / 2.0, -2.0):
        c, s = np.cos(yaw), np.sin(yaw)
        moved = pose(c * x - s * y, s * x + c * y, yaw)
        np.testing.assert_allclose(covered(moved, pose(yaw=yaw)), squares / 7.0, atol=1e-11)


def test_two_squares_at_45_degrees_share_an_octagon():
    half = np.sqrt(0.5)
    area = common_area(0.0, 0.0, half, half, 1.0, 1.0, 1.0, 1.0)
    np.testing.assert_allclose(area, 8.0 * (np.sqrt(2.0) - 1.0), rtol=1e-12)


def test_a_rectangle_within_another_is_what_they_share():
    c, s = np.cos(0.4), np.sin(0.4)
    np.testing.assert_allclose(common_area(0.1, -0.2, c, s, 0.1, 0.2, 1.0, 2.0), 0.08)
    np.testing.assert_allclose(common_area(0.1, -0.2, c, s, 3.0, 4.0, 1.0, 1.0), 4.0)
    assert common_area(5.0, 0.0, c, s, 1.0, 1.0, 1.0, 1.0) == 0.0


numbers = st.floats(-0.12, 0.12)
yaws = st.floats(-np.pi, np.pi)


@given(numbers, numbers, yaws, yaws)
def test_coverage_is_symmetric_and_depends_on_the_relative_pose(x, y, yaw, turn):
    a, b = pose(x, y, yaw), pose()
    value = covered(a, b)
    assert -1e-9 <= value <= 1.0 + 1e-9
    np.testing.assert_allclose(covered(b, a), value, atol=1e-9)
    c, s = np.cos(turn), np.sin(turn)
    a_turned = pose(c * x - s * y + 0.3, s * x + c * y - 0.1, yaw + turn)
    np.testing.assert_allclose(covered(a_turned, pose(0.3, -0.1, turn)), value, atol=1e-9)


def test_coverage_is_the_fraction_of_points_of_the_goal_that_lie_in_the_t():
    draw = np.random.default_rng(0)
    spread = np.linspace(-0.1, 0.1, 1001)
    grid = np.stack(np.meshgrid(spread, spread), axis=-1).reshape(-1, 2)

    def inside(at):
        offset = grid - at[:2]
        x, y = offset @ at[2:], offset @ [-at[3], at[2]]
        found = np.zeros(len(grid), dtype=bool)
        for middle, half_width, half_height in (BAR, STEM):
            found |= (np.abs(x) <= half_width) & (np.abs(y - middle) <= half_height)
        return found

    goal = inside(np.array(ORIGIN))
    for _ in range(20):
        at = pose(*draw.uniform(-0.05, 0.05, 2), draw.uniform(-np.pi, np.pi))
        counted = np.sum(inside(at) & goal) / np.sum(goal)
        np.testing.assert_allclose(covered(at, np.array(ORIGIN)), counted, atol=2e-3)


def test_the_length_of_a_heading_does_not_matter():
    """The cosine and sine of a T that is slightly tilted are shorter than 1."""
    a = pose(0.01, 0.02, 0.3)
    shorter = a * (1.0, 1.0, 0.9, 0.9)
    np.testing.assert_allclose(covered(shorter, pose()), covered(a, pose()), rtol=1e-12)
    np.testing.assert_allclose(covered(pose(), shorter), covered(pose(), a), rtol=1e-12)
