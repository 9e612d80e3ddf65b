"""Measurements of the generated corpus: one module for each table or figure. See README.md."""
