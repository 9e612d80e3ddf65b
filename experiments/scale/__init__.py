"""What the papers' trainings cost, on this machine and on others."""
