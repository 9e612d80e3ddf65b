"""Skinned meshes of GLB files, drawn from the file alone: nodes, skin and animation by a decoder of their own."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from experiments.characters.decoded import Decoded

#: Pixels of a figure, at twice the size for smooth edges, and pixels of a metre.
_WIDTH, _HEIGHT, _METRE = 480, 800, 400
_LIGHT = np.array([0.35, 0.6, 0.72])


def skinned_triangles(path: Path, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (F, 3, 3) of a file's mesh at a moment, and the colour of each."""
    decoded = Decoded(path)
    skin = decoded.document["skins"][0]
    inverse = np.swapaxes(decoded.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4), -1, -2)
    world = decoded.world(time, decoded.tracks())[skin["joints"]] @ inverse
    triangles, colours = [], []
    for primitive in decoded.document["meshes"][0]["primitives"]:
        found = {name: decoded.accessor(index) for name, index in primitive["attributes"].items()}
        points = np.c_[found["POSITION"], np.ones(len(found["POSITION"]))]
        matrices = np.einsum("vj,vjab->vab", found["WEIGHTS_0"], world[found["JOINTS_0"].astype(int)])
        moved = np.einsum("vab,vb->va", matrices, points)[:, :3]
        faces = decoded.accessor(primitive["indices"]).reshape(-1, 3).astype(int)
        triangles.append(moved[faces])
        material = decoded.document["materials"][primitive["material"]]
        colour = material["pbrMetallicRoughness"]["baseColorFactor"][:3]
        colours.append(np.tile(colour, (len(faces), 1)))
    return np.concatenate(triangles), np.concatenate(colours)


def draw(path: Path, time: float, turned: bool = False) -> Image.Image:
    """A picture of a file's mesh at a moment, from the front.

    Args:
        turned: whether the figure faces -z.
    """
    triangles, colours = skinned_triangles(path, time)
    if turned:
        triangles = triangles * (-1.0, 1.0, -1.0)
    yaw = np.radians(-20.0)
    view = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    triangles = triangles @ view.T
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shade = 0.45 + 0.55 * np.clip(normals @ _LIGHT, 0, 1)
    shown = np.round(255 * np.clip(colours * shade[:, None], 0, 1) ** (1 / 2.2)).astype(int)
    image = Image.new("RGB", (_WIDTH, _HEIGHT), (226, 231, 240))
    pen = ImageDraw.Draw(image)
    flat = np.stack([_WIDTH / 2 + _METRE * triangles[..., 0], _HEIGHT - 40 - _METRE * triangles[..., 1]], axis=-1)
    for face in np.argsort(triangles[..., 2].mean(axis=1)):
        if normals[face, 2] > 0:
            pen.polygon([tuple(corner) for corner in flat[face]], fill=tuple(shown[face]))
    return image.resize((_WIDTH // 2, _HEIGHT // 2), Image.Resampling.LANCZOS)


def draw_row(paths: list[tuple[Path, bool]], time: float) -> Image.Image:
    """Pictures of several files side by side."""
    images = [draw(path, time, turned) for path, turned in paths]
    whole = Image.new("RGB", (sum(image.width for image in images), images[0].height))
    for at, image in enumerate(images):
        whole.paste(image, (at * image.width, 0))
    return whole
