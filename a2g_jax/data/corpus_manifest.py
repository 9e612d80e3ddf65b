"""The manifest of a corpus: read, and checked before anything else of the corpus is."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from a2g_jax.data.body_json import body_from_json
from a2g_jax.data.corpus_layout import FORMAT, MANIFEST, SHARD, VERSION, VERSION_ON_DEMAND, Entry
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError, brief
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.pose_space import WIDTHS, PoseSpace
from a2g_jax.io.sealed import read_sealed

#: Entries of manifests that have a checksum.
SEALED_WITH = ("annotations",)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Fields of :class:`a2g_jax.data.corpus.Corpus` by name, apart from ``path``, with checked types and bounds.

    Raises:
        InputError: not a corpus, a damaged manifest, or one of a later version.
    """
    where = folder / MANIFEST
    if (folder / SHARD).is_file():
        raise InputError(f"{folder}: is one shard of a corpus; merge all of them with 'a2g prepare --merge'.")
    if not where.is_file():
        raise InputError(f"{folder}: is not a corpus (no {MANIFEST} in it); make one with 'a2g prepare'.")
    manifest = read_sealed(where, SEALED_WITH)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputError(f"{where}: is not the manifest of a corpus; make one with 'a2g prepare'.")
    if manifest.get("version") not in (VERSION, VERSION_ON_DEMAND):
        raise InputError(
            f"{where}: has version {brief(manifest.get('version'))}; expected {VERSION} or {VERSION_ON_DEMAND};"
            " prepare it anew."
        )
    kind = str(manifest.get("pose", "6d"))
    if kind not in WIDTHS:
        raise InputError(
            f"{where}: has poses of the unknown kind {brief(repr(kind))}; the kinds are {', '.join(WIDTHS)}."
        )
    try:
        fields = _fields(manifest, kind)
        _check_types(fields)
        if fields["hashes"] and fingerprint_of(fields["hashes"]) != fields["fingerprint"]:
            raise ValueError("fingerprint and hashes disagree")
        if len(fields["annotation_hashes"]) not in (0, len(fields["recordings"])):
            raise ValueError(f"{len(fields['annotation_hashes'])} hashes of annotations")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{where}: is damaged ({brief(repr(error), 160)}); prepare the corpus anew.") from None
    _check_bounds(fields, where)
    return fields


def fingerprint_of(hashes: Mapping[str, str]) -> str:
    """The fingerprint of a corpus from the hashes of its files."""
    return hashlib.sha256("".join(hashes.values()).encode()).hexdigest()


def _fields(manifest: dict[str, Any], kind: str) -> dict[str, Any]:
    return {
        "fps": float(manifest["fps"]),
        "mel": MelConfig(**manifest["mel"]),
        "space": PoseSpace(body_from_json(manifest), kind),
        "recordings": tuple(Entry(**entry) for entry in manifest["recordings"]),
        "splits": {name: [Segment(*row) for row in rows] for name, rows in manifest["splits"].items()},
        "recipe": manifest["recipe"],
        "fingerprint": manifest["fingerprint"],
        "on_demand": manifest["version"] == VERSION_ON_DEMAND,
        "hashes": manifest.get("arrays", {}),
        "annotation_hashes": tuple(manifest.get("annotations", ())),
    }


def _check_types(fields: dict[str, Any]) -> None:
    """Check the types of values that other programs may have written.

    Raises:
        TypeError: another type.
    """
    for entry in fields["recordings"]:
        texts = (entry.name, entry.speaker, entry.emotion, entry.split)
        numbers = (entry.first, entry.frames, entry.first_sample, entry.samples)
        if not (all(isinstance(one, str) for one in texts) and isinstance(entry.sources, dict)):
            raise TypeError(f"recording {brief(entry.name)}")
        if any(type(one) is not int or one < 0 for one in numbers):
            raise TypeError(f"frames or samples of recording {brief(entry.name)}")
    if any(type(one) is not int for rows in fields["splits"].values() for row in rows for one in row):
        raise TypeError("a split")
    digests = (*fields["hashes"].values(), *fields["annotation_hashes"], fields["fingerprint"])
    if not (isinstance(fields["recipe"], dict) and all(isinstance(one, str) for one in digests)):
        raise TypeError("recipe or hashes")


def _check_bounds(fields: dict[str, Any], where: Path) -> None:
    fps, recordings = fields["fps"], fields["recordings"]
    if not 0 < fps < 10_000:
        raise InputError(f"{where}: is damaged (fps is {fps}); prepare the corpus anew.")
    for entry in recordings:
        if not (isinstance(entry.waveform_gain, int | float) and 0 < entry.waveform_gain < 2**200):
            raise InputError(f"{where}: is damaged (waveform_gain is {entry.waveform_gain}); prepare it anew.")
    for name, segments in fields["splits"].items():
        for index, start, stop in segments:
            if not (0 <= index < len(recordings) and 0 <= start < stop <= recordings[index].frames):
                raise InputError(f"{where}: is damaged ({name} holds {[index, start, stop]}); prepare it anew.")
