"""Arms of robots: a chain of hinges, where its hand is, and how it moves under torques."""
