"""A decoder of GLB files, which shares no code with the package."""

import json
import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

_TYPES = {5126: np.dtype("<f4"), 5125: np.dtype("<u4"), 5123: np.dtype("<u2"), 5121: np.dtype("u1")}
_SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Decoded:
    """A file, its accessors and the places of its nodes over time."""

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size, kind = struct.unpack_from("<I4s", content, 12)
        assert kind == b"JSON"
        self.document = json.loads(content[20 : 20 + size])
        self.binary = b""
        if 20 + size < len(content):
            length, kind = struct.unpack_from("<I4s", content, 20 + size)
            assert kind == b"BIN\0"
            self.binary = content[28 + size : 28 + size + length]
        self.nodes = self.document["nodes"]
        self.names = [node.get("name", "") for node in self.nodes]

    def accessor(self, index: int) -> np.ndarray:
        one = self.document["accessors"][index]
        view = self.document["bufferViews"][one["bufferView"]]
        start = view.get("byteOffset", 0) + one.get("byteOffset", 0)
        dtype, width = _TYPES[one["componentType"]], _SIZES[one["type"]]
        assert start % dtype.itemsize == 0
        values = np.frombuffer(self.binary, dtype, one["count"] * width, start).reshape(one["count"], width)
        for key, bound in (("min", values.min(axis=0)), ("max", values.max(axis=0))):
            if key in one:
                np.testing.assert_array_equal(np.asarray(one[key], np.float32), bound.astype(np.float32))
        return values

    def tracks(self, animation: int = 0) -> dict[tuple[int, str], tuple[np.ndarray, np.ndarray]]:
        """Times and values by node and path."""
        one = self.document["animations"][animation]
        found = {}
        for channel in one["channels"]:
            sampler = one["samplers"][channel["sampler"]]
            assert sampler.get("interpolation", "LINEAR") == "LINEAR"
            key = channel["target"]["node"], channel["target"]["path"]
            assert key not in found
            assert "matrix" not in self.nodes[key[0]]
            found[key] = self.accessor(sampler["input"])[:, 0], self.accessor(sampler["output"])
        return found

    def world(self, time: float, tracks=None) -> np.ndarray:
        """Matrices of all nodes in the world; without tracks as the nodes are."""
        local = np.tile(np.eye(4), (len(self.nodes), 1, 1))
        for index, node in enumerate(self.nodes):
            if "matrix" in node:
                local[index] = np.reshape(node["matrix"], (4, 4)).T
                continue
            values = {"translation": node.get("translation", (0, 0, 0)), "rotation": node.get("rotation", (0, 0, 0, 1))}
            for path in values:
                if tracks and (index, path) in tracks:
                    times, keys = tracks[index, path]
                    at = np.clip(np.interp(time, times, np.arange(len(times))), 0, len(times) - 1)
                    low, high = int(np.floor(at)), int(np.ceil(at))
                    values[path] = keys[low] + (keys[high] - keys[low]) * (at - low)
            local[index, :3, :3] = Rotation.from_quat(values["rotation"]).as_matrix() * np.asarray(
                node.get("scale", (1, 1, 1))
            )
            local[index, :3, 3] = values["translation"]
        world, parents = local.copy(), {}
        for index, node in enumerate(self.nodes):
            parents.update(dict.fromkeys(node.get("children", []), index))
        done: set[int] = set()

        def place(index: int) -> np.ndarray:
            if index not in done:
                if index in parents:
                    world[index] = place(parents[index]) @ local[index]
                done.add(index)
            return world[index]

        for index in range(len(self.nodes)):
            place(index)
        return world

    def places(self, time: float, tracks=None) -> dict[str, np.ndarray]:
        """Positions of the nodes by name."""
        return {name: row[:3, 3] for name, row in zip(self.names, self.world(time, tracks), strict=True)}


def joint_places(path: Path, names: tuple[str, ...], frames: int, fps: float) -> np.ndarray:
    """Positions (T, J, 3) of nodes by name over the first animation of a file."""
    decoded = Decoded(path)
    tracks = decoded.tracks()
    rows = [decoded.places(frame / fps, tracks) for frame in range(frames)]
    return np.array([[row[name] for name in names] for row in rows])
