"""Time control: fast bodies collide when they touch, and slow scenes stay what they are.

There are two scenes, one for "fixed", "advancement" and "swept", a simpler one for the others, and
all tests use their features: each time control compiles one kernel.
"""

import math

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Material, Scene, Sphere, World
from physics.scene.solids import Static

STEP, SPEED = 2e-3, 300.0
RADIUS, HALF, WIDTH = 0.0025, 0.001, 0.06  # m, of the bullet and of the wall across x
MARBLE, ROD = 0.008, (0.15, 0.004, 0.004)
TOLERANCE = Fidelity().impact_tolerance
NEVER_MISS = ("advancement", "swept", "adaptive")
WHOLE = ("fixed", "advancement", "swept")
AWAY = {"bullet": (0.0, 5.0, 0.0), "marble": (0.0, -5.0, 0.0), "rod": (0.0, 0.0, 5.0)}


def fidelity(time_control, **other):
    return Fidelity(
        law="impulse", contact_resolution=1.8, spacing=1.0, time_control=time_control, **other
    )


def scene(restitution=0.5, gravity=0.0, second_wall=1.0, names=tuple(AWAY)):
    """A bullet, a marble, a rod and two thin walls across x; gravity, in m/s^2, is along -x."""
    material = Material(friction=0.0, restitution=restitution)
    shapes = {"bullet": Sphere(RADIUS), "marble": Sphere(MARBLE), "rod": Box(ROD)}
    masses = {"bullet": 0.004, "marble": 0.004, "rod": 0.05}
    bodies = [
        Body(shape, mass=masses[name], position=AWAY[name], material=material, name=name)
        for name, shape in shapes.items()
        if name in names
    ]
    wall = Box((HALF, WIDTH, WIDTH))
    walls = [
        Static(wall, position=(x, 0, 0), material=material, name=f"wall {n}")
        for n, x in enumerate((0.0, second_wall))
    ]
    return Scene(bodies, walls, gravity=(-gravity, 0, 0))


def world(time_control, count, restitution=0.5, threads=1, state=None, **other):
    """Worlds with poses and velocities by body name; the others are away, at rest."""
    names = tuple(AWAY) if time_control in WHOLE else ("bullet",)
    # other files have worlds with these two; what this one alone compiles is kept small
    kernel = "general" if time_control in ("fixed", "swept") else "special"
    made = World(
        scene(restitution, names=names, **other), fidelity(time_control), count, threads,
        kernel=kernel,
    )  # fmt: skip
    put(made, **(state or {}))
    return made


def put(made, **state):
    """Sets (position, velocity) or (position, velocity, angular velocity) by body name."""
    values = np.zeros((3, made.count, len(made.scene.bodies), 3))
    for index, body in enumerate(made.scene.bodies):
        given = state.get(body.name, (AWAY[body.name],))
        for row, value in zip(values, given, strict=False):
            row[:, index] = value
    made.set_state(
        position=values[0], linear_velocity=values[1], angular_velocity=values[2],
        orientation=(0, 0, 0, 1), time=0.0,
    )  # fmt: skip


def shots(count, seed=0):
    """Bullets on their way to the wall at random angles and phases: position and velocity."""
    random = np.random.default_rng(seed)
    angle, turn = random.uniform(0.0, 1.0, count), random.uniform(0.0, 2 * math.pi, count)
    velocity = SPEED * np.stack(
        [np.cos(angle), np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn)], axis=1
    )
    way = random.uniform(0.1, 0.7, count)
    start = -velocity * (way / velocity[:, 0])[:, None]
    start[:, 1:] += random.uniform(-0.05, 0.05, (count, 2))
    return start, velocity


def touch_times(start, velocity):
    """Closed form: when the bullet's surface reaches the wall's."""
    return (-start[:, 0] - RADIUS - HALF) / velocity[:, 0]


@pytest.fixture(scope="module")
def table():
    """Of 1,000 bullets: how many pass the wall, by time control."""
    return {}


