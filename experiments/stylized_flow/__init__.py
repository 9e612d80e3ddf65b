"""The tables and figures of the stylized flow (ECCV 2022)."""
