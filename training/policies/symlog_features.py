"""Features that tell millimetres apart near zero and still cover metres."""

from collections.abc import Sequence

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from training.settings.errors import UsageError

UNITS = (0.1, 0.002)
"""By default each quantity is divided by each of these: a tenth of a metre, and two millimetres."""


def symlog(x: torch.Tensor) -> torch.Tensor:
    """sign(x) ln(1 + |x|): linear near zero, logarithmic far from it."""
    return torch.sign(x) * torch.log1p(torch.abs(x))


def component_indices(
    name: str, indices: Sequence[int | str], size: int, vector: str = "observation"
) -> list[int]:
    """Which components of a vector of this size are meant, counted from 0.

    Args:
        name: Setting, for the message.
        indices: Indices, -1 being the last component, and slices such as "0:-1:3".
        size: Size of the vector.
        vector: What the vector is, for the message.

    Raises:
        UsageError: There is no such component.
    """
    found: list[int] = []
    for index in indices:
        if isinstance(index, str):
            bounds = [int(bound) if bound else None for bound in index.split(":")]
            found += range(size)[slice(*bounds)]
        elif -size <= index < size:
            found.append(index % size)
        else:
            raise UsageError(
                f"{name}: {index} in {list(indices)}, should be a component of the {vector}, "
                f"{-size} to {size - 1}"
            )
    return found


class SymlogOffsets(BaseFeaturesExtractor):
    """Features: symlog(x / unit) of each x and each unit.

    x are components of the observation, those of desired minus achieved goal, and the given
    differences. A cube is released within 4 mm of its place but carried from tenths of a
    metre away; a network of few units cannot resolve both in one linear scale. Symlog is that of
    Hafner et al., Mastering diverse domains through world models (2023).

    The extractor has no parameters, and a policy file stores `matrix` as a layer of its own.

    Args:
        space: Observation space of a goal environment.
        differences: Pairs [a, b] of components of `observation`, whose difference a - b is an x
            too; -1 is the last component.
        components: Components of `observation` that are x, as indices, -1 being the last, or as
            slices such as "3:6"; None for all.
        units: What each x is divided by, in the unit of x.

    Raises:
        UsageError: The space has no goals, or the observation has no such component.
    """

    matrix: torch.Tensor

    def __init__(
        self,
        space: spaces.Dict,
        differences: Sequence[Sequence[int]] = (),
        components: Sequence[int | str] | None = None,
        units: Sequence[float] = UNITS,
    ):
        sizes = {key: int(np.prod(one.shape or ())) for key, one in space.spaces.items()}
        if set(sizes) != {"observation", "achieved_goal", "desired_goal"}:
            raise UsageError(f"symlog policies require observations with goals, not {space}")
        size, goal = sizes["observation"], sizes["desired_goal"]
        pairs = [component_indices("differences", pair, size) for pair in differences]
        chosen = list(range(size))
        if components is not None:
            chosen = component_indices("components", components, size)
        observed = len(chosen)
        rows = observed + goal + len(differences)
        super().__init__(space, rows * len(units))
        self.keys, self.sizes, self.pairs = list(sizes), sizes, pairs
        ends = np.cumsum(list(sizes.values()))
        first = self.first = dict(zip(sizes, ends - list(sizes.values()), strict=True))
        x = torch.zeros(rows, int(ends[-1]))
        for row, component in enumerate(chosen):
            x[row, first["observation"] + component] = 1.0
        for row in range(goal):
            x[observed + row, first["desired_goal"] + row] = 1.0
            x[observed + row, first["achieved_goal"] + row] = -1.0
        for row, (a, b) in enumerate(pairs, start=observed + goal):
            x[row, first["observation"] + a] = 1.0
            x[row, first["observation"] + b] = -1.0
        self.register_buffer("matrix", torch.cat([x / unit for unit in units]))

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, len(units) (components + goal + differences)]."""
        parts = [observations[key].flatten(start_dim=1) for key in self.keys]
        return symlog(torch.cat(parts, dim=1) @ self.matrix.T)

    def signs(self, observation: Sequence[int | str], goal: Sequence[int | str]) -> torch.Tensor:
        """Which features [n] change sign (-1) or stay (1) where these components change sign.

        Args:
            observation: Components of `observation`, as in the constructor.
            goal: Components of both goals, likewise.

        Raises:
            UsageError: There is no such component, or a difference would not keep its size.
        """
        sign = torch.ones(self.matrix.shape[1])
        changing = {"observation": observation, "desired_goal": goal, "achieved_goal": goal}
        for key, indices in changing.items():
            listed = component_indices("mirrors", indices, self.sizes[key], key.replace("_", " "))
            sign[[self.first[key] + index for index in listed]] = -1.0
        for a, b in self.pairs:
            if sign[self.first["observation"] + a] != sign[self.first["observation"] + b]:
                raise UsageError(
                    f"mirrors change the sign of one component of the difference [{a}, {b}], "
                    "should be that of both or of none"
                )
        # each row holds one component, or two that both change their sign
        changed = ((self.matrix != 0.0) & (sign < 0.0)).any(dim=1)
        return torch.where(changed, -1.0, 1.0)