@pytest.mark.parametrize("time_control", ["fixed", "bisection", *NEVER_MISS])
def test_which_time_control_lets_bullets_through_a_thin_wall(time_control, table):
    start, velocity = shots(1000)
    made = world(time_control, 1000, state={"bullet": (start, velocity)})
    made.advance(3.5e-3)
    made.advance(1.5e-3)
    passed = int((made.position[:, 0, 0] > 0.0).sum())
    table[time_control] = passed
    if time_control in NEVER_MISS:
        assert passed == 0
        rebound = made.linear_velocity[:, 0]
        np.testing.assert_allclose(rebound[:, 0], -0.5 * velocity[:, 0], rtol=1e-12)
        np.testing.assert_allclose(rebound[:, 1:], velocity[:, 1:], rtol=1e-12, atol=1e-12)
    else:
        assert passed > (900 if time_control == "bisection" else 300)


@pytest.mark.parametrize("time_control", ["advancement", "swept"])
def test_a_bullet_is_where_the_closed_form_says(time_control):
    start, velocity = shots(1000, seed=1)
    made = world(time_control, 1000, state={"bullet": (start, velocity)})
    made.advance(5e-3)
    exact = touch_times(start, velocity)
    early = (exact - made.first_touch("bullet", "wall 0")) * velocity[:, 0]
    assert early.min() >= 0.0
    assert early.max() <= 1.01 * TOLERANCE
    x = -RADIUS - HALF - 0.5 * velocity[:, 0] * (5e-3 - exact)
    np.testing.assert_allclose(made.position[:, 0, 0], x, atol=2 * TOLERANCE)


@pytest.mark.parametrize("time_control", ["bisection", "advancement"])
def test_a_ball_that_falls_bounces_as_the_closed_form_says(time_control):
    g, count = 9.81, 64
    height = np.random.default_rng(2).uniform(0.05, 0.15, count)
    position = np.zeros((count, 3))
    position[:, 0] = HALF + RADIUS + height
    made = world(time_control, count, gravity=g, state={"bullet": (position, (0, 0, 0))})
    made.advance(0.2)
    exact = np.sqrt(2.0 * height / g)
    met = made.first_touch("bullet", "wall 0")
    assert np.abs(met - exact).max() <= 1.01 * TOLERANCE / np.sqrt(2.0 * g * 0.05)
    up, after = 0.5 * g * exact, 0.2 - exact
    falls_again = 2.0 * up / g < after
    assert not falls_again.all()
    once = ~falls_again
    x = HALF + RADIUS + up * after - 0.5 * g * after**2
    np.testing.assert_allclose(made.position[once, 0, 0], x[once], atol=3 * TOLERANCE)
    v = made.linear_velocity[once, 0, 0]
    np.testing.assert_allclose(v, (up - g * after)[once], atol=1e-5)


@pytest.mark.parametrize("time_control", WHOLE)
def test_marbles_that_meet_at_300_m_s_exchange_what_restitution_says(time_control):
    count = 200
    random = np.random.default_rng(3)
    apart = random.uniform(0.1, 0.7, count)
    at, target = np.zeros((count, 3)), np.zeros((count, 3))
    at[:, 0], target[:, 0] = -2.0 - apart, -2.0
    made = world(
        time_control, count,
        state={"bullet": (at, (SPEED, 0, 0)), "marble": (target, (0, 0, 0))},
    )  # fmt: skip
    made.advance(4e-3)
    v = made.linear_velocity[:, :2, 0]
    missed = v[:, 1] == 0.0
    if time_control == "fixed":
        assert missed.sum() > 60
    else:
        np.testing.assert_allclose(v, np.broadcast_to([75.0, 225.0], v.shape), rtol=1e-9)
        met = made.first_touch("bullet", "marble")
        exact = (apart - RADIUS - MARBLE) / SPEED
        assert np.abs(met - exact).max() <= 1.01 * TOLERANCE / SPEED


