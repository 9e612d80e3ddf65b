"""What the generated corpus is like: one module for each table or figure. See README.md."""
