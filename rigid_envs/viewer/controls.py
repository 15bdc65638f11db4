"""The controls of a page: what a user sets, and what the settings cost and gain."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import viser
from viser import uplot

from physics.scene.fidelity import PRESETS
from rigid_envs.viewer.fidelity_change import CUSTOM, FidelityChange, name_of
from rigid_envs.viewer.scene_nodes import FORCES
from rigid_envs.viewer.session import Reading, Session

Array = np.ndarray
Post = Callable[[Callable[[], None]], None]

SPEEDS: dict[str, float] = {"0.1×": 0.1, "0.25×": 0.25, "1× (real time)": 1.0, "maximal": math.inf}
REAL_TIME = "1× (real time)"
NONE = "–"
MOST_FRICTION = 2.0  # end of the slider
SUBSTEPS = (0.1, 20.0)  # ms, ends of the slider
BRAND = (46, 150, 96)
RUN, PAUSE, STEP, RESET = BUTTONS = ("Run", "Pause", "Step", "Reset")


class Controls:
    """The panel of a page.

    What a user sets is posted as a function to the loop of the server, which alone touches the
    session.

    Args:
        gui: of the page.
        session: what is controlled.
        seed: of the first reset.
        post: takes a function that the loop calls soon.
        show_all: moves a client's camera so that it sees all worlds.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        session: Session,
        seed: int,
        post: Post,
        show_all: Callable[[viser.ClientHandle], None],
    ) -> None:
        """Adds all controls."""
        self._session, self._post = session, post
        self._change = FidelityChange(session, post, self._changed)
        self._held: list[Callable[[], None]] = []  # what a user does before the session is ready
        self._message = gui.add_markdown("")
        with gui.add_folder("Simulation"):
            self._state = gui.add_markdown("")
            self._buttons = gui.add_button_group("Episodes", BUTTONS)
            self._seed = gui.add_number("Seed of Reset", seed, min=0, step=1)
            self._speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value=REAL_TIME)
        with gui.add_folder("Fidelity and bodies"):
            self._preset = gui.add_dropdown("Fidelity", (*PRESETS, CUSTOM))
            low, high = SUBSTEPS
            self._substep = gui.add_slider("Substep (ms)", low, high, 0.05, low)
            friction = float(session.runner.world.parameters.friction[0, 0])
            self._first_friction = min(friction, MOST_FRICTION)
            self._friction = gui.add_slider(
                "Friction", 0.0, MOST_FRICTION, 0.05, self._first_friction
            )
            self._mass = gui.add_slider("Mass (factor)", 0.1, 10.0, 0.1, 1.0)
            self._costs = gui.add_markdown("")
        with gui.add_folder("Reward"):
            self._plot = _add_plot(gui, session)
        with gui.add_folder("Show"):
            self._forces = gui.add_dropdown("Contact forces", FORCES, initial_value=FORCES[0])
            self._goals = gui.add_checkbox("Goals", True)
            camera = gui.add_button("Show all worlds")
        self._connect()
        camera.on_click(lambda event: show_all(event.client) if event.client else None)
        self.show_settings()

    @property
    def speed(self) -> float:
        """Simulated seconds per second of wall time that the user wants, inf for the most."""
        return SPEEDS[self._speed.value]

    def start(self) -> None:
        """Compiles what the session needs; until then its worlds stand still."""
        self._change.start()

    @property
    def ready(self) -> bool:
        """Whether the session can advance without waiting for a kernel that is compiled."""
        return self._change.ready

    @property
    def forces(self) -> str:
        """Which forces to draw, one of `FORCES`."""
        return self._forces.value

    @property
    def goals(self) -> bool:
        """Whether to show the goals."""
        return self._goals.value

    def say(self, text: str) -> None:
        """Shows a message above the controls; an empty one removes it."""
        self._message.content = f"> **{_plain(text)}**" if text else ""

    def show_settings(self, besides: Any = None) -> None:
        """Shows the settings that the session has or will have, also after it rejected others.

        Args:
            besides: the control that keeps what it shows: while a user drags a slider, it is ahead
                of the session.
        """
        session, fidelity = self._session, self._change.target
        shown: list[tuple[Any, Any]] = [
            (self._preset, name_of(fidelity)),
            (self._substep, round(1e3 * fidelity.substep, 3)),
            (self._mass, 1.0 if session.mass is None else session.mass),
            (
                self._friction,
                self._first_friction if session.friction is None else session.friction,
            ),
        ]
        for handle, value in shown:
            if handle is not besides:
                handle.value = value

    def show_numbers(self) -> None:
        """Shows rewards, episodes, and what the present setting costs and gains."""
        session = self._session
        if not self.ready:
            self.say(self._change.describe())
            return
        numbers = session.state()
        rows = [f"| {name} | {value} |" for name, value in numbers.items()]
        self._state.content = "\n".join([f"| step | {session.steps:,} |", "|:--|--:|", *rows])
        self._costs.content = _cost_table(session.read(), session.before)
        self._plot.data = _plotted(session)
        if session.error:
            self.say(f"{session.error}. Reset starts new episodes.")
        elif compiling := self._change.describe():
            self.say(compiling)

    def _connect(self) -> None:
        """Connects what a user does with what the session does.

        viser also reports values that the program sets; those have no client.
        """
        session = self._session

        def on_update(handle: Any, change: Callable[[Any], None]) -> None:
            @handle.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is not None:
                    value = handle.value
                    self._post(lambda: self._try(lambda: change(value), handle))

        def press(button: str) -> None:
            if button == RESET:
                session.reset(int(self._seed.value))
                return
            session.paused = button != RUN
            if button == STEP:
                session.step()

        def preset(name: str) -> None:
            if name != CUSTOM:
                self._change.want(name)

        def substep(value: float) -> None:
            self._change.want(replace(self._change.target, substep=1e-3 * value))

        @self._buttons.on_click
        def _(event: viser.GuiEvent) -> None:
            button = event.target.value
            self._post(lambda: self._try(lambda: press(button)))

        on_update(self._preset, preset)
        on_update(self._substep, substep)
        on_update(self._friction, lambda value: session.change_parameters(friction=value))
        on_update(self._mass, lambda value: session.change_parameters(mass=value))

    def _changed(self, error: Exception | None) -> None:
        """After the fidelity has changed, or if it can't."""
        self.say("" if error is None else str(error))
        self.show_settings(besides=None if error else self._substep)
        held, self._held = self._held, []
        for act in held:
            act()

    def _try(self, act: Callable[[], None], control: Any = None) -> None:
        """Does what a user wants by a control; shows why if it can't be done."""
        if not self.ready and control not in (self._preset, self._substep):
            self._held.append(lambda: self._try(act, control))
            return
        self.say("")
        try:
            act()
        except (TypeError, ValueError) as error:
            self.say(str(error))
            control = None
        self.show_settings(besides=control)


