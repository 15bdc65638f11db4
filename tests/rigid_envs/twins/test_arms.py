"""Chains of hinges obey the laws of mechanics; arms follow hands that are moved or held back."""

import gymnasium as gym
import numpy as np
import pytest

from physics import World
from physics.compiler.jit import LANES
from rigid_envs.twins import TWINS
from rigid_envs.twins.arms.arm import hold_back, make_work
from rigid_envs.twins.arms.chain import JOINTS, differentiate, locate
from rigid_envs.twins.arms.dynamics import GRAVITY, factor_masses, weigh
from rigid_envs.twins.arms.limits import limit_impulses
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import ROWS
from rigid_envs.twins.fetch import arm as fetch
from rigid_envs.twins.panda import arm as panda
from rigid_envs.twins.panda.hand import path

CHAINS = {"fetch": fetch.CHAIN, "panda": panda.CHAIN}


@pytest.fixture(params=CHAINS)
def chain(request):
    return CHAINS[request.param]


def at(chain, angles, speeds=None):
    """What is known of arms with these angles [7] in the first lane."""
    work = make_work()
    work.angles[:, 0] = angles
    work.speeds[:, 0] = 0.0 if speeds is None else speeds
    locate(chain, work.angles, work)
    return work


def states(count=5):
    rng = np.random.default_rng(0)
    return rng.uniform(-2.0, 2.0, (count, JOINTS)), rng.uniform(-2.0, 2.0, (count, JOINTS))


def energies(chain, angles, speeds, step=1e-5):
    """Kinetic energy from differences of the links' poses in time, and potential energy."""
    before, after = (at(chain, angles + s * speeds) for s in (-step, step))
    kinetic = potential = 0.0
    for i in range(JOINTS):
        m, center = chain.mass[i], chain.moment[i] / chain.mass[i]
        inertia = chain.inertia[i] - m * (center @ center * np.eye(3) - np.outer(center, center))
        (p0, R0), (p1, R1) = (
            (w.origin[i, :, 0] + w.rotation[i, :, :, 0] @ center, w.rotation[i, :, :, 0])
            for w in (before, after)
        )
        velocity, turned = (p1 - p0) / (2.0 * step), (R0 + R1).T @ (R1 - R0) / (4.0 * step)
        spin = np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
        kinetic += 0.5 * m * velocity @ velocity + 0.5 * spin @ inertia @ spin
        potential += m * GRAVITY * 0.5 * (p0 + p1)[2]
    return kinetic, potential


def test_frames_are_products_of_rotations(chain):
    for angles, _ in zip(*states(), strict=True):
        work, R, p = at(chain, angles), np.eye(3), np.zeros(3)
        for i in range(JOINTS + 1):
            p, R = p + R @ chain.offset[i], R @ chain.turn[i]
            if i < JOINTS:
                c, s = np.cos(angles[i]), np.sin(angles[i])
                R = R @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            assert work.origin[i, :, 0] == pytest.approx(p, abs=1e-13)
            assert work.rotation[i, :, :, 0] == pytest.approx(R, abs=1e-13)


def test_the_jacobian_is_the_derivative_of_the_hands_pose(chain):
    for angles, _ in zip(*states(), strict=True):
        work = at(chain, angles)
        differentiate(work)
        for i in range(JOINTS):
            step = 1e-6 * np.eye(JOINTS)[i]
            (p0, R0), (p1, R1) = (
                (w.origin[JOINTS, :, 0], w.rotation[JOINTS, :, :, 0])
                for w in (at(chain, angles - step), at(chain, angles + step))
            )
            turned = (R1 - R0) @ (R0 + R1).T / 4e-6
            expected = *((p1 - p0) / 2e-6), turned[2, 1], turned[0, 2], turned[1, 0]
            assert work.jacobian[:, i, 0] == pytest.approx(expected, abs=1e-8)


