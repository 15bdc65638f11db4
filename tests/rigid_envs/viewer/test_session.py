"""The viewer's session: episodes go on, settings act at once, invalid ones change nothing."""

from dataclasses import replace

import numpy as np
import pytest

from physics import Fidelity
from physics.scene.fidelity import PRESETS
from rigid_envs import Runner
from rigid_envs.viewer.session import MEASURED, PLOTTED, Session

COUNT = 3


def make(task="push", policy=None, seed=0, **arguments):
    return Session(Runner(task, COUNT, fidelity="fast", **arguments), policy, seed)


def state(session):
    world = session.runner.world
    return np.concatenate(
        [
            world.position.ravel(),
            world.orientation.ravel(),
            world.linear_velocity.ravel(),
            world.drive_position.ravel(),
            world.drive_velocity.ravel(),
        ]
    )


def run(session, steps):
    for _ in range(steps):
        session.step()


def test_a_seed_repeats_the_episodes_and_the_random_actions():
    session = make(seed=5)
    run(session, 7)
    first = state(session)
    session.reset(5)
    run(session, 7)
    np.testing.assert_array_equal(state(session), first)
    session.reset(6)
    run(session, 7)
    assert (state(session) != first).any()


def test_world_i_plays_the_episode_of_seed_plus_i():
    session, other = make(seed=4), Runner("push", 1, fidelity="fast")
    other.reset(np.ones(1, dtype=bool), np.array([4 + 2]))
    np.testing.assert_array_equal(session.runner.world.position[2], other.world.position[0])


def test_the_policy_gets_the_observations_and_chooses_the_actions():
    seen = []

    def still(observation):
        seen.append(observation["observation"].copy())
        return np.zeros((COUNT, 3))

    session = make(policy=still)
    run(session, 2)
    assert [o.shape for o in seen] == [(COUNT, 22)] * 2
    # the finger starts at rest and stays there
    np.testing.assert_allclose(seen[1][:, :3], seen[0][:, :3], atol=1e-6)


def test_an_episode_that_ends_is_counted_and_followed_by_the_next():
    session = make(max_episode_steps=4)
    run(session, 4)
    assert (session.finished, session.steps) == (COUNT, 4)
    ended = state(session)
    session.step()
    assert (session.returns == 0.0).all()  # this step was a reset
    assert (state(session) != ended).any()
    run(session, 4)
    assert session.finished == 2 * COUNT
    assert session.state()["mean return"] == "-4.0"


def test_rewards_are_those_of_the_last_steps():
    session = make(max_episode_steps=-1)
    run(session, PLOTTED + 10)
    time, mean, low, high = session.rewards()
    assert len(time) == len(mean) == PLOTTED
    assert time[-1] == pytest.approx((PLOTTED + 10) * 0.04)
    assert (low <= mean).all()
    assert (mean <= high).all()


def test_a_paused_session_steps_only_one_by_one():
    session = make()
    session.paused = True
    before = state(session)
    session.advance()
    np.testing.assert_array_equal(state(session), before)
    session.step()
    assert session.steps == 1


@pytest.mark.parametrize(
    ("task", "fidelity"),
    [
        ("push", "solid"),
        ("push", replace(PRESETS["fast"], substep=1e-3)),
        ("stack", "balanced"),
        ("throw", "balanced"),
    ],
)
def test_another_fidelity_keeps_positions_and_velocities(task, fidelity, stress):
    session = make(task)
    run(session, 6)
    before, spin = state(session), session.runner.world.angular_velocity.copy()
    times = session.runner.world.time.copy()
    session.change_fidelity(fidelity)
    np.testing.assert_allclose(state(session), before, atol=1e-12)
    np.testing.assert_allclose(session.runner.world.angular_velocity, spin, atol=1e-12)
    np.testing.assert_array_equal(session.runner.world.time, times)
    if fidelity == "solid" and not stress:
        return  # a step would compile a kernel that no other test has, for 12 s
    run(session, 6)
    assert session.steps == 12
    assert np.isfinite(state(session)).all()


