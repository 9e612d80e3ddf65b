"""Servers on this computer: an application, its security, and the process that runs it."""
