"""Integrators: one file per method that `Fidelity.integrator` names; kick and drift are shared."""
