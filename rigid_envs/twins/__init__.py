"""Twins of the Fetch and Panda environments: a policy trained in one acts in the other."""

from rigid_envs.twins.fetch.pick_and_place import FetchPickAndPlace
from rigid_envs.twins.fetch.push import FetchPush
from rigid_envs.twins.fetch.reach import FetchReach
from rigid_envs.twins.fetch.slide import FetchSlide
from rigid_envs.twins.panda.pick_and_place import PandaPickAndPlace
from rigid_envs.twins.panda.push import PandaPush
from rigid_envs.twins.panda.reach import PandaReach
from rigid_envs.twins.panda.slide import PandaSlide
from rigid_envs.twins.panda.stack import PandaStack
from rigid_envs.twins.twin import Twin

TWINS: dict[str, type[Twin]] = {
    "fetch_pick_and_place": FetchPickAndPlace,
    "fetch_push": FetchPush,
    "fetch_reach": FetchReach,
    "fetch_slide": FetchSlide,
    "panda_pick_and_place": PandaPickAndPlace,
    "panda_push": PandaPush,
    "panda_reach": PandaReach,
    "panda_slide": PandaSlide,
    "panda_stack": PandaStack,
}

__all__ = [
    "TWINS",
    "FetchPickAndPlace",
    "FetchPush",
    "FetchReach",
    "FetchSlide",
    "PandaPickAndPlace",
    "PandaPush",
    "PandaReach",
    "PandaSlide",
    "PandaStack",
    "Twin",
]
