"""tune-fidelity repeats the episodes of a policy in its own environment, at every fidelity."""

import math
from pathlib import Path

import numpy as np
import pytest

from physics import Fidelity, World
from physics.tuning.reference import Reference
from physics.tuning.tune import Tuned
from training.commands import cli, fidelity_tuning
from training.settings.errors import UsageError

POLICIES = Path(__file__).parents[3] / "results" / "ppo"


@pytest.fixture
def asked(monkeypatch):
    """What `tune` is called with; it finds `fast`."""
    calls = []

    def tune(scene, tolerance, metric, **options):
        calls.append({"scene": scene, "tolerance": tolerance, "metric": metric, **options})
        reference = Reference(None, 0.0, "none", 1.0)
        return Tuned(Fidelity(), 0.0, 1e-3, (), reference, metric, tolerance)

    monkeypatch.setattr(fidelity_tuning, "tune", tune)
    return calls


def tune_fidelity(*words):
    return cli.main(["tune-fidelity", "--time", "0.4", *words])


def test_the_motion_is_that_of_the_environment(monkeypatch):
    kept = {}

    def tune(scene, *_, start, control, worlds, **__):
        world = World(scene, fidelity_tuning.RECORDED_AT, worlds)
        start(world)
        for frame in range(10):
            control(world, frame)
            world.advance(0.04)
        kept["position"] = world.position.copy()
        return Tuned(None, math.inf, math.inf, (), Reference(None, 0.0, "", 0.0), "position", 1.0)

    def recorded(*arguments, **options):
        kept["envs"], actions = plays(*arguments, **options)
        for action in actions:
            kept["envs"].step(action.astype(np.float32))
        kept["played"] = kept["envs"].runner.world.position.copy()
        kept["envs"].reset(seed=3)
        return kept["envs"], actions

    plays = fidelity_tuning.recorded
    monkeypatch.setattr(fidelity_tuning, "tune", tune)
    monkeypatch.setattr(fidelity_tuning, "recorded", recorded)
    assert tune_fidelity("--seed", "3") == 1  # the `tune` above finds none
    assert not np.array_equal(kept["played"], kept["envs"].runner.world.position)
    np.testing.assert_allclose(kept["position"], kept["played"], rtol=0.0, atol=1e-12)


def test_a_trained_policy_brings_its_environment(asked, capsys):
    folder = str(POLICIES / "RigidEnvs-Stack-v0_seed0")
    assert tune_fidelity("--policy", folder, "--tolerance", "5e-3", "--metric", "velocity") == 0
    (call,) = asked
    assert len(call["scene"].bodies) == 2
    assert (call["tolerance"], call["metric"], call["time"]) == (5e-3, "velocity", 0.4)
    assert "RigidEnvs/Stack-v0, 16 episodes" in capsys.readouterr().out


def test_arguments_of_the_environment_replace_those_of_the_policy(asked):
    (file,) = (POLICIES / "RigidEnvs-Push-v0_seed0").glob("*.safetensors")
    words = ("--policy", str(file), "--env-kwargs", "obstacles:2")
    assert tune_fidelity(*words) == 0
    assert len(asked[0]["scene"].statics) > 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--env-kwargs", "randomize:{mass:[0.5,2]}"), "'randomize' is not allowed here"),
        (("--env-kwargs", "nonsense:1"), "nonsense"),
        (("--metric", "colour"), "metric must be"),
        (("--env", "CartPole-v1"), "CartPole-v1"),
    ],
)
def test_mistakes_are_named(words, message, capsys):
    assert tune_fidelity(*words) == 2
    assert message in capsys.readouterr().err


def test_steps_of_several_parts_are_refused():
    class Pusher:
        env_id, env_kwargs = "RigidEnvs/PandaPush-v0", {}

    with pytest.raises(UsageError, match="PandaPush-v0 commands its drives 4 times in a step"):
        fidelity_tuning.recorded(Pusher(), 1, 0)
