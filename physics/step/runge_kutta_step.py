"""A Runge-Kutta step, stage by stage: trial states, and the forces there."""

from physics.compiler.jit import LANES, sequence
from physics.integrators.runge_kutta import make_save_rates, make_set_trial, make_start, tableau_of
from physics.model.features import Features, cached_by_features
from physics.model.lanes import end_refresh
from physics.motion.kinematics import make_kinematics
from physics.step.substep import make_forces


@cached_by_features
def make_trials(features: Features):
    """Sequence of one step by the lengths in `workspace.pace`, from the start that is saved there.

    It ends with the state and the forces at the end of the step.
    """
    stages = tableau_of(features).stages
    set_trial, save_rates = make_set_trial(features), make_save_rates(features)
    kinematics, forces = make_kinematics(features), make_forces(features)

    @sequence
    def trials(model, state, workspace, g, elapsed, refresh):
        """`refresh`: only computes the forces of states that were set from outside."""
        for s in range(1, (1 if refresh else stages) + 1):  # forces stand once: see `make_substep`
            if not refresh:
                set_trial(model, workspace, s)
            kinematics(model, workspace)
            # velocities are those of the trial state; nothing here depends on the step
            forces(model, state, workspace, g, 0.0, 0.0, 0.0, elapsed)
            if not refresh and s < stages:
                save_rates(model, workspace, s)
        if refresh:
            end_refresh(model, state, workspace)

    return trials


@cached_by_features
def make_runge_kutta_substep(features: Features):
    """Sequence of one substep of a method with equal steps; arguments as of `make_substep`."""
    save_start, _ = make_start(features)
    save_rates, trials = make_save_rates(features), make_trials(features)

    @sequence
    def substep(model, state, workspace, g, h, elapsed, starts_collision_step, refresh):
        if not refresh:
            for i in range(LANES):
                workspace.pace[0].step[i] = h
            save_start(model, workspace)
            save_rates(model, workspace, 0)
        trials(model, state, workspace, g, elapsed, refresh)

    return substep
