"""The folder of a run's programs: its files, and their description."""

from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from a2g_jax.config import from_json
from a2g_jax.data.body_json import body_from_json, body_to_json
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.io.files import sha256_file
from a2g_jax.io.sealed import read_sealed, write_sealed

MANIFEST, WEIGHTS = "manifest.json", "weights.safetensors"
#: Programs: the state before the first frame, which only autoregressive models have, and the motion of a window.
BEGIN, WINDOW = "begin.stablehlo", "window.stablehlo"
FORMAT, VERSION = "a2g_jax programs", 1
#: Prefixes of names: states among inputs and outputs, and weights for the work after the programs.
STATE, DYNAMICS, STATISTICS = "state/", "dynamics/", "statistics/"


def check_flatbuffers() -> None:
    """Refuse to work without the package that the files of programs need.

    Raises:
        InputError: it is not installed.
    """
    if find_spec("flatbuffers") is None:
        raise InputError("StableHLO programs need flatbuffers; install it with: pip install 'a2g_jax[stablehlo]'.")


class Port(NamedTuple):
    """An input or output of a program."""

    shape: tuple[int, ...]
    dtype: str
    meaning: str = ""


Ports = dict[str, Port]


@dataclass(frozen=True, eq=False)
class Manifest:
    """Everything about a run's programs but the programs and the weights."""

    model: str
    run: dict[str, Any]
    """Preset and steps of the run."""
    fps: float
    mel: MelConfig
    space: PoseSpace
    window: int
    """Frames of a call."""
    halo: int
    """Frames of context before and after them that the inputs of a window have as well."""
    lanes: int
    """Samples of a call."""
    programs: dict[str, dict[str, Ports]]
    """``inputs`` and ``outputs`` of each program, by the name of its file."""
    files: dict[str, str]
    """SHA-256 of each file."""

    def write(self, folder: Path) -> None:
        """Write the manifest; it is the last file of the folder."""
        programs = {
            name: {side: {port: value._asdict() for port, value in ports.items()} for side, ports in sides.items()}
            for name, sides in self.programs.items()
        }
        own = {name: getattr(self, name) for name in ("model", "run", "fps", "window", "halo", "lanes", "files")}
        about = {"format": FORMAT, "version": VERSION, **own, "mel": asdict(self.mel), "pose": self.space.kind}
        write_sealed(folder / MANIFEST, {**about, **body_to_json(self.space.body), "programs": programs})

    @classmethod
    def read(cls, folder: Path) -> "Manifest":
        """Read the manifest of a folder.

        Raises:
            InputError: there is none, or it is damaged or of a later version.
        """
        path = folder / MANIFEST
        if not path.is_file():
            raise InputError(f"{folder}: holds no programs ({MANIFEST} is missing); make them with 'a2g export'.")
        values = read_sealed(path)
        if not isinstance(values, dict) or values.get("format") != FORMAT:
            raise InputError(f"{path}: is not the manifest of programs; make them with 'a2g export'.")
        if values.get("version") != VERSION:
            raise InputError(f"{path}: has version {values.get('version')}; this package reads version {VERSION}.")
        try:
            _check_names(values["programs"], values["files"])
            return cls(
                model=str(values["model"]),
                run=dict(values["run"]),
                fps=float(values["fps"]),
                mel=from_json(MelConfig, values["mel"], str(path)),
                space=PoseSpace(body_from_json(values), str(values["pose"])),
                window=int(values["window"]),
                halo=int(values["halo"]),
                lanes=int(values["lanes"]),
                programs={
                    str(name): {side: _ports(ports) for side, ports in sides.items()}
                    for name, sides in values["programs"].items()
                },
                files={str(name): str(digest) for name, digest in values["files"].items()},
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f"{path}: is damaged ({type(error).__name__}: {error}); export the run again.") from None

    def check_files(self, folder: Path) -> None:
        """Compare the hashes of all files.

        Raises:
            InputError: a file is missing or differs from the one that was written.
        """
        for name, digest in self.files.items():
            path = folder / Path(name).name
            if not path.is_file():
                raise InputError(f"{path}: is missing; export the run again.")
            if sha256_file(path) != digest:
                raise InputError(f"{path}: differs from the file that was exported; export the run again.")


def _check_names(programs: dict[str, Any], files: dict[str, Any]) -> None:
    """Refuse other files than those of an export: names come from a file, and lead nowhere else."""
    if WINDOW not in programs or not set(programs) <= {BEGIN, WINDOW} or set(files) != {*programs, WEIGHTS}:
        raise ValueError("files")


def _ports(values: dict[str, Any]) -> Ports:
    return {
        str(name): Port(tuple(int(size) for size in port["shape"]), str(np.dtype(port["dtype"])), str(port["meaning"]))
        for name, port in values.items()
    }
