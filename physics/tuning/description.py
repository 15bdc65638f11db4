"""Fidelities as Python text."""

from dataclasses import fields

from physics.scene.fidelity import PRESETS, Fidelity


def code(fidelity: Fidelity) -> str:
    """The call that builds a fidelity, without its defaults; a preset's name if it is one."""
    for name, preset in PRESETS.items():
        if preset == fidelity:
            return repr(name)
    changed = [
        f"{field.name}={getattr(fidelity, field.name)!r}"
        for field in fields(fidelity)
        if getattr(fidelity, field.name) != field.default
    ]
    return f"Fidelity({', '.join(changed)})"
