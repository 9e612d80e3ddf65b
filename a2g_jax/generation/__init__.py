"""From speech to motion with a trained run."""
