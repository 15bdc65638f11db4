"""Errors of a running simulation."""


class SimulationDiverged(ArithmeticError):
    """A world's state became infinite or NaN.

    Attributes:
        world: index of the first such world.
        body: index of its first such body; drives follow the bodies.
        name: name of that body.
        time: simulated time in s at which it was detected, at most a collision step late.
        cause: the most likely cause.
        worlds: indices of all such worlds. The other worlds are unaffected.
    """

    def __init__(
        self, world: int, body: int, name: str, time: float, cause: str, worlds: list[int]
    ) -> None:
        """Builds the message from its parts."""
        self.world, self.body, self.name, self.time = world, body, name, time
        self.cause, self.worlds = cause, worlds
        more = f" ({len(worlds)} worlds in total)" if len(worlds) > 1 else ""
        super().__init__(
            f"world {world}{more}: {name} became non-finite at t = {time:.6g} s; likely cause: "
            f"{cause}. The other worlds are unaffected; restore(), reset() or set_state() makes "
            "this one usable again"
        )

    def __reduce__(self) -> tuple[object, ...]:
        """Pickles by parts: worker processes pass errors to their parent."""
        parts = (self.world, self.body, self.name, self.time, self.cause, self.worlds)
        return type(self), parts


class ContactOverflow(RuntimeError):
    """A pair of bodies has more touching particle pairs than there is room for."""
