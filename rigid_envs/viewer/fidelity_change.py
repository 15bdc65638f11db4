"""Kernels of the session's fidelity, and of the next one, are compiled while the page answers."""

import threading
import time
from collections.abc import Callable

from physics import Fidelity
from physics.compiler.jit import being_compiled
from physics.scene.fidelity import PRESETS, resolve
from rigid_envs.viewer.session import Session

CUSTOM = "custom"
NOTICED = 0.5  # s, after which a page says what is compiled


class FidelityChange:
    """The fidelity that a user wants next; at first that of the session.

    A thread compiles what it needs, in 10 to 70 s where nothing has been compiled before, in
    milliseconds where all has. Then the loop of the server changes to it. Of several wishes in the
    meantime only the last one counts. All methods are for the thread of the loop. Until `ready`
    nothing else may touch the session, because the thread tries out a step of it.

    Attributes:
        ready: whether the session can advance: its own kernels are there.

    Args:
        session: whose fidelity.
        post: takes a function that the loop calls soon.
        done: is called after the change, or with the error that prevents it.
    """

    def __init__(
        self,
        session: Session,
        post: Callable[[Callable[[], None]], None],
        done: Callable[[Exception | None], None],
    ) -> None:
        self._session, self._post, self._done = session, post, done
        self.ready = False
        self._wanted: Fidelity | None = None
        self._prepared: Fidelity | None = None  # by the thread, if it runs
        self._since = 0.0

    def start(self) -> None:
        """Compiles what the session itself needs."""
        self.want(self._session.fidelity)

    @property
    def target(self) -> Fidelity:
        """The fidelity that is wanted, or that the session has."""
        return self._wanted or self._session.fidelity

    def want(self, fidelity: str | Fidelity) -> None:
        """Changes to a fidelity as soon as its kernels are there."""
        self._wanted = resolve(fidelity)
        if self._prepared is None:
            self._prepare(self._wanted)

    def describe(self) -> str:
        """What is being compiled and since when; empty if nothing is, or only for a moment."""
        seconds = time.perf_counter() - self._since
        if self._prepared is None or seconds < NOTICED:
            return ""
        kernel = being_compiled()
        which = f" (the kernel {kernel})" if kernel else ""
        now = f"go on at {name_of(self._session.fidelity)}" if self.ready else "start then"
        wanted = f"Compiling for {name_of(self._prepared)}{which} since {seconds:.0f} s"
        return f"{wanted}. The worlds {now}."

    def _prepare(self, fidelity: Fidelity) -> None:
        def run() -> None:
            error: Exception | None = None
            try:
                if self.ready:
                    self._session.runner.prepare_fidelity(fidelity)
                else:
                    self._session.warm_up()
            except Exception as caught:  # raised again by the loop, if it isn't a user's mistake
                error = caught
            self._post(lambda: self._finish(fidelity, error))

        self._prepared, self._since = fidelity, time.perf_counter()
        threading.Thread(target=run, name="compiling", daemon=True).start()

    def _finish(self, fidelity: Fidelity, error: Exception | None) -> None:
        self._prepared, self.ready = None, True
        if error is not None and not isinstance(error, TypeError | ValueError):
            raise error
        if self._wanted is not None and fidelity != self._wanted:
            self._prepare(self._wanted)
            return
        self._wanted = None
        if error is None:
            try:
                self._session.change_fidelity(fidelity)
            except (TypeError, ValueError) as caught:
                error = caught
        self._done(error)


def name_of(fidelity: Fidelity) -> str:
    """The preset's name, or "custom"."""
    return next((name for name, preset in PRESETS.items() if preset == fidelity), CUSTOM)
