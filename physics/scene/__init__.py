"""What a user writes: scenes, shapes and fidelities, frozen and validated."""
