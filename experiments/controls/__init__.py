"""Response of motion to named controls: energy, height, radius, rate, handedness and emotion."""
