"""Features that tell millimetres apart near zero and still cover metres."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from training.policies.features.next_object import NextObject, pass_next
from training.policies.features.reflections import Images, unchanged
from training.settings.components import component_indices
from training.settings.errors import UsageError

UNITS = (0.1, 0.002)
"""By default each quantity is divided by each of these: a tenth of a metre, and two millimetres."""

Row = tuple[torch.Tensor, str]
"""What a quantity x is: its weight of each entry of keys and vectors in order, and its name."""


def symlog(x: torch.Tensor) -> torch.Tensor:
    """sign(x) ln(1 + |x|): linear near zero, logarithmic far from it."""
    return torch.sign(x) * torch.log1p(torch.abs(x))


class SymlogOffsets(BaseFeaturesExtractor):
    """Features: symlog(x / unit) of each x and each unit.

    x are components of the observation, those of desired minus achieved goal, the given
    differences, and the same of the next of several objects. A cube is released within 4 mm of its
    place but carried from tenths of a metre away; a network of few units cannot resolve both in one
    linear scale. Symlog is that of Hafner et al., Mastering diverse domains through world models
    (2023).

    The extractor has no parameters, and a policy file stores `matrix`, and `mix` if there are
    several objects, as layers of their own.

    Args:
        space: Observation space of a goal environment.
        differences: Pairs [a, b] of components of `observation`, whose difference a - b is an x
            too; -1 is the last component.
        components: Components of `observation` that are x, as indices, -1 being the last, or as
            slices such as "3:6"; None for all.
        units: What each x is divided by, in the unit of x.
        next_object: The distance `within` which an object is at its goal, in the unit of the goal,
            and the `objects` in order, each with `components` and `differences` of its own. The
            goal has as many components for each. Those of the next object are x too: desired
            minus achieved goal, components and differences. See `pass_next`.

    Raises:
        UsageError: The space has no goals, or the observation has no such component, or it is
            listed twice, or the goal cannot be divided among the objects, or they differ in the
            number of components or differences.
    """

    matrix: torch.Tensor
    mix: torch.Tensor

    def __init__(
        self,
        space: spaces.Dict,
        differences: Sequence[Sequence[int]] = (),
        components: Sequence[int | str] | None = None,
        units: Sequence[float] = UNITS,
        next_object: Mapping[str, Any] | None = None,
    ):
        sizes = {key: int(np.prod(one.shape or ())) for key, one in space.spaces.items()}
        if set(sizes) != {"observation", "achieved_goal", "desired_goal"}:
            raise UsageError(f"symlog policies require observations with goals, not {space}")
        self.keys, self.sizes = list(sizes), sizes
        ends = np.cumsum(list(sizes.values()))
        self.first = dict(zip(sizes, ends - list(sizes.values()), strict=True))
        if components is None:
            components = range(sizes["observation"])
        goal = range(sizes["desired_goal"])
        rows = [
            *self._components(components),
            *self._goal_offsets(goal),
            *self._differences(differences),
        ]
        self.objects, blocks = self._objects(next_object)
        self.shared = len(rows)  # of the x, those that don't belong to the next object
        names = [name for _, name in rows + blocks[0]]
        super().__init__(space, len(names) * len(units))
        self.names = names * len(units)
        self.of_next = (torch.arange(len(names)) >= self.shared).repeat(len(units))
        scale = torch.cat([torch.eye(len(names)) / unit for unit in units])
        x = torch.stack([row for block in [rows, *blocks] for row, _ in block])
        if self.objects is None:
            self.register_buffer("matrix", scale @ x)
        else:
            self.register_buffer("matrix", x)
            chosen = [scale[:, self.shared :]] * self.objects.count
            self.register_buffer("mix", torch.cat([scale[:, : self.shared], *chosen], dim=1))

    def _row(self, name: str, *weights: tuple[str, int, float]) -> Row:
        row = torch.zeros(sum(self.sizes.values()))
        for key, component, weight in weights:
            row[self.first[key] + component] += weight
        return row, name

    def _components(self, listed: Sequence[int | str]) -> list[Row]:
        return [
            self._row(f"component {one} of the observation", ("observation", one, 1.0))
            for one in component_indices("components", listed, self.sizes["observation"])
        ]

    def _goal_offsets(self, listed: Sequence[int]) -> list[Row]:
        return [
            self._row(
                f"component {one} of desired minus achieved goal",
                ("desired_goal", one, 1.0),
                ("achieved_goal", one, -1.0),
            )
            for one in listed
        ]

    def _differences(self, pairs: Sequence[Sequence[int]]) -> list[Row]:
        found = []
        for pair in pairs:
            a, b = component_indices("differences", pair, self.sizes["observation"])
            weights = ("observation", a, 1.0), ("observation", b, -1.0)
            found.append(self._row(f"the difference {list(pair)}", *weights))
        return found

    def _objects(self, given: Mapping[str, Any] | None) -> tuple[NextObject | None, list[Any]]:
        """The description of the objects, and the rows of each."""
        if given is None:
            return None, [[]]
        each, size = given["objects"], self.sizes["desired_goal"]
        share = size // len(each)
        if share * len(each) != size:
            raise UsageError(
                f"next_object: objects has {len(each)} entries, but the goal has {size} components,"
                f" which {len(each)} objects cannot share equally"
            )
        blocks = [
            [
                *self._goal_offsets(range(number * share, (number + 1) * share)),
                *self._components(one.get("components", ())),
                *self._differences(one.get("differences", ())),
            ]
            for number, one in enumerate(each)
        ]
        counts = {
            (len(one.get("differences", ())), len(block))
            for one, block in zip(each, blocks, strict=True)
        }
        if len(counts) > 1:
            raise UsageError(
                "next_object: objects should have equal numbers of components, and of differences"
            )
        return NextObject(len(each), len(blocks[0]), share, given["within"]), blocks

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Features [n, len(units) (components + goal + differences)], next object included."""
        parts = [observations[key].flatten(start_dim=1) for key in self.keys]
        x = torch.cat(parts, dim=1) @ self.matrix.T
        if self.objects is not None:
            x = pass_next(x, self.objects) @ self.mix.T
        return symlog(x)

    def images(self, observation: Images, goal: Images) -> Images:
        """Images [1, features] of the features where these are the images of their components.

        Args:
            observation: Image of `observation` in a mirror.
            goal: Image of both goals.

        Raises:
            UsageError: The image of a feature is no feature, no feature changes, one is listed
                twice, or which feature it is depends on the next object.
        """
        if self.objects is None:
            return self._images(self.matrix, observation, goal)
        count, size = self.objects.count, self.objects.size
        found = []
        for number in range(count):  # where this object is the next one
            passed = torch.zeros(len(self.matrix), 1)
            passed[: self.shared] = 1.0
            passed[self.shared + number * size :][:size] = 1.0
            found.append(self._images(self.mix @ (passed * self.matrix), observation, goal))
        if not all(one.same_as(found[0]) for one in found):
            raise UsageError(
                "mirrors: the image of what next_object observes depends on the object: all "
                "objects should change alike, and keep their places"
            )
        return found[0]

    def _images(self, matrix: torch.Tensor, observation: Images, goal: Images) -> Images:
        """As `images`, of the features symlog(matrix @ observations)."""
        x = torch.empty_like(matrix)  # rows of the matrix for the image of the observation
        for key in self.keys:
            source, sign = observation if key == "observation" else goal
            columns = torch.arange(self.first[key], self.first[key] + self.sizes[key])
            x[:, columns[source[0]]] = matrix[:, columns] * sign[0]
        kind = self.of_next[:, None] == self.of_next
        same, opposite = ((x[:, None] == y).all(dim=2) & kind for y in (matrix, -matrix))
        missing = torch.nonzero(~(same | opposite).any(dim=1)).flatten().tolist()
        if missing:
            raise UsageError(
                f"mirrors: the image of {self.names[missing[0]]} is no feature: of components that "
                "change places, and of differences whose components do, both should be observed; "
                "the components of a difference should both change sign, or none"
            )
        source = (same | opposite).int().argmax(dim=1)
        found = Images(source[None], torch.where(same.any(dim=1), 1.0, -1.0)[None])
        original = unchanged(len(matrix))
        if found.same_as(original):
            raise UsageError("mirrors: no feature changes in a mirror, so no action could")
        if not found.after(found).same_as(original):
            raise UsageError("mirrors requires that differences lists no pair twice, in any order")
        return found
