"""The view command: which worlds and policy it shows; mistakes give one line."""

import socket
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason='no viser: install it with `pip install -e ".[view]"`')

from rigid_envs.viewer.server import ViewServer
from training.commands import cli, extras

PUSH_POLICY = Path(__file__).parents[3] / "results" / "ppo" / "RigidEnvs-Push-v0_seed0"


@pytest.fixture
def viewed(monkeypatch):
    """Sessions that `rigid-envs view` would show; Ctrl-C comes after ten steps."""
    sessions = []

    def run(server):
        sessions.append(server.session)
        for _ in range(10):
            server.session.step()
        raise KeyboardInterrupt

    monkeypatch.setattr(ViewServer, "run", run)
    return sessions


def view(*words):
    return cli.main(["view", "--port", "0", "--fidelity", "fast", *words])


def test_ctrl_c_ends_it_and_frees_the_port(viewed, capfd):
    assert view("--num-worlds", "3", "--seed", "5") == 0
    first, last = capfd.readouterr().out.splitlines()
    assert first.startswith("RigidEnvs/Push-v0, 3 worlds: open http://127.0.0.1:")
    assert last == "ended"
    port = int(first.split(":")[-1].split(" ")[0])
    socket.create_server(("127.0.0.1", port)).close()
    (session,) = viewed
    assert (session.runner.count, session.steps) == (3, 10)
    assert session.policy is None


def test_the_scripted_controller_gets_the_arguments_of_the_environment(viewed):
    assert view("--policy", "scripted", "--num-worlds", "4", "--env-kwargs", "obstacles:2") == 0
    (session,) = viewed
    assert session.policy is not None
    assert session.runner.task.obstacles == 2


def test_a_trained_policy_brings_its_environment(viewed):
    (file,) = PUSH_POLICY.glob("*.safetensors")
    assert view("--policy", str(file), "--num-worlds", "4") == 0
    (session,) = viewed
    assert type(session.runner.task).__name__ == "Push"
    assert np.isfinite(session.returns).all()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--env", "RigidEnvs/Pusj-v0"], "did you mean 'RigidEnvs/Push-v0'"),
        (["--env", "CartPole-v1"], "CartPole-v1"),
        (["--env-kwargs", "blocks:3"], "unknown argument 'blocks'"),
        (["--env-kwargs", "num_envs:3"], "--num-worlds of view"),
        (["--num-worlds", "0"], "should be an integer of at least 1"),
        (["--port", "70000"], "'70000' should be a port, at most 65535"),
        (["--policy", "nowhere"], "nowhere does not exist"),
        (["--env", "CartPole-v1", "--policy", "scripted"], "no scripted controller"),
        (["--host", "no.such.host.invalid"], "can't listen on port 0 of no.such.host.invalid"),
    ],
)
def test_mistakes_are_reported_in_one_line(words, complaint, capfd, viewed):
    assert view(*words) == 2
    error = capfd.readouterr().err
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    assert complaint in error
    assert not viewed


def test_a_policy_of_another_task_is_rejected_before_the_page_opens(capfd, viewed):
    (file,) = PUSH_POLICY.glob("*.safetensors")
    assert view("--policy", str(file), "--env", "RigidEnvs/Throw-v0") == 2
    assert "another task than RigidEnvs/Throw-v0" in capfd.readouterr().err
    assert not viewed


def test_a_port_in_use_is_named(capfd, viewed):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        assert view("--port", port) == 2
    assert capfd.readouterr().err == (
        f"error: port {port} of 127.0.0.1 is in use; choose another one with --port or --host\n"
    )
    assert not viewed


def test_a_missing_package_names_the_extra(capsys, monkeypatch):
    monkeypatch.setattr(extras, "VIEW_EXTRA", ("no_such_viser",))
    assert cli.main(["view"]) == 2
    assert capsys.readouterr().err == (
        "error: this command requires no_such_viser; to install, in a clone: "
        'pip install -c constraints.txt -e ".[view]"\n'
    )
