"""Retargeting: the motion of any humanoid rig on any other (:func:`find_rig`, :func:`match_rigs`, :func:`retarget`)."""

from a2g_jax.geometry.retarget.match import Match as Match
from a2g_jax.geometry.retarget.match import match_rigs as match_rigs
from a2g_jax.geometry.retarget.relaxed import with_relaxed_hands as with_relaxed_hands
from a2g_jax.geometry.retarget.rig import Rig as Rig
from a2g_jax.geometry.retarget.rig import find_rig as find_rig
from a2g_jax.geometry.retarget.targets import body_skeleton as body_skeleton
from a2g_jax.geometry.retarget.targets import upper_body_rig as upper_body_rig
from a2g_jax.geometry.retarget.targets import upper_body_skeleton as upper_body_skeleton
from a2g_jax.geometry.retarget.transfer import retarget as retarget
