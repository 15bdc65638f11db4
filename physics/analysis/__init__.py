"""What can be asked of a world: energies, contacts, the largest stable step."""
