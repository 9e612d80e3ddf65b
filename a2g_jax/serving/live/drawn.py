"""Frames of a stream as a client gets them: of a character, or as points of a body that a page draws."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from a2g_jax.generation.delivery import Delivery
from a2g_jax.generation.live.stream import Stream
from a2g_jax.geometry.motion import Motion
from a2g_jax.serving.live.protocol import with_header
from a2g_jax.viz.player.page import drawn_body, drawn_mesh
from a2g_jax.viz.player.shape import build_shape
from a2g_jax.viz.player.skin import bind
from a2g_jax.viz.player.stage import shape_points

#: Least share of its height that arms of a figure reach to either side.
_REACH = 0.42


class Drawn:
    """The frames of one client.

    A character is moved frame by frame: every frame has the rotations and the root that it has in the file of a whole
    motion.
    """

    def __init__(self, stream: Stream, delivery: Delivery) -> None:
        config, self._delivery = stream.run.config, delivery
        mean = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean), np.float32)
        height = float(np.asarray(config.statistics["root"].mean)[1])
        root = np.array([[0.0, height, 0.0]], np.float32)
        still = delivery.make(Motion(mean[None], root, config.skeleton, config.fps))
        #: A motion of one frame, of the skeleton that frames are for.
        self.own = still.shown if still.own is None else still.own
        self.metres = 1.0 if delivery.character is None else float(delivery.character.metres)
        self._still = still.shown
        skin = delivery.skin(still.shown.skeleton)
        self._bound = None if skin is None else bind(skin)
        self._body, _ = drawn_body(self._still)
        self._shape = build_shape(self._still.skeleton)
        if self._bound is not None:
            self._body, self._shape = drawn_mesh(self._body, self._bound)

    def encoded(self, encode: Callable[[Motion, int], Any]) -> Callable[[Motion, int], Any]:
        """A function that encodes frames of the stream as those of the client's skeleton."""

        def of(motion: Motion, first: int) -> Any:
            made = self._delivery.make(motion)
            return encode(made.shown if made.own is None else made.own, first)

        return of

    def points(self, motion: Motion, first: int) -> bytes:
        """Places of all points of the body, metres, as a binary message."""
        shown = self._delivery.make(motion).shown
        shown = replace(shown, skeleton=self._still.skeleton)
        return with_header(shape_points(shown, self._shape).reshape(shown.frames, -1), first)

    def figure(self) -> dict[str, Any]:
        """What a page needs to draw the body, and its points at rest."""
        points = shape_points(self._still, self._shape)
        place = dict(self._body["place"])
        place["reach"] = max(place["reach"], round(_REACH * place["height"], 4))
        return {**self._body, "place": place, "label": "", "note": "", "rest": points[0].round(5).reshape(-1).tolist()}

    def mesh(self) -> dict[str, Any] | None:
        """The mesh of the character, whose bones are the axes of the figure; None without one."""
        return None if self._bound is None else self._bound.encoded()
