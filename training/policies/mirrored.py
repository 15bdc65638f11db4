"""Networks that act in the mirror image of a state as the mirror shows it.

A task that looks the same in a mirror does not have to be learned on both sides of it. Each
reflection changes the sign of some components of the observation and of the action. The network is
equivariant: where it answers the observation s with the mean action a, it answers the mirror image
of s with that of a, and both states have the same value.

Hidden units come in groups of one for each combination of the reflections (four for two
reflections); a reflection swaps units within their groups. A layer with weights W is equivariant if
W = P W Q for each combination, where Q mirrors what the layer reads and P what it writes. The
average of P W Q over all combinations has this property. So the first weights are averaged, and so
is each gradient: the optimiser keeps the property, and layers and files are those of an ordinary
network. An averaged gradient is that of the loss on the batch and all its mirror images (van der
Pol et al., MDP homomorphic networks, 2020).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule

from training.policies.symlog_features import SymlogOffsets, component_indices
from training.settings.errors import UsageError


@dataclass(frozen=True)
class Images:
    """How the mirror images of n values follow from them, for each of k combinations.

    The image of x has components sign[c, i] x[source[c, i]].

    Attributes:
        source: [k, n] indices.
        sign: [k, n] ±1.
    """

    source: torch.Tensor
    sign: torch.Tensor

    @staticmethod
    def of_signs(signs: torch.Tensor) -> "Images":
        """Images of values [n] that keep their place; signs [mirrors, n] of each reflection."""
        mirrors, n = signs.shape
        rows = [
            torch.prod(torch.where(torch.tensor(used, dtype=torch.bool)[:, None], signs, 1.0), 0)
            for used in product((0, 1), repeat=mirrors)
        ]
        return Images(torch.arange(n).expand(len(rows), n), torch.stack(rows))

    @staticmethod
    def of_units(mirrors: int, n: int) -> "Images":
        """Images of n hidden units in groups of 2^mirrors.

        Raises:
            UsageError: n is not a multiple of that.
        """
        size = 2**mirrors
        if n % size:
            raise UsageError(
                f"net_arch has a layer of {n} units, should have multiples of {size} with "
                f"{mirrors} mirrors"
            )
        unit = torch.arange(n)
        member, group = unit // (n // size), unit % (n // size)
        rows = [(member ^ used) * (n // size) + group for used in range(size)]
        return Images(torch.stack(rows), torch.ones(size, n))


class Average:
    """Averages the weights [out, in] or biases [out] of a layer over all mirror images.

    Args:
        written: Images of what the layer writes.
        read: Images of what it reads; None for biases.
    """

    def __init__(self, written: Images, read: Images | None = None):
        self.source, self.sign = written.source, written.sign
        if read is not None:
            width = read.source.shape[1]
            self.source = self.source[:, :, None] * width + read.source[:, None, :]
            self.sign = self.sign[:, :, None] * read.sign[:, None, :]

    def __call__(self, values: torch.Tensor) -> torch.Tensor:
        """The average, in the shape of the values."""
        return (values.flatten()[self.source] * self.sign).mean(0)


class Mirrored:
    """Makes the networks of a PPO policy with symlog features equivariant under reflections.

    Args:
        *args: As for the policy.
        mirrors: For each reflection the components that change sign, by the keys `observation`,
            `goal` and `actions`, as indices, -1 being the last, or as slices such as "0:-1:3". A
            missing key stands for none.
        **kwargs: As for the policy.

    Raises:
        UsageError: There is no such component, a difference has only one component that changes
            sign, or a hidden layer cannot be divided into groups.
    """

    def __init__(
        self, *args: Any, mirrors: Sequence[Mapping[str, Sequence[int | str]]] = (), **kwargs: Any
    ):
        self.mirrors = mirrors
        super().__init__(*args, **kwargs)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "mirrors": self.mirrors}  # type: ignore[misc]

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)  # type: ignore[misc]
        if self.mirrors:
            _tie(self, self.mirrors)  # type: ignore[arg-type]


def _tie(policy: ActorCriticPolicy, mirrors: Sequence[Mapping[str, Sequence[int | str]]]) -> None:
    """Averages the policy's weights, and from now on their gradients, over all mirror images."""
    extractor = policy.features_extractor
    assert isinstance(extractor, SymlogOffsets)
    features = [extractor.signs(m.get("observation", ()), m.get("goal", ())) for m in mirrors]
    size = spaces.flatdim(policy.action_space)
    actions = torch.ones(len(mirrors), size)
    for row, mirror in zip(actions, mirrors, strict=True):
        row[component_indices("mirrors", mirror.get("actions", ()), size, "action")] = -1.0
    observed, acted = Images.of_signs(torch.stack(features)), Images.of_signs(actions)

    def unchanged(n: int) -> Images:
        return Images.of_signs(torch.ones(len(mirrors), n))

    networks: list[tuple[Any, list[tuple[Any, Images]]]] = [
        (policy.mlp_extractor.policy_net, [(policy.action_net, acted)]),
        (policy.mlp_extractor.value_net, [(policy.value_net, unchanged(1))]),
    ]
    if getattr(policy, "state_dependent_std", False):  # a deviation has no sign
        networks[0][1].append((policy.std_net, unchanged(size)))
    for hidden, heads in networks:
        read = observed
        for layer in hidden:
            if isinstance(layer, torch.nn.Linear):
                units = Images.of_units(len(mirrors), layer.out_features)
                _tie_layer(layer, units, read)
                read = units
        for head, written in heads:
            _tie_layer(head, written, read)


def _tie_layer(layer: torch.nn.Linear, written: Images, read: Images) -> None:
    weight, bias = Average(written, read), Average(written)
    with torch.no_grad():
        # the average of n independent numbers is smaller by √n
        layer.weight.copy_(weight(layer.weight) * len(read.sign) ** 0.5)
        layer.bias.copy_(bias(layer.bias))
    layer.weight.register_hook(weight)
    layer.bias.register_hook(bias)