def test_the_mass_matrix_is_that_of_the_kinetic_energy(chain):
    for angles, speeds in zip(*states(), strict=True):
        work = at(chain, angles)
        weigh(chain, work)
        M = work.mass_matrix[:, :, 0]
        assert pytest.approx(M.T) == M
        kinetic, _ = energies(chain, angles, speeds)
        assert 0.5 * speeds @ M @ speeds == pytest.approx(kinetic, rel=1e-6)


def test_the_bias_is_the_torque_that_lagranges_equations_give(chain):
    """d/dt dT/dq' - dT/dq + dV/dq with q'' = 0, by differences."""
    step = 1e-4
    for angles, speeds in zip(*states(2), strict=True):
        work = at(chain, angles, speeds)
        weigh(chain, work)

        def mass_matrix(q):
            other = at(chain, q)
            weigh(chain, other)
            return other.mass_matrix[:, :, 0].copy()

        along = step * speeds
        change = (mass_matrix(angles + along) - mass_matrix(angles - along)) / (2.0 * step)
        expected = change @ speeds
        for i in range(JOINTS):
            offset = step * np.eye(JOINTS)[i]
            twice = mass_matrix(angles + offset) - mass_matrix(angles - offset)
            expected[i] -= 0.5 * speeds @ twice @ speeds / (2.0 * step)
            high, low = (energies(chain, angles + s * offset, 0.0 * speeds)[1] for s in (1, -1))
            expected[i] += (high - low) / (2.0 * step)
        assert work.bias[:, 0] == pytest.approx(expected, abs=1e-4)


def test_cholesky_solves():
    rng = np.random.default_rng(0)
    roots = rng.normal(size=(JOINTS, 2 * JOINTS, LANES))
    matrix = np.einsum("ikl,jkl->ijl", roots, roots)
    x, work = rng.normal(size=(JOINTS, LANES)), matrix.copy()
    factor(work, JOINTS)
    solved = x.copy()
    solve(work, solved, JOINTS)
    for lane in range(LANES):
        assert solved[:, lane] == pytest.approx(np.linalg.solve(matrix[..., lane], x[:, lane]))


@pytest.mark.parametrize("rows", [JOINTS, ROWS])
def test_impulses_between_limits_give_each_row_what_it_lacks(rows):
    """Or push it as far as its limit allows. Sides of one problem are the guess of the next."""
    rng, at_limits = np.random.default_rng(0), 0
    work = make_work()
    roots = rng.normal(size=(rows, 2 * rows))
    matrix = roots @ roots.T
    work.system[:rows, :rows] = matrix
    work.side[:] = -1.0
    for _ in range(30):
        work.low[:rows], work.high[:rows] = -rng.uniform(0.0, 0.1, (2, rows)) * ((1.0,), (-1.0,))
        work.lack[:rows] = rng.normal(size=rows)
        limit_impulses(work, rows)
        low, high, x = work.low[:rows], work.high[:rows], work.impulse[:rows]
        left = work.lack[:rows] - matrix @ x
        assert work.gain[:rows] == pytest.approx(matrix @ x, abs=1e-9)
        assert (x >= low - 1e-12).all()
        assert (x <= high + 1e-12).all()
        free = (x > low) & (x < high)
        assert left[free] == pytest.approx(0.0, abs=1e-9)
        assert (left[x == high] >= -1e-9).all()
        assert (left[x == low] <= 1e-9).all()
        at_limits += np.count_nonzero(~free)
    assert 5 * rows < at_limits < 28 * rows


@pytest.mark.parametrize("name", ["fetch_pick_and_place", "panda_pick_and_place"])
def test_arms_follow_hands_that_are_moved(name):
    """A hand that is put elsewhere stays there: its arm has the angles for it."""
    twin = TWINS[name](near_grasp_start_prob=1.0)
    world = World(twin.scene(), "balanced", 20)
    draws = np.random.default_rng(0).random((20, twin.draw_count))
    twin.start(world, np.ones(20, dtype=bool), draws)
    start = np.array(twin.hand.position(world.read()))
    for _ in range(5):
        twin.advance(world, world.read(), np.zeros((20, 4)))
    assert np.abs(twin.hand.position(world.read()) - start)[:, :2].max() < 3e-3