def _plain(text: str) -> str:
    """Text without the characters that markdown reads as formatting."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]<>#|" else c for c in " ".join(text.split()))


def _cost_table(now: Reading, before: Reading | None) -> str:
    """A table of a reading next to that of the previous setting."""
    columns = [_cells(now)] + ([_cells(before)] if before else [])
    head = "| | now |" + (" before |" if before else "")
    rule = "|:--|" + "--:|" * len(columns)
    rows = [
        "| " + " | ".join([name, *(cells[name] for cells in columns)]) + " |"
        for name in columns[0]
        if any(cells[name] != NONE for cells in columns)
    ]
    return "\n".join([head, rule, *rows])


def _cells(reading: Reading) -> dict[str, str]:
    fidelity = reading.fidelity
    limit = reading.largest_step
    deep = 1e3 * reading.penetrations
    measured = not math.isnan(reading.step_time)
    return {
        "substep": f"{1e3 * fidelity.substep:.3g} ms",
        "friction": NONE if reading.friction is None else f"{reading.friction:g}",
        "mass": NONE if reading.mass is None else f"× {reading.mass:g}",
        "time per step and world": f"{1e6 * reading.step_time:.3g} µs" if measured else NONE,
        "simulated time per second": f"{reading.speed:,.0f} s" if measured else NONE,
        "penetration, median": f"{float(np.median(deep)):.3g} mm",
        "penetration, deepest": f"{deep.max():.3g} mm",
        "largest stable substep": f"{1e3 * limit:.3g} ms" if math.isfinite(limit) else "any",
    }


def _plotted(session: Session) -> tuple[Array, ...]:
    """Time and mean, least and largest reward; the last two only of several worlds.

    At least two points, because the page can't draw an axis for fewer.
    """
    rewards: tuple[Array, ...] = session.rewards()
    if len(rewards[0]) < 2:
        rewards = (np.array([0.0, session.runner.task.frame]), *(np.zeros(2) for _ in range(3)))
    return rewards if session.runner.count > 1 else rewards[:2]


def _add_plot(gui: viser.GuiApi, session: Session) -> Any:
    color = f"rgb{BRAND}"
    faint = f"rgba({BRAND[0]}, {BRAND[1]}, {BRAND[2]}, 0.35)"
    series = [
        uplot.Series(label="s"),
        uplot.Series(label="mean", stroke=color, width=2),
        uplot.Series(label="least", stroke=faint, width=1),
        uplot.Series(label="largest", stroke=faint, width=1),
    ]
    data = _plotted(session)
    fill = f"rgba({BRAND[0]}, {BRAND[1]}, {BRAND[2]}, 0.12)"
    return gui.add_uplot(
        data,
        tuple(series[: len(data)]),
        bands=(uplot.Band(series=(3, 2), fill=fill),) if len(data) > 2 else None,
        scales={"x": uplot.Scale(time=False)},
        title="reward per step over simulated time in s",
        height=200,
    )
