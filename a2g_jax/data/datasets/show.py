"""SHOW (Yi et al. 2023, "Generating Holistic 3D Human Motion from Speech"): SMPL-X fitted to four speakers' videos.

Layout after TalkSHOW's ``dataset_preprocess.py``: ``<speaker>/<video>/<train|val|test>/<seq>/<seq>.{wav,pkl}``; as
downloaded there is no folder of the split, and in SHOW's own archives none of the sequence. 30 frames a second, up to
10 s each; keys and shapes of the pickles from SHOW's README.

How they are read:

- The 22 body joints (``global_orient`` and ``body_pose_axis``). Each hand has 12 principal components of MANO's
  basis, whose licence forbids redistribution: fingers cannot be decoded and are left out. ``betas`` are ignored.
- Poses are in the camera's frame, y down: ``global_orient`` is near half a turn about x (TalkSHOW's ``lower_body.py``
  seats its speakers with (3.0747, -0.0158, -0.0152)). The world is turned by half a turn about x so that y is up
  and the speaker looks along z; a file whose pelvis is upright already is not turned.
- The height of the floor is unknown (the camera shows upper bodies): the pelvis of the first frame is put over the
  origin, at its height in the rest skeleton.
- Legs are guesses of the fit. SHOW's README advises to fix them, as well as orientation and translation; that is
  left to the user.
- Takes with NaN raise an error; TalkSHOW drops them.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from a2g_jax.data.datasets.lookup import SPLIT_NAMES, files_with, unique_names
from a2g_jax.data.datasets.smplx import float_array, smplx_motion
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.untrusted import read_pickle
from a2g_jax.recording import Recording
from a2g_jax.talker.skeleton import PELVIS_HEIGHT

FPS = 30.0
_EXPECTED = "SHOW's, with <speaker>/<video>/<train|val|test>/<seq>/<seq>.wav and .pkl in it"
#: Half a turn about x.
_OVER = np.array([1.0, -1.0, -1.0])


def find(folder: Path) -> list[Take]:
    """A take for each pickle, in the order of the paths."""
    pickles = files_with(folder, ".pkl", f"a folder that is {_EXPECTED}")
    if not any(path.with_suffix(".wav").is_file() for path in pickles):
        raise InputError(
            f"{folder}: has no .pkl with a .wav of the same name beside it; name a folder that is {_EXPECTED}."
        )
    return unique_names([_take(path) for path in pickles])


def _take(path: Path) -> Take:
    folders = list(path.absolute().parts[:-1])
    if folders[-1] == path.stem:
        folders.pop()
    split = SPLIT_NAMES.get(folders[-1], "")
    if split:
        folders.pop()
    video, speaker = folders[-1], folders[-2] if len(folders) > 1 else ""
    name = f"{speaker}/{video}/{path.stem}"
    return Take(name, (str(path.with_suffix(".wav")), str(path)), split, {"speaker": speaker, "video": video})


def read(take: Take, sample_rate: int) -> Recording:
    """Speech and the motion of the 22 body joints.

    Raises:
        InputError: a file is missing or damaged, or a pose differs from SHOW's README.
    """
    audio, path = take.sources
    speech = read_audio(audio, sample_rate)
    fit = read_pickle(path)
    if isinstance(fit, list | tuple) and len(fit) == 1:
        fit = fit[0]
    if not isinstance(fit, dict):
        raise InputError(f"{path}: holds a {type(fit).__name__}; expected a dictionary with 'body_pose_axis'.")
    shapes = {"body_pose_axis": ((21, 3), (63,)), "global_orient": ((3,), (1, 3)), "transl": ((3,), (1, 3))}
    arrays = {}
    for key, allowed in shapes.items():
        if key not in fit:
            raise InputError(f"{path}: has no {key!r}; expected a fit as SHOW's README describes it.")
        arrays[key] = float_array(fit[key], allowed, f"{path}, {key}")
    frames = len(arrays["body_pose_axis"])
    for key, array in arrays.items():
        if len(array) != frames:
            raise InputError(f"{path}, {key}: has {len(array)} frames; 'body_pose_axis' has {frames}.")
    pose = np.concatenate([arrays["global_orient"][:, None], arrays["body_pose_axis"]], axis=1)
    motion = smplx_motion(pose, arrays["transl"], FPS, path)
    rotations, root = np.array(motion.rotations), np.array(motion.root, np.float64)
    if np.mean(rotations[:, 0, 1, 1]) < 0.0:  # the vertical component of the pelvis' up axis
        rotations[:, 0] *= _OVER[:, None].astype(np.float32)
        root = root * _OVER
    root += np.array([0.0, PELVIS_HEIGHT, 0.0]) - root[0]
    return Recording(
        name=take.name,
        audio=speech,
        sample_rate=sample_rate,
        motion=replace(motion, rotations=rotations, root=root.astype(np.float32)),
        speaker=take.spec["speaker"],
        sources=take.sources,
        annotations={"video": take.spec["video"], "left_out": ["hands", "face"]},
    )


DATASET = DataSet(
    name="show",
    title="SHOW",
    fps=FPS,
    find=find,
    read=read,
    about=(
        "From talkshow.is.tue.mpg.de after registration, for non-commercial research. Folders"
        " <speaker>/<video>/<split>/<seq>/ with a .wav and a .pkl each; the split is official where"
        " the folders of TalkSHOW's split are there."
        " 22 body joints; fingers are components of a licensed basis and are left out."
    ),
)