def test_hinges_follow_hands_that_are_held_back_as_they_would_follow_a_force(chain):
    for angles, speeds in zip(*states(), strict=True):
        work = at(chain, angles, speeds)
        differentiate(work)
        weigh(chain, work)
        M, J = work.mass_matrix[:, :, 0], work.jacobian[:3, :, 0].copy()
        work.mass_matrix[:, :, 1:] = np.eye(JOINTS)[:, :, None]
        work.jacobian[:3, :, 1:] = np.eye(3, JOINTS)[:, :, None]
        factor_masses(work)
        held = work.origin[JOINTS, :, 0] + (1e-4, -2e-4, 1e-4)
        work.position[:, 0], work.velocity[:, 0] = held, (0.1, 0.2, 0.3)
        hold_back(work)
        moved, faster = work.angles[:, 0] - angles, work.speeds[:, 0] - speeds
        assert at(chain, work.angles[:, 0]).origin[JOINTS, :, 0] == pytest.approx(held, abs=2e-6)
        assert J @ work.speeds[:, 0] == pytest.approx([0.1, 0.2, 0.3])
        for change in (moved, faster):  # M dq = J^T F
            force = np.linalg.lstsq(J.T, M @ change, rcond=None)[0]
            assert J.T @ force == pytest.approx(
                M @ change, abs=1e-9 + 1e-6 * np.abs(M @ change).max()
            )


def test_worlds_do_not_depend_on_their_neighbours_or_threads():
    twin = TWINS["panda_reach"]()
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (15, 40, 3))
    actions[:, ::2, 2] = -1.0  # every second hand comes to press on the table
    found = []
    for first, last, threads in ((0, 40, 1), (0, 40, 3), (17, 18, 1)):
        world = World(twin.scene(), "balanced", last - first, threads)
        for step in actions[:, first:last]:
            twin.advance(world, world.read(), step)
        found.append(world.memory("arm", 2 * JOINTS))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0][17:18], found[2])
    height = twin.hand.position(world.read())[:, 2]
    assert height > 0.05  # the one by itself is in the air, beside hands on the table


def test_hinges_belong_to_the_state_of_episodes():
    """Saved and restored, and kept where the fidelity changes."""
    env = gym.make("RigidEnvs/PandaPush-v0").unwrapped
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (8, 3)).astype(np.float32)
    for action in actions[:4]:
        env.step(action)
    saved = env.get_state()
    first = [env.step(action)[0]["observation"] for action in actions[4:]]
    env.set_state(saved)
    again = [env.step(action)[0]["observation"] for action in actions[4:]]
    np.testing.assert_array_equal(first, again)
    before = env._runner.world.memory("arm", 2 * JOINTS).copy()
    assert before.any()
    env._runner.change_fidelity("fast")
    np.testing.assert_array_equal(env._runner.world.memory("arm", 2 * JOINTS), before)
    env.reset(seed=1)
    assert not env._runner.world.memory("arm", 2 * JOINTS).any()


def test_a_hand_follows_its_arm_also_within_a_step():
    """At the end of each part of a step the engine's hand is where the arm's is."""
    twin = TWINS["panda_reach"]()
    world = World(twin.scene(), "balanced", 4)
    rng = np.random.default_rng(0)
    for _ in range(5):
        now = world.read()
        twin.act(world, now, rng.uniform(-1.0, 1.0, (4, 3)))
        for part in range(twin.parts):
            if part > 0:
                twin.proceed(world, part)
            before, (moved, end, _) = twin.hand.position(world.read()), path(world, part)
            world.advance(twin.frame / twin.parts)
            now = world.read()
            assert twin.hand.position(now) - before == pytest.approx(moved, abs=1e-6)
            assert twin.hand.velocity(now) == pytest.approx(end, abs=1e-4)
