"""Features that tell millimetres apart near zero and still cover metres."""

from collections.abc import Sequence

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from training.policies.reflections import Images, unchanged
from training.settings.components import component_indices
from training.settings.errors import UsageError

UNITS = (0.1, 0.002)
"""By default each quantity is divided by each of these: a tenth of a metre, and two millimetres."""


def symlog(x: torch.Tensor) -> torch.Tensor:
    """sign(x) ln(1 + |x|): linear near zero, logarithmic far from it."""
    return torch.sign(x) * torch.log1p(torch.abs(x))


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
        UsageError: The space has no goals, or the observation has no such component, or it is
            listed twice.
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
        self.keys, self.sizes = list(sizes), sizes
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
        self.names = [
            *(f"component {component} of the observation" for component in chosen),
            *(f"component {row} of desired minus achieved goal" for row in range(goal)),
            *(f"the difference {list(pair)}" for pair in differences),
        ] * len(units)

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, len(units) (components + goal + differences)]."""
        parts = [observations[key].flatten(start_dim=1) for key in self.keys]
        return symlog(torch.cat(parts, dim=1) @ self.matrix.T)

    def images(self, observation: Images, goal: Images) -> Images:
        """Images [1, features] of the features where these are the images of their components.

        Args:
            observation: Image of `observation` in a mirror.
            goal: Image of both goals.

        Raises:
            UsageError: The image of a feature is no feature, no feature changes, or one is listed
                twice.
        """
        x = torch.empty_like(self.matrix)  # rows of the matrix for the image of the observation
        for key in self.keys:
            source, sign = observation if key == "observation" else goal
            columns = torch.arange(self.first[key], self.first[key] + self.sizes[key])
            x[:, columns[source[0]]] = self.matrix[:, columns] * sign[0]
        same, opposite = ((x[:, None] == y).all(dim=2) for y in (self.matrix, -self.matrix))
        missing = torch.nonzero(~(same | opposite).any(dim=1)).flatten().tolist()
        if missing:
            raise UsageError(
                f"mirrors: the image of {self.names[missing[0]]} is no feature: of components that "
                "change places, and of differences whose components do, both should be observed; "
                "the components of a difference should both change sign, or none"
            )
        source = (same | opposite).int().argmax(dim=1)
        found = Images(source[None], torch.where(same.any(dim=1), 1.0, -1.0)[None])
        original = unchanged(len(self.matrix))
        if found.same_as(original):
            raise UsageError("mirrors: no feature changes in a mirror, so no action could")
        if not found.after(found).same_as(original):
            raise UsageError("mirrors requires that differences lists no pair twice, in any order")
        return found
