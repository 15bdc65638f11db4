"""Errors of a running simulation."""


class SimulationDiverged(ArithmeticError):
    """A world's state became infinite or NaN.

    Attributes:
        world: index of the first such world.
        body: index of its first such body; drives count on after the bodies.
        time: s of simulated time at which it was noticed, at most a collision step late.
        cause: what most likely led to it.
        worlds: indices of all such worlds. The others are whole and carry on.
    """

    def __init__(self, world: int, body: int, time: float, cause: str, worlds: list[int]) -> None:
        """Builds the message from its parts."""
        self.world, self.body, self.time, self.cause, self.worlds = world, body, time, cause, worlds
        more = f" ({len(worlds)} worlds in all)" if len(worlds) > 1 else ""
        super().__init__(
            f"world {world}{more}: body {body} turned non-finite at t = {time:.6g} s; likely "
            f"cause: {cause}. The other worlds are unharmed; restore(), reset() or set_state() "
            "brings this one back"
        )

    def __reduce__(self) -> tuple[object, ...]:
        """Pickles by parts: worker processes hand errors to their parent."""
        return type(self), (self.world, self.body, self.time, self.cause, self.worlds)


class ContactOverflow(RuntimeError):
    """A pair of bodies has more touching particle pairs than room was made for."""
