"""Nine rigs and three skinned characters with one generated motion: files, a table and pictures.

    python -m experiments.characters [--out experiments/characters/results] [--pictures docs/pictures] [--seed 3]

A few seconds of ``a2g generate demo`` are written for every character as ``a2g generate --to`` does, read back, and
compared with the motion: places of the joints in the files, and directions of arms and legs against the run's own
skeleton. Writes ``characters.md``, ``skinned.png``
and, with a Chromium, ``characters.png`` and ``hands.png``.
"""

import argparse
import io
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from a2g_jax import Generator, demo_run, read_audio
from a2g_jax.generation.checked import Checked
from a2g_jax.generation.delivery import Delivery, Made
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.bvh import read_with_layout
from a2g_jax.io.character import Character, read_character
from a2g_jax.io.files import atomic_path
from a2g_jax.talker.demo_speech import demo_speech
from a2g_jax.viz.player import Figure, write_page
from a2g_jax.viz.player.video import page_pictures
from experiments.characters.decoded import joint_places
from experiments.characters.drawn import draw_row
from experiments.characters.rigs import EXPORTERS
from experiments.characters.skinned import SKINNED

#: Frames per second of the files, and seconds of speech.
FPS, SECONDS = 24.0, 6.0
#: Figures of a row of the picture.
_ABREAST = 6
#: Width and height of a figure's picture, and as the page draws it, pixels.
_PIXELS, _DRAWN = (240, 320), (360, 480)
_BONES = (("Shoulder", "Elbow"), ("Elbow", "Wrist"), ("Hip", "Knee"), ("Knee", "Ankle"))


@dataclass(frozen=True)
class Row:
    """What was found for a character."""

    name: str
    joints: int
    moved: int
    fingers: int
    millimetres: float
    """Largest distance of a joint in the file from where the motion has it."""
    degrees: float
    """Largest angle of an arm or leg bone to that of the motion on the run's skeleton."""


