"""Networks that act in the mirror image of a state as the mirror shows it.

A task that looks the same in a mirror does not have to be learned on both sides of it. In each
mirror some components of observation and action change their sign or place. The network is
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
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule

from training.policies.reflections import (
    Entry,
    Images,
    combinations,
    reflection,
    unchanged,
    unit_images,
)
from training.policies.symlog_features import SymlogOffsets


class Average:
    """Averages the weights [out, in] or biases [out] of a layer over all mirror images.

    Weights that are images of each other have one average, which is computed once.

    Args:
        written: Images of what the layer writes.
        read: Images of what it reads; None for biases.
    """

    def __init__(self, written: Images, read: Images | None = None):
        source, sign = written
        if read is not None:
            width = read.source.shape[1]
            source = (source[:, :, None] * width + read.source[:, None, :]).flatten(1)
            sign = (sign[:, :, None] * read.sign[:, None, :]).flatten(1)
        first, image = source.min(dim=0)  # of all images of a weight
        chosen, self.place = torch.unique(first, return_inverse=True)
        self.place_sign = torch.gather(sign, 0, image[None])[0]
        self.source, self.sign = source[:, chosen].flatten(), sign[:, chosen]

    def __call__(self, values: torch.Tensor) -> torch.Tensor:
        """The average, in the shape and on the device of the values."""
        if self.source.device != values.device:  # a policy moves to its device once it is built
            self.source, self.sign = self.source.to(values.device), self.sign.to(values.device)
            self.place = self.place.to(values.device)
            self.place_sign = self.place_sign.to(values.device)
        images = values.flatten().index_select(0, self.source).view_as(self.sign)
        average = (images * self.sign).mean(dim=0)
        return (average.index_select(0, self.place) * self.place_sign).view_as(values)


class Mirrored:
    """Makes the networks of a PPO policy with symlog features equivariant under reflections.

    Args:
        *args: As for the policy.
        mirrors: For each mirror what changes, by the keys `observation`, `goal` and `actions`, see
            `reflection`. A missing key stands for nothing.
        **kwargs: As for the policy.

    Raises:
        UsageError: There is no such component, the image of a feature is no feature, the order of
            two mirrors matters, or a hidden layer cannot be divided into groups.
    """

    def __init__(
        self, *args: Any, mirrors: Sequence[Mapping[str, Sequence[Entry]]] = (), **kwargs: Any
    ):
        self.mirrors = mirrors
        super().__init__(*args, **kwargs)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "mirrors": self.mirrors}  # type: ignore[misc]

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)  # type: ignore[misc]
        if self.mirrors:
            _tie(self, self.mirrors)  # type: ignore[arg-type]


def _tie(policy: ActorCriticPolicy, mirrors: Sequence[Mapping[str, Sequence[Entry]]]) -> None:
    """Averages the policy's weights, and from now on their gradients, over all mirror images."""
    extractor, actions = policy.features_extractor, spaces.flatdim(policy.action_space)
    assert isinstance(extractor, SymlogOffsets)
    features, acts = [], []
    for mirror in mirrors:
        seen, goal = (
            reflection(mirror.get(key, ()), extractor.sizes[vector], vector)
            for key, vector in (("observation", "observation"), ("goal", "desired_goal"))
        )
        features.append(extractor.images(seen, goal))
        acts.append(reflection(mirror.get("actions", ()), actions, "action"))
    observed, acted = combinations(features), combinations(acts)
    swapped = acted._replace(sign=torch.ones_like(acted.sign))  # a deviation has no sign
    networks: list[tuple[Any, list[tuple[Any, Images]]]] = [
        (policy.mlp_extractor.policy_net, [(policy.action_net, acted)]),
        (policy.mlp_extractor.value_net, [(policy.value_net, unchanged(1))]),
    ]
    if getattr(policy, "state_dependent_std", False):
        networks[0][1].append((policy.std_net, swapped))
    policy.log_std.register_hook(Average(swapped))
    for hidden, heads in networks:
        read = observed
        for layer in hidden:
            if isinstance(layer, torch.nn.Linear):
                units = unit_images(len(mirrors), layer.out_features)
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
