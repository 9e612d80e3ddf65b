"""How generated motions become files: for which character, at which frame rate, in which unit."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.geometry.retarget import Match, find_rig, match_rigs, retarget, with_relaxed_hands
from a2g_jax.geometry.retarget.upright import facing, upright_motion
from a2g_jax.geometry.skeleton import Skeleton

if TYPE_CHECKING:
    from a2g_jax.io.character import Character
    from a2g_jax.viz.player.skin import Skin


@dataclass(frozen=True, eq=False)
class Made:
    """A motion as it is written."""

    shown: Motion
    """For the page and for formats of no character: y up, metres."""
    own: Motion | None = None
    """Of the character's skeleton, in its own axes and unit."""

    def by_format(self, name: str | None) -> dict[str, Motion]:
        """The character's motion by its format; empty without one."""
        return {} if self.own is None or name is None else {name: self.own}


@dataclass(frozen=True, eq=False)
class Delivery:
    """What is done to generated motions before they are written; by default nothing."""

    character: "Character | None" = None
    """The rig to write for; None for the run's skeleton."""
    fps: float | int | None = None
    """Frames per second; None for the run's."""
    fingers: bool = True
    """Whether fingers of the character that nothing moves are relaxed; else they stay as in its rest pose."""
    scale: float = 100.0
    """Units of BVH files in a metre, without a character."""
    direction: str = "+z"
    """Where a figure without a character faces."""

    def match(self, skeleton: Skeleton) -> Match | None:
        """How the joints of a run's skeleton move the character; None without one.

        Raises:
            InputError: the two have no arm in common.
        """
        if self.character is None:
            return None
        matched = match_rigs(find_rig(skeleton, name="the run"), self.character.rig)
        return with_relaxed_hands(matched) if self.fingers else matched

    def make(self, motion: Motion) -> Made:
        """A generated motion as it is written."""
        if self.fps is not None:
            motion = resample(motion, float(self.fps))
        if self.character is None:
            return Made(facing(motion, self.direction))
        own = retarget(motion, self._matched(motion.skeleton))
        return Made(upright_motion(own, self.character.rig, self.character.metres), own)

    def skin(self, skeleton: Skeleton) -> "Skin | None":
        """The character's mesh for pages, on the skeleton of motions that are shown; None without a character or a mesh
        that can be read, which :meth:`lines` then says."""
        if self.character is None:
            return None
        if "skin" not in self._kept:
            from a2g_jax.viz.player.skin import make_skin

            self._kept["skin"] = None
            try:
                self._kept["skin"] = make_skin(skeleton, self.character.surfaces())
            except InputError as error:
                path = str(self.character.path)
                reason = str(error) if str(error).startswith(path) else f"{path}: {error}"
                self._kept["unread"] = [f"{reason.rstrip('.')}; the page shows our figure in its place"]
        found: Skin | None = self._kept["skin"]
        return found

    def page_points(self, skeleton: Skeleton) -> int:
        """Most points of a figure that a page has in every frame, for motions of a run's skeleton: the joints, or three
        of each joint of a mesh that the run moves.

        Raises:
            InputError: as :meth:`match`.
        """
        if self.character is None:
            return skeleton.joints
        joints = self.character.rig.skeleton.joints
        if self.character.suffix == ".bvh":
            return joints
        matched = self._matched(skeleton)
        moved = {0, *(pair.target for pair in matched.pairs), *(share.target for share in matched.shares)}
        return max(joints, 3 * len(moved))

    def _matched(self, skeleton: Skeleton) -> Match:
        # All motions of a run have the same skeleton; its rig is found once.
        if "match" not in self._kept or not self._kept["match"].source.skeleton.same_tree(skeleton):
            self._kept["match"] = self.match(skeleton)
        return self._kept["match"]

    def written(self, path: Path, motion: Motion) -> None:
        """Write a motion of the character's skeleton."""
        if self.character is not None:
            missed: dict[str, float] = self._kept.setdefault("missed", {})
            for joint, degrees in self.character.write(path, motion).items():
                missed[joint] = max(degrees, missed.get(joint, 0.0))

    def lines(self) -> list[str]:
        """What was approximated in the files and on the page, a line each."""
        missed: dict[str, float] = self._kept.get("missed", {})
        unread: list[str] = self._kept.get("unread", [])
        return unread + [
            f"{joint} has too few rotation channels in the character's file: off by up to {degrees:.1f} degrees"
            for joint, degrees in missed.items()
        ]

    @cached_property
    def _kept(self) -> dict[str, Any]:
        return {}

    @property
    def own_format(self) -> str | None:
        """The name of the character's format; None without a character."""
        return None if self.character is None else self.character.suffix.removeprefix(".")

    def writers(self) -> dict[str, Callable[[Path, Motion], Any]]:
        """Writers by format that take the place of the usual ones."""
        if self.character is not None:
            return {self.character.suffix.removeprefix("."): self.written}
        if self.scale != 100.0:
            from a2g_jax.io.bvh import write_bvh

            return {"bvh": lambda path, motion: write_bvh(path, motion, scale=self.scale)}
        return {}


#: Files as the run generates them.
PLAIN = Delivery()