@pytest.mark.parametrize("time_control", WHOLE)
def test_a_spinning_rod_hits_what_its_tip_sweeps_over(time_control):
    count, spin = 200, 1500.0
    angle = np.random.default_rng(4).uniform(0.3, 2.8, count)
    centre = np.array([-2.0, 0.0, 0.0])
    target = centre + 0.12 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    made = world(
        time_control, count,
        state={"rod": (centre, (0, 0, 0), (0, 0, spin)), "marble": (target, (0, 0, 0))},
    )  # fmt: skip
    energy, momentum = made.kinetic_energy(), made.linear_momentum()
    turning = made.angular_momentum()
    made.advance(2e-3)  # 3 rad
    speed = np.sqrt(np.sum(made.linear_velocity[:, 1] ** 2, axis=1))
    if time_control == "fixed":
        assert (speed == 0.0).sum() > 60
        return
    assert speed.min() > 50.0
    assert (made.kinetic_energy() <= energy * (1 + 1e-12)).all()
    np.testing.assert_allclose(made.linear_momentum(), momentum, atol=1e-12)
    np.testing.assert_allclose(made.angular_momentum(), turning, rtol=1e-4, atol=1e-5)
    # the flank of the rod arrives at the marble
    exact = (angle - math.asin((MARBLE + ROD[1]) / 0.12)) / spin
    met = made.first_touch("rod", "marble")
    assert np.abs(met - exact).max() <= 1.01 * TOLERANCE / (0.12 * spin)


@pytest.mark.parametrize("rod", [False, True])
@pytest.mark.parametrize("time_control", ["advancement", "swept"])
def test_energy_never_grows_while_everything_collides(time_control, rod):
    """A thin rod that is hit at 3,000 rad/s gains up to 8e-4 in a frame (12 runs of 64 worlds)."""
    count = 64
    random = np.random.default_rng(5)
    made = world(
        time_control, count, second_wall=0.08, restitution=0.7,
        state={
            "bullet": ((0.02, 0, 0), random.normal(0.0, 100.0, (count, 3)) * [1, 0.02, 0.02]),
            "marble": ((0.04, 0, 0), random.normal(0.0, 50.0, (count, 3)) * [1, 0.02, 0.02]),
            "rod": ((0.06, 0, 0 if rod else 1), random.normal(0.0, 10.0, (count, 3)) * rod),
        },
    )  # fmt: skip
    made.set_state(orientation=(0, 0, math.sqrt(0.5), math.sqrt(0.5)))  # parallel to the walls
    energy = made.kinetic_energy()
    for _ in range(20):
        made.advance(2.7e-3)
        x, beside = made.position[:, :2, 0], np.abs(made.position[:, :2, 1:]).max(axis=-1)
        assert (np.abs(x - 0.04) < 0.04)[beside < 0.05].all()
        before, energy = energy, made.kinetic_energy()
        assert (energy <= before * (1 + (1e-3 if rod else 1e-12))).all()


@pytest.mark.parametrize("gap", [0.02, 0.0002])
def test_a_bullet_between_two_plates_stays_there(gap):
    """60 impacts per substep; of 6,000 only the first 256 are resolved, and the rest waits."""
    distance = 2 * HALF + 2 * RADIUS + gap
    made = world(
        "swept", 16, second_wall=distance, restitution=1.0,
        state={"bullet": ((0.5 * distance, 0, 0), (SPEED, 0, 0))},
    )  # fmt: skip
    energy = made.kinetic_energy()
    for _ in range(5):
        made.advance(4e-3)
        assert np.abs(made.position[:, 0, 0] - 0.5 * distance).max() <= 0.5 * gap + TOLERANCE
    np.testing.assert_allclose(made.kinetic_energy(), energy, rtol=1e-12)


def lying(count, time_control, **other):
    """A rod at rest on the wall, and a bullet that flies elsewhere."""
    position = np.array([HALF + ROD[1], 0.0, 0.0])
    made = world(
        time_control, count, gravity=9.81, restitution=0.2, **other,
        state={"rod": (position, (0, 0, 0))},
    )  # fmt: skip
    made.set_state(orientation=(0, 0, math.sqrt(0.5), math.sqrt(0.5)))
    return made


def test_a_slow_scene_is_bitwise_that_of_fixed_steps_where_only_fast_bodies_are_swept():
    fixed, swept = lying(4, "fixed"), lying(4, "swept")
    for _ in range(30):
        fixed.advance(0.01)
        swept.advance(0.01)
    for name in ("position", "orientation", "linear_velocity", "angular_velocity"):
        ours, theirs = getattr(fixed, name), getattr(swept, name)
        np.testing.assert_array_equal(ours[:, 2], theirs[:, 2])


def test_a_rod_at_rest_stays_at_rest_where_every_approach_is_advanced():
    """It sinks deeper than its edges are round, so the points that touch change and it sways.

    Points that close their gap by swaying collide, at times that depend on the control.
    """
    made, fixed = lying(4, "advancement"), lying(4, "fixed")
    made.advance(0.5)
    fixed.advance(0.5)
    assert np.abs(made.linear_velocity[:, 2]).max() < 1e-4
    np.testing.assert_allclose(made.position[:, 2], fixed.position[:, 2], atol=1e-6)


