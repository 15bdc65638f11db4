"""Ctrl-C and forks while a kernel compiles leave a process that works."""

import os
import signal
import subprocess
import sys
import time

import pytest

from physics.compiler.interrupts import interrupts_kept
from tests.physics.compiler.test_code_cache import PACKAGE

BALL = """
import logging, os, signal, sys, threading, time
from physics import Body, Scene, Sphere, World
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it
world = World(Scene([Body(Sphere(0.1))]), kernel="special")
compiling = threading.Event()
def report(record):
    if "compiling kernel 'advance'" in record.getMessage():
        compiling.set()
    return True
logging.getLogger("physics").addFilter(report)
"""

INTERRUPTED = f"""{BALL}
def interrupt():
    compiling.wait()
    time.sleep(0.3)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
try:
    world.advance(1.0)
except KeyboardInterrupt:
    print("interrupted")
world.reset()
world.advance(1.0)
print(world.position[0, 0, 2])
"""

FORKED = f"""{BALL}
thread = threading.Thread(target=world.advance, args=(1.0,))
thread.start()
compiling.wait()
child = os.fork()
if child == 0:
    own = World(world.scene, kernel="special")
    own.advance(1.0)
    print(own.position[0, 0, 2], flush=True)
    os._exit(0)
thread.join()
assert os.waitpid(child, 0)[1] == 0
print(world.position[0, 0, 2])
"""


def start(program, cache):
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "NUMBA_CACHE_DIR": str(cache)}
    return subprocess.Popen(
        [sys.executable, "-c", program], env=environment, cwd=PACKAGE.parent, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def run(program, cache):
    process = start(program, cache)
    printed, log = process.communicate(timeout=120)
    assert process.returncode == 0, log
    return printed.split()


def test_after_ctrl_c_a_kernel_compiles_again(tmp_path):
    word, height = run(INTERRUPTED, tmp_path)
    assert word == "interrupted"
    assert float(height) == pytest.approx(-4.905)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_in_a_finalizer_is_not_lost():
    class Interrupting:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job has none
    try:
        with pytest.raises(KeyboardInterrupt), interrupts_kept():
            Interrupting()
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_fork_while_a_kernel_compiles_gives_a_child_that_works(tmp_path):
    child, parent = run(FORKED, tmp_path)
    assert child == parent
    assert float(parent) == pytest.approx(-4.905)


def test_ctrl_c_ends_a_program_that_compiles(tmp_path):
    process = start(f"{BALL}\nworld.advance(1.0)", tmp_path)
    while not (tmp_path / "rigid-envs" / "claims").exists():
        time.sleep(0.01)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, log = process.communicate(timeout=10)
    assert log.rstrip().endswith("KeyboardInterrupt")
