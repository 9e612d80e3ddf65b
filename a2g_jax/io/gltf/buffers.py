"""Arrays in the binary chunk of a GLB file: accessors and buffer views (glTF 2.0, section 3.6)."""

from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.gltf.container import Glb, fail

_SHAPES = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
_KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TYPES = {"float32": 5126, "uint32": 5125, "uint16": 5123, "uint8": 5121}


def read_matrices(glb: Glb, index: object, count: int, place: str) -> np.ndarray | None:
    """The first ``count`` matrices of an accessor, (count, 4, 4); None where they are compressed or in another file.

    Args:
        index: of the accessor.
        place: of it in the file, for messages.

    Raises:
        InputError: there is no such accessor, it is of another type, or lies outside the file.
    """
    accessor = item(glb, "accessors", index, place)
    if accessor.get("type") != "MAT4" or accessor.get("componentType") != 5126:
        fail(glb.path, place, "expected matrices of 32-bit numbers; the file is damaged: export it again.")
    length = _whole(glb, accessor.get("count"), place)
    if length < count:
        fail(glb.path, place, f"expected {count} matrices, one a joint; got {length}; export it again.")
    if why_not_plain(glb, index, place) is not None:
        return None
    view = item(glb, "bufferViews", accessor["bufferView"], place)
    begin = _whole(glb, view.get("byteOffset", 0), place) + _whole(glb, accessor.get("byteOffset", 0), place)
    step = _whole(glb, view.get("byteStride", 64) or 64, place)
    end = begin + step * (count - 1) + 64
    if step < 64 or end > len(glb.binary):
        fail(glb.path, place, "lies outside the binary data: the file is damaged; export it again.")
    rows = np.ndarray((count, 4, 4), "<f4", glb.binary, begin, (step, 16, 4)).astype(np.float64)
    if not np.all(np.isfinite(rows)):
        fail(glb.path, place, "NaN or infinity in a matrix: the file is damaged; export it again.")
    # Columns first in the file.
    return np.swapaxes(rows, -1, -2)


def why_not_plain(glb: Glb, index: object, place: str) -> str | None:
    """Why the elements of an accessor are not plain numbers in the file, with the remedy; None where they are.

    Raises:
        InputError: there is no such accessor, or it is damaged.
    """
    accessor = item(glb, "accessors", index, place)
    if "sparse" in accessor:
        return "is a sparse accessor, which is not read; export it without sparse accessors."
    if "bufferView" not in accessor:
        return "has no data in the file; export it again without compression."
    view = item(glb, "bufferViews", accessor["bufferView"], place)
    if extensions := view.get("extensions"):
        names = ", ".join(extensions) if isinstance(extensions, dict) else "an extension"
        return f"is compressed ({names}), which is not read; export it without compression."
    if view.get("buffer") != 0 or "uri" in item(glb, "buffers", 0, place):
        return "is in another file or in text, which is not read; export it as one binary file (.glb)."
    return None


def read_values(glb: Glb, index: object, shape: str, place: str) -> np.ndarray:
    """The elements of an accessor, (count,) or (count, width), normalised ones from -1 or 0 to 1.

    Args:
        shape: ``SCALAR``, ``VEC3`` or ``VEC4``.
        place: of the accessor in the file, for messages.

    Raises:
        InputError: there is no such accessor, it is of another type, lies outside the file, or is sparse, compressed or
            in another file.
    """
    accessor = item(glb, "accessors", index, place)
    component = accessor.get("componentType")
    kind = _KINDS.get(component) if isinstance(component, int) else None
    if accessor.get("type") != shape or kind is None:
        fail(glb.path, place, f"expected {shape}; the file is damaged: export it again.")
    count = _whole(glb, accessor.get("count"), place)
    if (reason := why_not_plain(glb, index, place)) is not None:
        fail(glb.path, place, reason)
    view = item(glb, "bufferViews", accessor["bufferView"], place)
    width = _WIDTHS[shape]
    size = np.dtype(kind).itemsize
    begin = _whole(glb, view.get("byteOffset", 0), place) + _whole(glb, accessor.get("byteOffset", 0), place)
    step = _whole(glb, view.get("byteStride", 0), place) or size * width
    if count and (step < size * width or begin + step * (count - 1) + size * width > len(glb.binary)):
        fail(glb.path, place, "lies outside the binary data: the file is damaged; export it again.")
    rows = np.ndarray((count, width), kind, glb.binary, begin, (step, size)) if count else np.zeros((0, width))
    largest = {"<u1": 255, "<i1": 127, "<u2": 65535, "<i2": 32767}.get(kind)
    values = rows.astype(np.float64)
    if accessor.get("normalized") is True and largest:
        values = np.maximum(values / largest, -1.0)
    return values[:, 0] if shape == "SCALAR" else values


