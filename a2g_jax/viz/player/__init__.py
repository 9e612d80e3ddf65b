"""The HTML page: figures side by side, in sync with their audio, in one file that needs no network."""

from a2g_jax.viz.player.figure import Bars as Bars
from a2g_jax.viz.player.figure import Curve as Curve
from a2g_jax.viz.player.figure import Figure as Figure
from a2g_jax.viz.player.figure import Hands as Hands
from a2g_jax.viz.player.figure import Lane as Lane
from a2g_jax.viz.player.figure import Mark as Mark
from a2g_jax.viz.player.figure import Track as Track
from a2g_jax.viz.player.inline import show_page as show_page
from a2g_jax.viz.player.page import write_page as write_page
from a2g_jax.viz.player.screenshot import screenshot_page as screenshot_page