def test_a_shorter_substep_sinks_less_and_costs_more_substeps():
    session = make(policy=lambda _: np.zeros((COUNT, 3)))
    run(session, MEASURED)
    session.change_fidelity(replace(session.fidelity, substep=1e-3))
    run(session, 25)
    now, before = session.read(), session.before
    assert before.fidelity == PRESETS["fast"]
    # a contact's stiffness is that of mass / substep^2
    ratio = np.median(now.penetrations) / np.median(before.penetrations)
    assert ratio == pytest.approx((1e-3 / PRESETS["fast"].substep) ** 2, rel=0.05)
    assert now.largest_step < before.largest_step
    assert now.step_time > 0.0
    assert now.speed == pytest.approx(0.04 / now.step_time)


def test_reading_costs_does_not_change_the_simulation():
    session, other = make(), make()
    for _ in range(4):
        run(session, 2)
        run(other, 2)
        session.read()
        session._timed = np.nan, 0  # it is timed each time
    np.testing.assert_array_equal(state(session), state(other))


def test_settings_that_were_never_measured_are_not_kept_for_comparison():
    session = make()
    run(session, MEASURED)
    for substep in (1.5e-3, 1.4e-3, 1.3e-3):  # a slider that is dragged
        session.change_fidelity(replace(session.fidelity, substep=substep))
        session.step()
    assert session.before.fidelity == PRESETS["fast"]


def test_an_invalid_fidelity_raises_the_engine_s_error_and_changes_nothing():
    session = make()
    run(session, 3)
    before, world = state(session), session.runner.world
    with pytest.raises(ValueError, match="the largest safe step is"):
        session.change_fidelity(Fidelity(substep=0.02))
    assert session.runner.world is world
    np.testing.assert_array_equal(state(session), before)
    assert session.before is None
    session.step()


def test_mass_and_friction_act_at_once_and_in_later_episodes():
    session = make(max_episode_steps=4)
    run(session, 2)
    before = state(session)
    session.change_parameters(mass=2.0)
    session.change_parameters(friction=0.125)
    np.testing.assert_array_equal(state(session), before)
    for _ in range(2):
        parameters = session.runner.world.parameters
        assert parameters.mass == pytest.approx(0.2)
        assert parameters.friction == pytest.approx(0.125)
        run(session, 5)
    session.reset(9)
    assert session.runner.world.parameters.mass == pytest.approx(0.2)
    reading = session.read()
    assert (reading.mass, reading.friction) == (2.0, 0.125)


def test_parameters_survive_another_fidelity():
    session = make()
    session.change_parameters(mass=3.0, friction=0.25)
    session.change_fidelity("solid")
    assert session.runner.world.parameters.mass == pytest.approx(0.3)
    assert session.runner.world.parameters.friction == pytest.approx(0.25)


def test_ranges_of_the_environment_hold_for_what_is_not_set():
    session = make(randomize={"mass": (0.5, 0.6), "friction": (0.9, 1.0)})
    session.change_parameters(mass=2.0)
    parameters = session.runner.world.parameters
    assert parameters.mass == pytest.approx(0.2)
    assert ((parameters.friction >= 0.9) & (parameters.friction <= 1.0)).all()


def test_less_friction_lets_the_cube_slide_further():
    distances = []
    for friction in (0.5, 0.125):
        session = make(policy=lambda _: np.zeros((COUNT, 3)))
        run(session, 2)
        session.change_parameters(friction=friction)
        world = session.runner.world
        world.set_state(linear_velocity=(0.5, 0.0, 0.0), angular_velocity=0.0)
        start = world.position[:, 0, 0].copy()
        run(session, 10)
        distances.append(world.position[:, 0, 0] - start)
    assert (distances[1] > 1.5 * distances[0]).all()


def test_an_invalid_parameter_changes_nothing():
    session = make()
    with pytest.raises(ValueError, match="mass"):
        session.change_parameters(mass=-1.0)
    assert session.mass is None
    assert session.runner.world.parameters.mass == pytest.approx(0.1)


def test_a_world_that_diverges_stops_the_session_until_a_reset():
    session = make()
    one = np.arange(COUNT) == 1
    session.runner.world.set_state(linear_velocity=(1e200, 0.0, 0.0), worlds=one)
    session.step()
    assert "world 1" in session.error
    assert np.isnan(session.read().step_time)  # the page still shows numbers
    session.step()
    assert session.steps == 0
    session.reset(0)
    session.step()
    assert (session.error, session.steps) == ("", 1)
