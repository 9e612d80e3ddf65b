"""The picture of retargeting in the documentation: one performance on two rigs, there and back.

    python -m experiments.retarget_pictures [--out docs/pictures] [--seed 7]

A generated talker (T-pose, y up, metres, 22 joints) drives a rig that differs in everything (A-pose, z up, centimetres,
other names and proportions, five spine joints, twist bones), which drives the talker again. All go through BVH files.
Needs matplotlib. Writes ``retarget.png``.
"""

import argparse
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget import Rig, find_rig, match_rigs, retarget
from a2g_jax.geometry.retarget.poses import joint_places, rotation_angle, world_rotations
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh, read_with_layout, write_bvh, write_like
from a2g_jax.io.files import atomic_path
from a2g_jax.talker.recordings import talk

matplotlib.use("agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection
from matplotlib.patches import Ellipse

INK, SOFT, LEFT, RIGHT, MIDDLE, TWIST = "#1d2733", "#6b7785", "#2f7fd1", "#e0762f", "#4a5563", "#b03a8c"
#: Turn and tilt of the camera, radians.
YAW, PITCH = -0.6, 0.12
#: Seconds of talk from which moments are chosen.
SECONDS = 30.0
#: Minimum height of a wrist above the hips at a chosen moment, metres.
RAISED = 0.34


def other_rig() -> Skeleton:
    """Tall, long-armed, in an A-pose, z up and facing -y, with Unreal's names and twist bones."""
    rows: list[tuple[str, str, tuple[float, float, float]]] = [
        ("root", "", (0, 0, 0)),
        ("pelvis", "root", (0, 0, 1.02)),
    ]
    above = "pelvis"
    for number, rise in enumerate((0.08, 0.1, 0.1, 0.1, 0.11), start=1):
        rows.append((f"spine_0{number}", above, (0, 0.005, rise)))
        above = f"spine_0{number}"
    rows += [("neck_01", above, (0, 0.02, 0.15)), ("head", "neck_01", (0, -0.02, 0.11))]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        down = np.radians(50.0)
        arm = np.array([sign * np.cos(down), 0.0, -np.sin(down)])
        rows += [
            (f"clavicle_{side}", above, (sign * 0.03, 0.01, 0.11)),
            (f"upperarm_{side}", f"clavicle_{side}", (sign * 0.19, 0.01, 0.0)),
            (f"upperarm_twist_01_{side}", f"upperarm_{side}", tuple(0.17 * arm)),
            (f"lowerarm_{side}", f"upperarm_{side}", tuple(0.34 * arm)),
            (f"lowerarm_twist_01_{side}", f"lowerarm_{side}", tuple(0.15 * arm)),
            (f"hand_{side}", f"lowerarm_{side}", tuple(0.3 * arm)),
            (f"thigh_{side}", "pelvis", (sign * 0.1, 0.0, -0.05)),
            (f"calf_{side}", f"thigh_{side}", (sign * 0.02, 0.0, -0.45)),
            (f"foot_{side}", f"calf_{side}", (sign * 0.01, 0.02, -0.44)),
            (f"ball_{side}", f"foot_{side}", (sign * 0.01, -0.15, -0.07)),
        ]
    names = tuple(name for name, _, _ in rows)
    parents = tuple(names.index(parent) if parent else -1 for _, parent, _ in rows)
    ends = [(names.index("head"), (0.0, -0.02, 0.2))]
    for side in "lr":
        hand = np.array(rows[names.index(f"hand_{side}")][2])
        tip = hand / np.linalg.norm(hand) * 0.19
        ends += [(names.index(f"hand_{side}"), (float(tip[0]), float(tip[1]), float(tip[2])))]
        ends += [(names.index(f"ball_{side}"), (0.0, -0.07, 0.0))]
    offsets = np.array([offset for _, _, offset in rows], np.float32)
    return Skeleton(offsets, names, parents, tuple(sorted(ends)))


def through_files(motion: Motion, target: Skeleton, folder: Path) -> tuple[Motion, Motion, Motion, Rig, Rig]:
    """The motion as read from a file, on the target and back, and both rigs."""
    still = Motion(
        np.eye(3, dtype=np.float32)[None, None].repeat(target.joints, 1), np.zeros((1, 3), np.float32), target, 1.0
    )
    write_bvh(folder / "talker.bvh", motion, scale=1.0)
    write_bvh(folder / "other.bvh", still, order="YZX", scale=100.0)
    source, layout = read_with_layout(folder / "talker.bvh")
    read, other = read_with_layout(folder / "other.bvh")
    first, second = find_rig(source), find_rig(read)
    write_like(folder / "there.bvh", retarget(source, match_rigs(first, second)), other)
    there = read_bvh(folder / "there.bvh")
    write_like(folder / "back.bvh", retarget(there, match_rigs(second, first)), layout)
    return source, there, read_bvh(folder / "back.bvh"), first, second


def drawn(rig: Rig, rotations: Float[np.ndarray, "J 3 3"]) -> tuple[Float[np.ndarray, "J 3"], Float[np.ndarray, "E 3"]]:
    """Joints and end sites of a pose, left, up and forward of the hips, metres."""
    skeleton = rig.skeleton
    world = world_rotations(rotations.astype(np.float64), skeleton.parents)
    places = joint_places(world, np.asarray(skeleton.offsets, np.float64), skeleton.parents)
    tips = np.array([places[joint] + world[joint] @ np.asarray(end) for joint, end in skeleton.ends])
    hips = places[[rig.roles["L_Hip"], rig.roles["R_Hip"]]].mean(axis=0)
    # Columns of the frame: left, up, forward.
    return (places - hips) @ rig.world, (tips.reshape(-1, 3) - hips) @ rig.world


def project(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Right and up on the page, and depth towards the reader."""
    x, y, z = points.T
    across, ahead = x * np.cos(YAW) + z * np.sin(YAW), -x * np.sin(YAW) + z * np.cos(YAW)
    return np.stack([across, y * np.cos(PITCH) - ahead * np.sin(PITCH), ahead * np.cos(PITCH) + y * np.sin(PITCH)], 1)


def draw(axes, rig: Rig, rotations: Float[np.ndarray, "J 3 3"], size: float, faint: bool = False) -> None:
    """Draw one figure: left blue, right orange; farther bones are paler."""
    skeleton = rig.skeleton
    places, tips = drawn(rig, rotations)
    low = float(min(places[:, 1].min(), tips[:, 1].min()))
    joints, ends = project(places / size), project(tips / size)
    side = {joint: role[0] for role, joint in rig.roles.items() if role[:2] in ("L_", "R_")}
    bones: list[tuple[float, np.ndarray, str, float]] = []

    def colour(joint: int) -> str:
        return {"L": LEFT, "R": RIGHT}.get(side.get(joint, ""), MIDDLE)

    for joint, parent in enumerate(skeleton.parents):
        # Nodes above the pelvis represent the world.
        if parent < 0 or "twist" in skeleton.names[joint] or joint == rig.roles["Pelvis"]:
            continue
        bones.append((joints[[joint, parent], 2].mean(), joints[[parent, joint], :2], colour(joint), 5.0))
    for (owner, _), end in zip(skeleton.ends, ends, strict=True):
        # End sites of twist bones come from the writer; the head is drawn as one bone.
        if "twist" in skeleton.names[owner] or owner == rig.roles["Head"]:
            continue
        bones.append(((joints[owner, 2] + end[2]) / 2, np.stack([joints[owner, :2], end[:2]]), colour(owner), 5.0))
    bones.sort(key=lambda bone: bone[0])
    around = np.linspace(0, 2 * np.pi, 60)
    ground = project(np.stack([0.27 * np.cos(around), np.full(60, low / size), 0.27 * np.sin(around)], axis=1))
    axes.fill(ground[:, 0], ground[:, 1], color="#e9edf1", zorder=0)
    alpha = 0.55 if faint else 1.0
    outline = LineCollection([b[1] for b in bones], colors="white", linewidths=7.5, capstyle="round", zorder=1)
    axes.add_collection(outline)
    for order, (_, line, tone, width) in enumerate(bones):
        axes.plot(*line.T, color="white", lw=width + 2, solid_capstyle="round", zorder=2 + order)
        axes.plot(*line.T, color=tone, lw=width, alpha=alpha, solid_capstyle="round", zorder=2 + order)
    top = 3 + len(bones)
    crown = next(end for (owner, _), end in zip(skeleton.ends, ends, strict=True) if owner == rig.roles["Head"])
    head = joints[rig.roles["Head"], :2]
    middle, length = (head + crown[:2]) / 2, float(np.linalg.norm(crown[:2] - head))
    turn = np.degrees(np.arctan2(*(crown[:2] - head)[::-1])) - 90
    oval = Ellipse(
        middle, 0.78 * length, 1.08 * length, angle=turn, fc=MIDDLE, ec="white", lw=1.2, alpha=alpha, zorder=top
    )
    axes.add_patch(oval)
    top += 1
    plain = [j for j in range(skeleton.joints) if "twist" not in skeleton.names[j] and j >= rig.roles["Pelvis"]]
    axes.scatter(joints[plain, 0], joints[plain, 1], s=11, color="white", edgecolors=INK, linewidths=0.8, zorder=top)
    twists = [j for j in range(skeleton.joints) if "twist" in skeleton.names[j]]
    if twists:
        axes.scatter(joints[twists, 0], joints[twists, 1], s=24, marker="D", color=TWIST, lw=0, zorder=top + 1)
    axes.set_aspect("equal")
    axes.set_xlim(-0.52, 0.52)
    axes.set_ylim(-0.64, 0.6)
    axes.axis("off")


def draw_axes(axes, rig: Rig) -> None:
    """The three axes of the file's world, at the feet of the figure."""
    corner = np.array([-0.36, -0.34])
    for name, direction in zip("xyz", rig.world, strict=True):
        right, high, near = project(direction[None])[0]
        tip = corner + 0.13 * np.array([right, high])
        axes.annotate(
            "", tip, corner, arrowprops={"arrowstyle": "-|>", "color": SOFT, "lw": 1.3, "shrinkA": 0, "shrinkB": 0}
        )
        # A foreshortened arrow has its letter above it.
        x, y = corner + 1.3 * (tip - corner) + (0.0, 0.035 * (near < -0.5))
        axes.text(x, y, name, color=SOFT, fontsize=10, ha="center", va="center")


def moments(motion: Motion, rig: Rig, count: int) -> list[int]:
    """Frames with a hand raised and wrists as different as possible, in temporal order."""
    wrists = np.stack([drawn(rig, np.asarray(frame))[0][[rig.roles["L_Wrist"], rig.roles["R_Wrist"]]]
                       for frame in np.asarray(motion.rotations)[::3]])  # fmt: skip
    raised = wrists[:, :, 1].max(axis=1) > RAISED
    chosen = [int(np.argmax(wrists[:, :, 1].sum(axis=1)))]
    while len(chosen) < count:
        gaps = raised * np.min([np.linalg.norm(wrists - wrists[c], axis=2).sum(axis=1) for c in chosen], axis=0)
        chosen.append(int(np.argmax(gaps)))
    return sorted(3 * frame for frame in chosen)


def picture(path: Path, seed: int) -> None:
    """Rest pose and three moments of each rig."""
    motion = talk(SECONDS, seed, speaker="chiara", emotion="happiness").motion
    with tempfile.TemporaryDirectory() as folder:
        source, there, back, first, second = through_files(motion, other_rig(), Path(folder))
    error = rotation_angle(
        world_rotations(np.asarray(source.rotations, np.float64), source.skeleton.parents),
        world_rotations(np.asarray(back.rotations, np.float64), back.skeleton.parents),
    ).max()
    frames = moments(source, first, 3)
    rows = (
        ("The talker", "T-pose, y up, metres\n22 joints, ZXY angles", source, first),
        (
            "on another rig",
            f"A-pose, z up, centimetres\n{second.skeleton.joints} joints, YZX angles\ntwist bones (diamonds)",
            there,
            second,
        ),
        ("and back", f"22 joints, {source.frames} frames:\nall within {max(error, 1e-4):.4f} degrees", back, first),
    )
    figure, grid = plt.subplots(3, 5, figsize=(12.4, 9.8), dpi=140, gridspec_kw={"width_ratios": (0.72, 1, 1, 1, 1)})
    figure.subplots_adjust(0.01, 0.0, 1.0, 0.955, wspace=0.0, hspace=0.03)
    for row, (title, about, shown, rig) in zip(grid, rows, strict=True):
        row[0].axis("off")
        row[0].text(0.1, 0.66, title, transform=row[0].transAxes, fontsize=15, weight="bold", color=INK, va="bottom")
        row[0].text(0.1, 0.62, about, transform=row[0].transAxes, fontsize=10, color=SOFT, va="top", linespacing=1.5)
        draw(row[1], rig, rig.rest, rig.height, faint=True)
        draw_axes(row[1], rig)
        for axes, frame in zip(row[2:], frames, strict=True):
            draw(axes, rig, np.asarray(shown.rotations[frame]), rig.height)
    for axes, text in zip(grid[0][1:], ("at rest", *(f"{frame / source.fps:.1f} s" for frame in frames)), strict=True):
        place = axes.get_position()
        figure.text((place.x0 + place.x1) / 2, 0.963, text, ha="center", fontsize=11, color=SOFT)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, facecolor="white", metadata={"Software": ""})
    plt.close(figure)


def main() -> None:
    """Parse the command line and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--seed", type=int, default=7)
    options = parser.parse_args()
    picture(options.out / "retarget.png", options.seed)
    print(options.out / "retarget.png")


if __name__ == "__main__":
    main()
