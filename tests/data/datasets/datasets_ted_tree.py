"""Trees as TED Gesture and TED-Expressive lie on disk, of made-up numbers."""

import numpy as np

from tests.io.untrusted_writers import arrow_payload, write_lmdb


def made_up_clip(joints, frames=30, begin=12.4, fps=15.0, seed=0, **changes):
    rng = np.random.default_rng(seed)
    seconds = frames / fps
    return {
        "words": [
            ["so", begin - 0.2, begin + 0.3], ["here", begin + 0.5, begin + 0.75], ["", begin + 0.8, begin + 0.9],
            ["we  go", begin + seconds - 0.25, begin + seconds + 0.5],
            ["late", begin + seconds + 1, begin + seconds + 2],
        ],
        "skeletons_3d": rng.normal(size=(frames, joints, 3)).astype(np.float32),
        "audio_feat": rng.normal(size=(128, 63)).astype(np.float16),
        "audio_raw": rng.uniform(-0.9, 0.9, round(16000 * seconds)).astype(np.float16),
        "start_frame_no": round(begin * fps), "end_frame_no": round((begin + seconds) * fps),
        "start_time": begin, "end_time": begin + seconds,
    } | changes  # fmt: skip


def write_videos(folder, videos):
    """``videos``: what each key holds, such as ``{"vid": name, "clips": [...]}``; returns the database."""
    return write_lmdb(folder, {b"%010d" % number: arrow_payload(video) for number, video in enumerate(videos)})


def write_ted(root, joints, prefix="lmdb_", clips=2):
    """Three databases; returns part -> videos."""
    parts = {}
    for number, part in enumerate(("train", "val", "test")):
        talks = [("AbCdEfGhI-1", 100), ("AbCdEfGhI_2", 200)]
        parts[part] = [
            {
                "vid": vid,
                "clips": [made_up_clip(joints, 30 + 3 * at, 12.4 + 40 * (3 * at + number), seed=seed + 10 * number + at)
                          for at in range(clips)],
            }
            for vid, seed in talks
        ]  # fmt: skip
        write_videos(root / f"{prefix}{part}", parts[part])
    return parts
