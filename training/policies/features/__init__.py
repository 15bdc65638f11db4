"""What networks compute from observations before their first layer of weights."""
