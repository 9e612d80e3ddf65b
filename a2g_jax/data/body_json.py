"""The body of a pose space as JSON values of a manifest."""

from dataclasses import asdict
from typing import Any

import numpy as np

from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.skeleton import Skeleton


def skeleton_to_json(skeleton: Skeleton) -> dict[str, Any]:
    """A skeleton as JSON values."""
    return {
        "names": list(skeleton.names),
        "parents": list(skeleton.parents),
        "offsets": np.asarray(skeleton.offsets).tolist(),
        "ends": [[joint, list(offset)] for joint, offset in skeleton.ends],
    }


def skeleton_from_json(value: dict[str, Any]) -> Skeleton:
    """Inverse of :func:`skeleton_to_json`."""
    return Skeleton(
        offsets=np.asarray(value["offsets"], np.float32).reshape(-1, 3),
        names=tuple(value["names"]),
        parents=tuple(value["parents"]),
        ends=tuple((int(joint), (float(x), float(y), float(z))) for joint, (x, y, z) in value.get("ends", [])),
    )


def body_to_json(body: Skeleton | PoseLayout) -> dict[str, Any]:
    """What the rows of a pose are, as an entry of a manifest."""
    if isinstance(body, Skeleton):
        return {"skeleton": skeleton_to_json(body)}
    return {"layout": asdict(body)}


def body_from_json(manifest: dict[str, Any]) -> Skeleton | PoseLayout:
    """Inverse of :func:`body_to_json`."""
    if "skeleton" in manifest:
        return skeleton_from_json(manifest["skeleton"])
    if "layout" not in manifest:
        raise KeyError("skeleton")
    layout = manifest["layout"]
    return PoseLayout(
        names=tuple(layout["names"]),
        bones=tuple((int(start), int(end)) for start, end in layout["bones"]),
        lengths=tuple(float(length) for length in layout["lengths"]),
    )
