"""Butcher tableaus: the coefficients of explicit Runge-Kutta methods.

A step of y' = f(y) from y_0 is k_0 = f(y_0), k_s = f(y_0 + h sum_j a_sj k_j), and at its end
y_0 + h sum_j b_j k_j. Forces don't depend on time, so the nodes c_s are not needed.
"""

from typing import NamedTuple

Coefficients = tuple[float, ...]


class Tableau(NamedTuple):
    """One method.

    Attributes:
        rows: a_s of the stages s = 1, 2, ..., each with s entries or fewer (zeros follow), and as
            the last row b.
        error: b minus the weights of the other method of an embedded pair; empty without one.
    """

    rows: tuple[Coefficients, ...]
    error: Coefficients = ()

    @property
    def stages(self) -> int:
        """Number of k_s; a step evaluates the forces so often, the last time at its end."""
        return len(self.rows)

    @property
    def flat(self) -> Coefficients:
        """The rows one after the other, each filled with zeros to `stages` entries."""
        return tuple(a for row in self.rows for a in (*row, *(0.0,) * (self.stages - len(row))))


# the classical method of order 4 (Kutta 1901)
RUNGE_KUTTA_4 = Tableau(((1 / 2,), (0.0, 1 / 2), (0.0, 0.0, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)))

_FIFTH = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0)
_FOURTH = (
    5179 / 57600, 0.0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40,
)  # fmt: skip

# The pair of orders 5 and 4 of Dormand and Prince (1980). The step ends at the solution of order 4,
# whose error is the one that is estimated: that of order 5 would have an error proportional to
# tolerance^(5/4) under a control per unit step, so the tolerance would not say what you get
DORMAND_PRINCE = Tableau(
    rows=(
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
        _FIFTH[:-1],
        _FOURTH,
    ),
    error=tuple(fourth - fifth for fourth, fifth in zip(_FOURTH, _FIFTH, strict=True)),
)
