"""The server of the page: one loop advances the session and shows it in connected browsers."""

import contextlib
import errno
import io
import math
import os
import queue
import socket
import threading
import time
from collections.abc import Callable

import numpy as np
import viser

from rigid_envs.viewer.controls import BRAND, Controls
from rigid_envs.viewer.scene_nodes import SceneNodes
from rigid_envs.viewer.session import Session

FRAME_TIME = 0.04  # s of wall time between pictures
PANEL = 380  # pixels, width of the controls
NUMBERS_TIME = 0.25  # s of wall time between updates of numbers and plot
SETTLING = 2.0  # s, after which the page of a new browser has its final size
WAITING = 0.2  # s, how often a loop that waits checks whether to stop


class AddressUnavailable(RuntimeError):
    """The server can't listen on a host and port."""


class ViewServer:
    """Serves a page that shows a session and controls it.

    Args:
        session: what to show. From now on only `run` may touch it.
        host: address to listen on. 127.0.0.1 accepts connections from this machine alone.
        port: port to listen on; 0 chooses a free one.
        title: of the page.
        seed: that the page offers for a reset.

    Raises:
        AddressUnavailable: the port is in use, or the host isn't one of this machine.
    """

    def __init__(
        self,
        session: Session,
        host: str = "127.0.0.1",
        port: int = 8080,
        title: str = "rigid-envs",
        seed: int = 0,
    ) -> None:
        """Starts to listen. Nothing is simulated before `run`."""
        self.session, self._closed = session, False
        self._posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._server = _start(host, port, title)
        self.url = f"http://{host}:{self._server.get_port()}"
        self._server.gui.configure_theme(
            show_logo=False, show_share_button=False, brand_color=BRAND
        )
        self._server.gui.main_panel.dock_right()
        self._server.gui.main_panel.set_width(PANEL)
        self._nodes = SceneNodes(self._server.scene, session.runner)
        self._controls = Controls(self._server.gui, session, seed, self._posted.put, self._show_all)
        self._server.on_client_connect(self._show_first)
        self._server.on_client_disconnect(self._report_disconnect)

    def run(self, stop: threading.Event | None = None) -> None:
        """Advances and shows the session until `stop` is set, or forever.

        Nothing advances while no browser is connected. Call `close` afterwards.
        """
        stop = stop or threading.Event()
        self._controls.start()
        next_step = next_numbers = time.perf_counter()
        while not stop.is_set():
            if not self._server.get_clients():
                self._do_posted(WAITING)
                next_step = time.perf_counter()
                continue
            shown = time.perf_counter()
            next_step = self._advance(next_step)
            with self._server.atomic():
                if self._controls.ready:
                    self._nodes.update(self._controls.forces, self._controls.goals)
                if time.perf_counter() >= next_numbers:
                    self._controls.show_numbers()
                    next_numbers = time.perf_counter() + NUMBERS_TIME
            self._do_posted(max(0.0, shown + FRAME_TIME - time.perf_counter()))

    def close(self) -> None:
        """Stops to listen and disconnects all browsers."""
        self._closed = True
        _stop(self._server)

    def _advance(self, next_step: float) -> float:
        """Advances by the steps that are due; returns when the next one is, in s of the clock."""
        session, speed = self.session, self._controls.speed
        start = time.perf_counter()
        if session.paused or session.error or not self._controls.ready:
            return start
        if math.isinf(speed):
            while time.perf_counter() < start + FRAME_TIME:
                session.advance()
            return time.perf_counter()
        pace = session.runner.task.frame / speed
        while next_step <= time.perf_counter() < start + FRAME_TIME:
            session.advance()
            next_step += pace
        # time that the machine couldn't keep up with is not made up for
        return max(next_step, time.perf_counter() - FRAME_TIME)

    def _do_posted(self, seconds: float) -> None:
        """Does what the controls post, for some time."""
        end = time.perf_counter() + seconds
        while True:
            with contextlib.suppress(queue.Empty):
                self._posted.get(timeout=max(1e-3, end - time.perf_counter()))()
            if time.perf_counter() >= end:
                return

    def _show_first(self, client: viser.ClientHandle) -> None:
        """Shows all worlds to a new browser, again if its controls take room meanwhile."""
        aspect = math.nan
        for _ in range(round(SETTLING / WAITING)):
            if client.camera.aspect != aspect:
                aspect = client.camera.aspect
                self._show_all(client)
            time.sleep(WAITING)

    def _show_all(self, client: viser.ClientHandle) -> None:
        """Moves the camera of a browser so that it sees all worlds."""
        view = self._nodes.layout.view(client.camera.aspect)
        with client.atomic():
            client.camera.fov = math.radians(view.field_of_view)
            client.camera.position = view.eye
            client.camera.look_at = np.array(view.target)

    def _report_disconnect(self, _: viser.ClientHandle) -> None:
        if not self._server.get_clients() and not self._closed:
            print(f"the browser has disconnected: the simulation waits until one opens {self.url}")


def check_address(host: str, port: int) -> None:
    """Raises AddressUnavailable if a server couldn't listen on a host and port now."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        socket.create_server((host, port), family=family).close()
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise AddressUnavailable(f"port {port} of {host} is in use") from None
        code = error.errno or 0  # negative where a name has no address
        why = os.strerror(code) if code > 0 else error.strerror
        raise AddressUnavailable(f"can't listen on port {port} of {host}: {why}") from None


def _start(host: str, port: int, title: str) -> viser.ViserServer:
    """A server on this port; viser alone would take the next free one."""
    check_address(host, port)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner
        server = viser.ViserServer(host, port, label=title, verbose=False)
    if port not in (0, server.get_port()):
        _stop(server)
        raise AddressUnavailable(f"port {port} of {host} is in use")
    return server


def _stop(server: viser.ViserServer) -> None:
    with contextlib.redirect_stdout(io.StringIO()):  # viser reports it
        server.stop()