def element_count(glb: Glb, index: object, place: str) -> int:
    """How many elements an accessor has, which are not read.

    Raises:
        InputError: there is no such accessor, or it is damaged.
    """
    return _whole(glb, item(glb, "accessors", index, place).get("count"), place)


def item(glb: Glb, key: str, index: object, place: str) -> dict[str, Any]:
    """An object of a list of the file.

    Raises:
        InputError: there is no object of that number.
    """
    rows = glb.document.get(key, [])
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(rows):
        fail(glb.path, place, f"refers to {key}[{index!r:.20}], which does not exist; export it again.")
    return rows[index]


def _whole(glb: Glb, value: object, place: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 40:
        fail(glb.path, place, f"expected a whole number; got {value!r:.20}; export it again.")
    return value


class Buffer:
    """The binary chunk with arrays added at its end."""

    def __init__(self, glb: Glb | None = None) -> None:
        """
        Args:
            glb: the file to add to, which is not changed; None for a new one.

        Raises:
            InputError: the file's own data are in other files.
        """
        self.document: dict[str, Any] = {} if glb is None else dict(glb.document)
        self._parts = [] if glb is None else [glb.binary]
        self._size = 0 if glb is None else len(glb.binary)
        for key in ("buffers", "bufferViews", "accessors"):
            self.document[key] = list(self.document.get(key, []))
        buffers = self.document["buffers"]
        if buffers and "uri" in buffers[0]:
            name = glb.path if glb is not None else "buffers[0]"
            raise InputError(f"{name}: its data are in another file or in text; export it as one binary file (.glb).")
        if not buffers:
            buffers.append({"byteLength": 0})
        buffers[0] = dict(buffers[0])

    def add(self, array: np.ndarray, *, bounds: bool = False, target: int | None = None) -> int:
        """Add an array, one element a row; returns the index of its accessor.

        Args:
            bounds: whether to give the least and the largest value, which times and positions need.
            target: use of the data by a renderer: 34962 for vertices, 34963 for triangles.
        """
        padding = -self._size % 4
        content = np.ascontiguousarray(array)
        body = content.tobytes()
        self._parts += [b"\0" * padding, body]
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self._size + padding, "byteLength": len(body)}
        if target is not None:
            view["target"] = target
        self._size += padding + len(body)
        self.document["bufferViews"].append(view)
        # Columns first in the file.
        accessor: dict[str, Any] = {
            "bufferView": len(self.document["bufferViews"]) - 1,
            "componentType": _TYPES[content.dtype.name],
            "count": len(content),
            "type": _SHAPES[content.shape[1:]],
        }
        if bounds:
            accessor["min"] = np.atleast_1d(content.min(axis=0)).tolist()
            accessor["max"] = np.atleast_1d(content.max(axis=0)).tolist()
        self.document["accessors"].append(accessor)
        return len(self.document["accessors"]) - 1

    def finished(self) -> tuple[dict[str, Any], bytes]:
        """The JSON and the binary chunk."""
        self.document["buffers"][0]["byteLength"] = self._size
        return self.document, b"".join(self._parts)
