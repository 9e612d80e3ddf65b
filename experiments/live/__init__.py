"""Live generation measured."""
