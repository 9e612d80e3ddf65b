"""Generation with a trained flow: its latent space, and the style of clips."""
