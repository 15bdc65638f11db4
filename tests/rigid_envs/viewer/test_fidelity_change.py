"""The worlds go on while the kernels of another fidelity are compiled, and the page says so."""

import queue
import threading

import pytest

from physics import PRESETS, Fidelity
from physics.compiler import jit
from rigid_envs import Runner
from rigid_envs.viewer import fidelity_change
from rigid_envs.viewer.fidelity_change import FidelityChange, name_of
from rigid_envs.viewer.session import Session


class Loop:
    """A session whose compiling ends when the test says so."""

    def __init__(self, monkeypatch, kernel="advance"):
        self.session = Session(Runner("push", 2, fidelity="fast", reward_type="dense"))
        self.posted, self.results = queue.SimpleQueue(), []
        self.compiled, self.prepared = threading.Semaphore(0), []
        monkeypatch.setattr(fidelity_change, "being_compiled", lambda: kernel)
        monkeypatch.setattr(fidelity_change, "NOTICED", 0.0)

        def prepare(fidelity):
            self.prepared.append(fidelity)
            self.compiled.acquire()

        monkeypatch.setattr(self.session.runner, "prepare_fidelity", prepare)
        self.change = FidelityChange(self.session, self.posted.put, self.results.append)
        self.change.start()

    def finish(self):
        """The compiler is done; the loop does what is posted."""
        self.compiled.release()
        self.posted.get(timeout=120.0)()


def test_at_first_the_worlds_wait_for_their_own_kernels(monkeypatch):
    loop = Loop(monkeypatch)
    assert not loop.change.ready
    said = loop.change.describe()
    assert said == "Compiling for fast (the kernel advance) since 0 s. The worlds start then."
    loop.finish()
    assert loop.change.ready
    assert loop.change.describe() == ""
    assert loop.session.steps == 0
    assert loop.results == [None]


def test_the_worlds_go_on_until_the_kernels_are_there(monkeypatch):
    loop = Loop(monkeypatch)
    loop.finish()
    loop.change.want("solid")
    assert loop.change.target == PRESETS["solid"]
    for _ in range(3):
        loop.session.advance()
    assert loop.session.steps == 3
    assert loop.session.fidelity == PRESETS["fast"]
    said = loop.change.describe()
    assert said.startswith("Compiling for solid (the kernel advance) since ")
    assert said.endswith("s. The worlds go on at fast.")
    loop.finish()
    assert loop.session.fidelity == PRESETS["solid"]
    assert loop.change.describe() == ""
    loop.session.advance()
    assert loop.session.steps == 4


def test_of_several_wishes_the_last_one_counts(monkeypatch):
    loop = Loop(monkeypatch)
    loop.finish()
    for name in ("solid", "accurate", "balanced"):
        loop.change.want(name)
    loop.finish()
    assert loop.session.fidelity == PRESETS["fast"]
    loop.finish()
    assert loop.session.fidelity == PRESETS["balanced"]
    assert loop.prepared == [PRESETS[name] for name in ("fast", "solid", "balanced")]


def test_what_cannot_be_simulated_is_said_and_changes_nothing(monkeypatch):
    loop = Loop(monkeypatch)
    loop.finish()
    monkeypatch.undo()  # the engine itself refuses
    loop.change.want(Fidelity(substep=0.3))
    loop.posted.get(timeout=120.0)()
    assert "too long" in str(loop.results[-1])
    assert loop.session.fidelity == loop.change.target == PRESETS["fast"]


def test_a_bug_ends_the_loop_and_isnt_waited_for(monkeypatch):
    loop = Loop(monkeypatch)
    loop.finish()

    def fail(_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(loop.session.runner, "prepare_fidelity", fail)
    loop.change.want("solid")
    with pytest.raises(RuntimeError, match="a bug"):
        loop.posted.get(timeout=120.0)()
    assert loop.change.describe() == ""


def test_after_preparing_a_change_compiles_nothing(monkeypatch):
    session = Session(Runner("push", 2, fidelity="fast", reward_type="dense"))
    session.warm_up()
    assert session.steps == 0
    session.runner.prepare_fidelity("solid")
    started = []
    monkeypatch.setattr(jit.LOGGER, "log", lambda *arguments: started.append(arguments))
    session.change_fidelity("solid")
    session.step()
    session.read()
    session.runner.world.contacts(0)
    assert not started


@pytest.mark.parametrize("name", PRESETS)
def test_names(name):
    assert name_of(PRESETS[name]) == name
    assert name_of(Fidelity(substep=1.3e-3)) == "custom"
