"""Fine-tuning on a minute of a person's motion, beside the shipped weights and training from scratch."""