@pytest.mark.parametrize("time_control", ["bisection", "adaptive", "advancement"])
def test_bounces_end_and_the_ball_rests(time_control):
    made = world(
        time_control, 16, restitution=0.8, gravity=9.81,
        state={"bullet": ((HALF + RADIUS + 0.02, 0, 0), (0, 0, 0))},
    )  # fmt: skip
    made.advance(2.0)
    assert np.abs(made.linear_velocity[:, 0]).max() < 1e-5
    assert made.position[:, 0, 0] == pytest.approx(HALF + RADIUS, abs=5e-5)


@pytest.mark.parametrize("time_control", ["swept", "adaptive"])
def test_a_world_does_not_depend_on_its_neighbours_or_on_threads(time_control):
    start, velocity = shots(40, seed=6)
    velocity[::3] *= 0.01  # slow ones among the fast
    state = {"rod": (AWAY["rod"], (0, 0, 0), (300.0, 30.0, 0))}

    def poses(worlds, threads=1):
        chosen = {"bullet": (start[worlds], velocity[worlds]), "rod": state["rod"]}
        made = world(time_control, len(worlds), threads=threads, gravity=9.81, state=chosen)
        for span in (1.1e-3, 4e-3, 0.3e-3, 1.9e-3):
            made.advance(span)
        return np.concatenate(
            [made.position, made.linear_velocity, made.orientation, made.angular_velocity], axis=2
        )

    everyone = np.arange(40)
    together = poses(everyone)
    np.testing.assert_array_equal(poses(everyone, threads=2), together)
    for some in (everyone[:1], everyone[3:4], everyone[5:23], everyone[::-1]):
        np.testing.assert_array_equal(poses(some), together[some])


def test_a_snapshot_continues_bitwise():
    start, velocity = shots(8, seed=7)
    made = world("adaptive", 8, state={"bullet": (start, velocity)})
    made.advance(1e-3)
    saved = made.snapshot()
    made.advance(3e-3)
    after = made.position.copy()
    made.restore(saved)
    made.advance(3e-3)
    np.testing.assert_array_equal(made.position, after)


def test_halved_steps_catch_with_springs_what_they_can_stop(stress):
    """Without restitution damping stops what a spring alone would let through.

    With fixed steps nine of ten such balls pass the wall: `python -m benchmarks time_control`.
    """
    if not stress:
        pytest.skip("a kernel of its own for a quarter of a minute; see make stress")
    count, speed = 200, 20.0
    small = scene(restitution=0.0, names=("bullet",))
    made = World(small, Fidelity(time_control="adaptive"), count)
    start = np.zeros((count, 3))
    start[:, 0] = -0.3 - speed * STEP * np.arange(count) / count
    put(made, bullet=(start, (speed, 0, 0)))
    made.advance(0.05)
    assert (made.position[:, 0, 0] < 0.0).all()


@pytest.mark.parametrize("time_control", ["bisection", "advancement", "swept"])
def test_times_of_impact_need_the_impulse_law_and_exact_shapes(time_control):
    with pytest.raises(
        ValueError, match=rf"Fidelity\.time_control '{time_control}' requires law='impulse', got "
    ):
        Fidelity(time_control=time_control)
    with pytest.raises(ValueError, match=r"requires geometry='shape', got 'particle'"):
        Fidelity(law="impulse", geometry="particle", time_control=time_control)


def test_bad_values_of_time_control_are_named():
    with pytest.raises(ValueError, match=r"Fidelity\.time_control must be one of .*'fixed'"):
        Fidelity(time_control="sweep")
    with pytest.raises(ValueError, match=r"Fidelity\.courant must be .* at most 1, got 1\.5"):
        Fidelity(courant=1.5)
    with pytest.raises(ValueError, match=r"Fidelity\.impact_tolerance must be finite and at least"):
        Fidelity(impact_tolerance=0.0)
    coarse = fidelity("swept", impact_tolerance=1e-3)
    with pytest.raises(ValueError, match=r"Fidelity\.impact_tolerance 0\.001 m .*0\.00025.*bullet"):
        World(scene(), coarse)
