"""Errors that a running simulation raises."""


class SimulationDiverged(ArithmeticError):
    """A world's state became infinite or NaN.

    Attributes:
        world: index of the first world that diverged.
        body: index of the first non-finite body in this world; the indices of drives follow those
            of the bodies.
        name: name of this body.
        time: s, simulated time at which the engine detected it, at most one collision step after
            the body became non-finite.
        cause: the most likely cause.
        worlds: indices of all worlds that diverged. The other worlds are unaffected.
    """

    _what = "became non-finite"

    def __init__(
        self, world: int, body: int, name: str, time: float, cause: str, worlds: list[int]
    ) -> None:
        """Builds the message from its parts."""
        self.world, self.body, self.name, self.time = world, body, name, time
        self.cause, self.worlds = cause, worlds
        more = f" ({len(worlds)} worlds in total)" if len(worlds) > 1 else ""
        super().__init__(
            f"world {world}{more}: {name} {self._what} at t = {time:.6g} s; likely cause: "
            f"{cause}. The other worlds are unaffected; restore(), reset() or set_state() makes "
            "this one usable again"
        )

    def __reduce__(self) -> tuple[object, ...]:
        """Pickles the constructor's arguments, so worker processes can pass the error on."""
        parts = (self.world, self.body, self.name, self.time, self.cause, self.worlds)
        return type(self), parts, vars(self)  # with its notes


class StepVanished(SimulationDiverged):
    """A world needs steps shorter than the adaptive integrator takes.

    The state of such a world is finite: it is the one before the step that failed, at `time`.
    """

    _what = "needs steps shorter than a millionth of Fidelity.substep"


class ContactOverflow(RuntimeError):
    """A pair of bodies has more touching particle pairs than the contact buffer can hold."""