def main() -> None:
    """Write files, table and pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("experiments/characters/results"))
    parser.add_argument("--pictures", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--audio", type=Path, help="speech (default: that of 'a2g demo')")
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--time", type=float, default=3.0, help="of the pictures, seconds")
    options = parser.parse_args()
    motion = generated(options.audio, options.seed)
    rows, figures = [], []
    with tempfile.TemporaryDirectory() as folder:
        for path in write_characters(Path(folder)):
            character = read_character(path)
            made, row = delivered(character, motion, Path(folder) / f"out_{path.name}")
            rows.append(row)
            figures.append(Figure(made.shown, path.name))
            print(row)
        options.out.mkdir(parents=True, exist_ok=True)
        with atomic_path(options.out / "characters.md") as temporary:
            temporary.write_text(table(rows, options.seed), encoding="utf-8")
        files = [(Path(folder) / f"out_{Path(name).stem}.glb", name == "vrm_0.vrm") for name in SKINNED]
        with atomic_path(options.pictures / "skinned.png") as temporary:
            draw_row(files, options.time).quantize(256).save(temporary, optimize=True)
        pictured(options.pictures / "characters.png", figures, options.time, "a2gPlayer.view({ zoom: 1.8 });")
        near = "a2gPlayer.view({ zoom: 3.3, panY: 0.2 });"
        pictured(options.pictures / "hands.png", [figures[index] for index in (4, 7, 9)], options.time, near)
    print(f"{options.out}: characters.md; {options.pictures}: characters.png, hands.png")


def pictured(path: Path, figures: list[Figure], time: float, script: str) -> None:
    """Figures side by side, each drawn by a page of its own: together they are slow to draw without a GPU."""
    shots = []
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        for figure in figures:
            write_page(page, [figure], np.zeros(0, np.float32), 16000, title="")
            (picture,) = page_pictures(page, [time], *_DRAWN, script)
            with Image.open(io.BytesIO(picture)) as image:
                shots.append(image.convert("RGB").resize(_PIXELS, Image.Resampling.LANCZOS))
            ImageDraw.Draw(shots[-1]).text((8, 6), figure.label, fill=(60, 70, 85), font_size=15)
    across = min(len(shots), _ABREAST)
    whole = Image.new("RGB", (_PIXELS[0] * across, _PIXELS[1] * -(-len(shots) // across)))
    for at, shot in enumerate(shots):
        whole.paste(shot, (at % across * _PIXELS[0], at // across * _PIXELS[1]))
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as temporary:
        whole.quantize(256).save(temporary, optimize=True)


def generated(audio: Path | None, seed: int) -> Motion:
    """A sample of the run that comes with the package."""
    run = demo_run()
    rate = run.config.mel.sample_rate
    speech = demo_speech().audio if audio is None else read_audio(audio, rate)
    return next(iter(Checked(run, Generator(run)).stream(speech[: round(SECONDS * rate)], 1, seed)))


def write_characters(folder: Path) -> list[Path]:
    """All characters as files."""
    rigs = [rig.write(folder / f"{rig.name}.bvh") for rig in (make() for make in EXPORTERS)]
    return rigs + [make(folder / name) for name, make in SKINNED.items()]


def delivered(character: Character, motion: Motion, path: Path) -> tuple[Made, Row]:
    """A motion written for a character, and how exact the file is."""
    path = path.with_suffix(character.suffix)
    delivery = Delivery(character=character, fps=FPS)
    made, match = delivery.make(motion), delivery.match(motion.skeleton)
    assert made.own is not None
    assert match is not None
    delivery.written(path, made.own)
    if character.suffix == ".bvh":
        places = read_with_layout(path)[0].positions()
    else:
        places = joint_places(path, made.own.skeleton.names, made.own.frames, FPS)
    away = np.linalg.norm(places - made.own.positions(), axis=-1).max() * character.metres
    moved = {pair.target for pair in match.pairs} | {share.target for share in match.shares}
    fingers = [joint for role, joint in character.rig.roles.items() if role[-1] in "123" and joint not in moved]
    plain = Delivery(fps=FPS).make(motion).shown
    angle = bone_angles(made.shown, character.rig.roles, plain)
    return made, Row(
        character.path.name, character.rig.skeleton.joints, len(moved), len(fingers), 1000 * float(away), angle
    )


def bone_angles(shown: Motion, roles: dict[str, int], plain: Motion) -> float:
    """Largest angle in degrees between the bones of arms and legs of two motions."""
    ours, theirs, worst = shown.positions(), plain.positions(), 0.0
    for side in "LR":
        for first, second in _BONES:
            a, b = f"{side}_{first}", f"{side}_{second}"
            one = ours[:, roles[b]] - ours[:, roles[a]]
            two = theirs[:, plain.skeleton.index(b)] - theirs[:, plain.skeleton.index(a)]
            cosine = np.sum(one * two, -1) / np.linalg.norm(one, axis=-1) / np.linalg.norm(two, axis=-1)
            worst = max(worst, float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).max()))
    return worst


def table(rows: list[Row], seed: int) -> str:
    """The rows as Markdown."""
    lines = [
        "# Characters",
        "",
        f"`python -m experiments.characters --seed {seed}`: {SECONDS:g} s of the run `demo` written at {FPS:g} fps for"
        " rigs as nine programs name and pose them, and for three skinned characters; no file of these programs is"
        " included. Places: largest distance of a joint as read back from the file (GLB: by a decoder of its own) from"
        " forward kinematics. Angle: of upper arms, forearms, thighs and shins to those of the motion on the run's"
        " skeleton.",
        "",
        "| character | joints | moved | relaxed fingers | places, mm | angle, degrees |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row.name} | {row.joints} | {row.moved} | {row.fingers} | {row.millimetres:.4f} | {row.degrees:.2f} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
