"""Time control: how a substep is divided where solids are fast, see `Fidelity.time_control`."""

from physics.compiler.jit import stage
from physics.model.features import FIXED, HALVED, Features, cached_by_features
from physics.model.state import NEW_FORCES
from physics.step.event_steps import clear_given, make_event_substep
from physics.step.short_steps import make_short_substep
from physics.step.substep import make_forces, make_substep


@cached_by_features
def make_controlled_substep(features: Features):
    """Sequence of one substep: that of `make_substep` for fixed steps."""
    if features.time_control == FIXED:
        return make_substep(features)
    if features.time_control == HALVED:
        return make_short_substep(features, make_substep)
    return make_event_substep(features, make_forces)


@cached_by_features
def make_end_call(features: Features):
    """Stage that ends a call of `advance` in lane i; returns the new `STATUS.needs_refresh`."""
    adaptive, timed = features.time_control == HALVED, features.finds_impacts

    @stage
    def end_call(model, workspace, i):
        if timed:
            clear_given(model, workspace, i)
        if adaptive and workspace.clock[0].stale[i]:
            workspace.clock[0].stale[i] = 0
            return NEW_FORCES  # they are those of a step of another length
        return 0

    return end_call
