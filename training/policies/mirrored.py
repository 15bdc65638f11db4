"""Networks that are equivariant under reflections: mirrored states get mirrored actions.

A task that looks the same in a mirror does not have to be learned on both sides of it. In each
mirror some components of observation and action change their sign or place. The network is
equivariant: where it answers the observation s with the mean action a, it answers the mirror image
of s with that of a, and both states have the same value.

Hidden units come in groups of 2^m, one for each combination of m reflections; a reflection swaps
units within their groups. A layer with weights W is equivariant if W = P W Q for each combination,
where Q mirrors what the layer reads and P what it writes. The average of P W Q over all
combinations has this property. So the initial weights are averaged, and so is each gradient: the
optimiser keeps the property, and layers and files are those of an ordinary network. An averaged
gradient is that of the loss on the batch and all its mirror images (van der Pol et al., MDP
homomorphic networks, 2020).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule

from training.policies.features.reflections import (
    Entry,
    Images,
    all_combinations,
    reflection,
    unchanged,
    unit_images,
)
from training.policies.features.symlog_features import SymlogOffsets
from training.settings.errors import UsageError


class Average:
    """Averages the weights [out, in] or biases [out] of a layer over all mirror images.

    The combinations of reflections form a group. So all images of a weight have the same average,
    up to the sign, and it is computed once for each of g sets of weights:
    average[g] = mean over c of sign[c, g] weight[source[c, g]].

    Args:
        written: Images [k, out] of what the layer writes.
        read: Images [k, in] of what it reads; None for biases.

    Attributes:
        source: [k g] indices of weights, flattened.
        sign: [k, g] ±1.
        place: [out in] the set to which each weight belongs.
        place_sign: [out in] ±1, its sign with respect to the average of the set.
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
        UsageError: A key or a component is unknown, the image of a feature is no feature, the order
            of two mirrors matters, there is no hidden layer, or one cannot be divided into groups;
            or components of the action that change places have different `log_std_init`.

    Gradients are averaged by hooks, which torch does not copy: save and load a policy instead of
    copying or pickling it.
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
        unknown = sorted(set(mirror) - {"observation", "goal", "actions"})
        if unknown:
            raise UsageError(
                f"mirrors: key {unknown[0]!r}, should be 'observation', 'goal' or 'actions'"
            )
        acts.append(reflection(mirror.get("actions", ()), actions, "action"))
        seen, goal = (
            reflection(mirror.get(key, ()), extractor.sizes[vector], vector)
            for key, vector in (("observation", "observation"), ("goal", "desired_goal"))
        )
        features.append(extractor.images(seen, goal))
    observed = all_combinations(features, "observation")
    acted = all_combinations(acts, "action")
    swapped = acted._replace(sign=torch.ones_like(acted.sign))  # a deviation has no sign
    networks: list[tuple[Any, list[tuple[Any, Images]]]] = [
        (policy.mlp_extractor.policy_net, [(policy.action_net, acted)]),
        (policy.mlp_extractor.value_net, [(policy.value_net, unchanged(1))]),
    ]
    if getattr(policy, "state_dependent_std", False):
        networks[0][1].append((policy.std_net, swapped))
    deviation = Average(swapped)
    first = policy.log_std.detach()
    if not torch.equal(deviation(first), first):
        raise UsageError(
            f"log_std_init is {first.tolist()}, should be the same for components of the action "
            "that change places in a mirror"
        )
    policy.log_std.register_hook(deviation)
    for hidden, heads in networks:
        if not any(isinstance(layer, torch.nn.Linear) for layer in hidden):
            raise UsageError("net_arch has no hidden layer, mirrors requires one or more")
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
