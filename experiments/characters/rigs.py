"""Rigs as nine programs write them: names, tree, rest pose, axes, unit and rotation order.

No file of these programs is included: the tables follow their published naming, on the proportions of one person.
"""

from experiments.characters.exporter import Exporter, Rows
from experiments.characters.person import Stance

_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")


def _chain(rows: Rows, above: str, *joints: tuple[str, str]) -> str:
    for name, part in joints:
        rows.append((name, above, part))
        above = name
    return above


def _fingers(rows: Rows, side: str, hand: str, label, last: int = 3, palm=None) -> None:
    for finger in _FINGERS:
        above = hand
        if palm is not None and finger != "Thumb":
            above = _chain(rows, hand, (palm(finger), f"{side}_{finger}0"))
        _chain(rows, above, *((label(finger, number), f"{side}_{finger}{number}") for number in range(1, last + 1)))


def mixamo(prefix: str = "mixamorig:") -> Exporter:
    """Mixamo: T-pose, y up, four joints a finger, ends of head and toes as joints."""
    rows: Rows = []
    top = _chain(rows, "", (f"{prefix}Hips", "Pelvis"))
    chest = _chain(
        rows, top, (f"{prefix}Spine", "Spine1"), (f"{prefix}Spine1", "Spine2"), (f"{prefix}Spine2", "Spine4")
    )
    _chain(rows, chest, (f"{prefix}Neck", "Neck"), (f"{prefix}Head", "Head"), (f"{prefix}HeadTop_End", "HeadTop"))
    for side, word in (("L", "Left"), ("R", "Right")):
        p = prefix + word
        arm = (("Shoulder", "Collar"), ("Arm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist"))
        hand = _chain(rows, chest, *((p + name, f"{side}_{part}") for name, part in arm))
        _fingers(rows, side, hand, lambda finger, number, p=p: f"{p}Hand{finger}{number}", 4)
        leg = (("UpLeg", "Hip"), ("Leg", "Knee"), ("Foot", "Ankle"), ("ToeBase", "Foot"), ("Toe_End", "ToeTip"))
        _chain(rows, top, *((p + name, f"{side}_{part}") for name, part in leg))
    return Exporter("mixamo", rows, axes="Y")


def cmu() -> Exporter:
    """CMU's BVH: hip joints of no length, LowerBack, a finger base and a thumb; units of 5.644 cm; ZYX."""
    rows: Rows = []
    top = _chain(rows, "", ("Hips", "Pelvis"))
    for side, letter, word in (("L", "L", "Left"), ("R", "R", "Right")):
        leg = (("UpLeg", "Hip"), ("Leg", "Knee"), ("Foot", "Ankle"), ("ToeBase", "Foot"))
        hip = _chain(rows, top, (f"{letter}HipJoint", "Pelvis"))
        _chain(rows, hip, *((word + name, f"{side}_{part}") for name, part in leg))
    chest = _chain(rows, top, ("LowerBack", "Pelvis"), ("Spine", "Spine2"), ("Spine1", "Spine4"))
    _chain(rows, chest, ("Neck", "Spine5"), ("Neck1", "Neck"), ("Head", "Head"))
    for side, letter, word in (("L", "L", "Left"), ("R", "R", "Right")):
        arm = (("Shoulder", "Collar"), ("Arm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist"))
        hand = _chain(rows, chest, *((word + name, f"{side}_{part}") for name, part in arm))
        _chain(rows, hand, (f"{word}FingerBase", f"{side}_Middle1"), (f"{word}HandIndex1", f"{side}_Middle3"))
        _chain(rows, hand, (f"{letter}Thumb", f"{side}_Thumb2"))
    return Exporter("cmu", rows, Stance(spread=8.0), order="ZYX", units=0.45 / 0.0254)


def rigify() -> Exporter:
    """Blender's Rigify, deform bones: z up, metres, A-pose, bones in two halves, palms."""
    rows: Rows = []
    top = _chain(rows, "", ("DEF-spine", "Pelvis"))
    chest = _chain(rows, top, ("DEF-spine.001", "Spine1"), ("DEF-spine.002", "Spine2"), ("DEF-spine.003", "Spine4"))
    _chain(rows, chest, ("DEF-spine.004", "Neck"), ("DEF-spine.005", "Neck2"), ("DEF-spine.006", "Head"))
    for side in "LR":
        s = f"{side}_"
        hand = _chain(
            rows,
            chest,
            (f"DEF-shoulder.{side}", f"{s}Collar"),
            (f"DEF-upper_arm.{side}", f"{s}Shoulder"),
            (f"DEF-upper_arm.{side}.001", f"{s}Shoulder>{s}Elbow:0.5"),
            (f"DEF-forearm.{side}", f"{s}Elbow"),
            (f"DEF-forearm.{side}.001", f"{s}Elbow>{s}Wrist:0.5"),
            (f"DEF-hand.{side}", f"{s}Wrist"),
        )
        palms = {"Index": "01", "Middle": "02", "Ring": "03", "Pinky": "04"}

        def label(finger: str, number: int, side: str = side) -> str:
            return f"DEF-{'' if finger == 'Thumb' else 'f_'}{finger.lower()}.0{number}.{side}"

        _fingers(rows, side, hand, label, 3, lambda finger, side=side, palms=palms: f"DEF-palm.{palms[finger]}.{side}")
        _chain(
            rows,
            top,
            (f"DEF-thigh.{side}", f"{s}Hip"),
            (f"DEF-thigh.{side}.001", f"{s}Hip>{s}Knee:0.5"),
            (f"DEF-shin.{side}", f"{s}Knee"),
            (f"DEF-shin.{side}.001", f"{s}Knee>{s}Ankle:0.5"),
            (f"DEF-foot.{side}", f"{s}Ankle"),
            (f"DEF-toe.{side}", f"{s}Foot"),
        )
    return Exporter("rigify", rows, Stance(lowered=40.0), up="Z", order="XYZ", units=1.0, axes="Y")


def vroid(facing: int = -1) -> Exporter:
    """VRoid Studio's VRM: J_Bip names, T-pose, world axes; VRM 0.x faces -z, 1.0 faces +z."""
    rows: Rows = []
    top = _chain(rows, "", ("Root", "Ground"), ("J_Bip_C_Hips", "Pelvis"))
    chest = _chain(
        rows, top, ("J_Bip_C_Spine", "Spine1"), ("J_Bip_C_Chest", "Spine2"), ("J_Bip_C_UpperChest", "Spine4")
    )
    head = _chain(rows, chest, ("J_Bip_C_Neck", "Neck"), ("J_Bip_C_Head", "Head"))
    for side in "LR":
        _chain(rows, head, (f"J_Adj_{side}_FaceEye", "Head>HeadTop:0.4"))
    _chain(rows, head, ("J_Sec_Hair1_01", "HeadTop"), ("J_Sec_Hair2_01", "Head>HeadTop:1.1"))
    for side in "LR":
        p = f"J_Bip_{side}_"
        arm = (("Shoulder", "Collar"), ("UpperArm", "Shoulder"), ("LowerArm", "Elbow"), ("Hand", "Wrist"))
        hand = _chain(rows, chest, *((p + name, f"{side}_{part}") for name, part in arm))
        little = {"Pinky": "Little"}
        _fingers(rows, side, hand, lambda f, n, p=p, little=little: f"{p}{little.get(f, f)}{n}")
        leg = (("UpperLeg", "Hip"), ("LowerLeg", "Knee"), ("Foot", "Ankle"), ("ToeBase", "Foot"))
        _chain(rows, top, *((p + name, f"{side}_{part}") for name, part in leg))
    return Exporter("vroid", rows, order="YXZ", units=1.0, facing=facing)


def unreal() -> Exporter:
    """Unreal's mannequin: z up, centimetres, A-pose with half-closed hands, metacarpals, twist and IK bones."""
    rows: Rows = []
    root = _chain(rows, "", ("root", "Ground"))
    top = _chain(rows, root, ("pelvis", "Pelvis"))
    chest = _chain(rows, top, *((f"spine_0{number}", f"Spine{number}") for number in range(1, 6)))
    _chain(rows, chest, ("neck_01", "Neck"), ("neck_02", "Neck2"), ("head", "Head"))
    for side, s in (("L", "l"), ("R", "r")):
        arm = (("clavicle", "Collar"), ("upperarm", "Shoulder"), ("lowerarm", "Elbow"), ("hand", "Wrist"))
        hand = _chain(rows, chest, *((f"{name}_{s}", f"{side}_{part}") for name, part in arm))
        _fingers(
            rows,
            side,
            hand,
            lambda f, n, s=s: f"{f.lower()}_0{n}_{s}",
            3,
            lambda f, s=s: f"{f.lower()}_metacarpal_{s}",
        )
        for number, share in ((1, 0.33), (2, 0.66)):
            rows.append((f"upperarm_twist_0{number}_{s}", f"upperarm_{s}", f"{side}_Shoulder>{side}_Elbow:{share}"))
            rows.append((f"lowerarm_twist_0{number}_{s}", f"lowerarm_{s}", f"{side}_Elbow>{side}_Wrist:{share}"))
        leg = (("thigh", "Hip"), ("calf", "Knee"), ("foot", "Ankle"), ("ball", "Foot"))
        _chain(rows, top, *((f"{name}_{s}", f"{side}_{part}") for name, part in leg))
        rows.append((f"thigh_twist_01_{s}", f"thigh_{s}", f"{side}_Hip>{side}_Knee:0.5"))
    feet = _chain(rows, root, ("ik_foot_root", "Ground"))
    hands = _chain(rows, root, ("ik_hand_root", "Ground"), ("ik_hand_gun", "R_Wrist"))
    for side, s in (("L", "l"), ("R", "r")):
        rows.append((f"ik_foot_{s}", feet, f"{side}_Ankle"))
        rows.append((f"ik_hand_{s}", hands, f"{side}_Wrist"))
    return Exporter("unreal", rows, Stance(lowered=50.0, curl=18.0), up="Z", order="XYZ", axes="X")


def daz() -> Exporter:
    """Daz Genesis 8: bend and twist bones, carpals, toes, A-pose."""
    rows: Rows = []
    hip = _chain(rows, "", ("hip", "Pelvis"))
    pelvis = _chain(rows, hip, ("pelvis", "Pelvis"))
    chest = _chain(
        rows,
        hip,
        ("abdomenLower", "Spine1"),
        ("abdomenUpper", "Spine2"),
        ("chestLower", "Spine3"),
        ("chestUpper", "Spine4"),
    )
    _chain(rows, chest, ("neckLower", "Neck"), ("neckUpper", "Neck2"), ("head", "Head"))
    for side, s in (("L", "l"), ("R", "r")):
        p = f"{side}_"
        hand = _chain(
            rows,
            chest,
            (f"{s}Collar", f"{p}Collar"),
            (f"{s}ShldrBend", f"{p}Shoulder"),
            (f"{s}ShldrTwist", f"{p}Shoulder>{p}Elbow:0.5"),
            (f"{s}ForearmBend", f"{p}Elbow"),
            (f"{s}ForearmTwist", f"{p}Elbow>{p}Wrist:0.5"),
            (f"{s}Hand", f"{p}Wrist"),
        )
        carpals = {"Index": 1, "Middle": 2, "Ring": 3, "Pinky": 4}
        words = {"Middle": "Mid"}
        _fingers(
            rows,
            side,
            hand,
            lambda f, n, s=s, words=words: f"{s}{words.get(f, f)}{n}",
            3,
            lambda f, s=s, carpals=carpals: f"{s}Carpal{carpals[f]}",
        )
        foot = _chain(
            rows,
            pelvis,
            (f"{s}ThighBend", f"{p}Hip"),
            (f"{s}ThighTwist", f"{p}Hip>{p}Knee:0.5"),
            (f"{s}Shin", f"{p}Knee"),
            (f"{s}Foot", f"{p}Ankle"),
        )
        _chain(rows, foot, (f"{s}Metatarsals", f"{p}Ankle>{p}Foot:0.5"), (f"{s}Toe", f"{p}Foot"))
    return Exporter("daz", rows, Stance(lowered=45.0, spread=4.0), order="XYZ")


def makehuman() -> Exporter:
    """MakeHuman's default skeleton: spines from above, two bones a limb, finger1 the thumb; decimetres."""
    rows: Rows = []
    root = _chain(rows, "", ("root", "Pelvis"))
    chest = _chain(
        rows,
        root,
        ("spine05", "Spine1"),
        ("spine04", "Spine2"),
        ("spine03", "Spine3"),
        ("spine02", "Spine4"),
        ("spine01", "Spine5"),
    )
    _chain(rows, chest, ("neck01", "Neck"), ("neck02", "Neck2"), ("neck03", "Neck2>Head:0.5"), ("head", "Head"))
    for side in "LR":
        p = f"{side}_"
        hand = _chain(
            rows,
            chest,
            (f"clavicle.{side}", f"{p}Collar"),
            (f"shoulder01.{side}", f"{p}Collar>{p}Shoulder:0.6"),
            (f"upperarm01.{side}", f"{p}Shoulder"),
            (f"upperarm02.{side}", f"{p}Shoulder>{p}Elbow:0.5"),
            (f"lowerarm01.{side}", f"{p}Elbow"),
            (f"lowerarm02.{side}", f"{p}Elbow>{p}Wrist:0.5"),
            (f"wrist.{side}", f"{p}Wrist"),
        )
        _fingers(rows, side, hand, lambda f, n, side=side: f"finger{_FINGERS.index(f) + 1}-{n}.{side}")
        foot = _chain(
            rows,
            root,
            (f"pelvis.{side}", f"Pelvis>{p}Hip:0.5"),
            (f"upperleg01.{side}", f"{p}Hip"),
            (f"upperleg02.{side}", f"{p}Hip>{p}Knee:0.5"),
            (f"lowerleg01.{side}", f"{p}Knee"),
            (f"lowerleg02.{side}", f"{p}Knee>{p}Ankle:0.5"),
            (f"foot.{side}", f"{p}Ankle"),
        )
        for toe in range(1, 6):
            _chain(rows, foot, (f"toe{toe}-1.{side}", f"{p}Foot"), (f"toe{toe}-2.{side}", f"{p}Foot>{p}ToeTip:0.6"))
    return Exporter("makehuman", rows, Stance(lowered=35.0), order="XZY", units=10.0)


def reallusion() -> Exporter:
    """Reallusion's Character Creator: CC_Base names, A-pose, twist bones, neck twists."""
    rows: Rows = []
    hip = _chain(rows, "", ("CC_Base_BoneRoot", "Ground"), ("CC_Base_Hip", "Pelvis"))
    pelvis = _chain(rows, hip, ("CC_Base_Pelvis", "Pelvis"))
    chest = _chain(rows, hip, ("CC_Base_Waist", "Spine1"), ("CC_Base_Spine01", "Spine2"), ("CC_Base_Spine02", "Spine4"))
    head = _chain(
        rows, chest, ("CC_Base_NeckTwist01", "Neck"), ("CC_Base_NeckTwist02", "Neck2"), ("CC_Base_Head", "Head")
    )
    _chain(rows, head, ("CC_Base_FacialBone", "Head"), ("CC_Base_JawRoot", "Head>HeadTop:0.1"))
    for side in "LR":
        c, p = f"CC_Base_{side}_", f"{side}_"
        arm = (("Clavicle", "Collar"), ("Upperarm", "Shoulder"), ("Forearm", "Elbow"), ("Hand", "Wrist"))
        hand = _chain(rows, chest, *((c + name, p + part) for name, part in arm))
        words = {"Middle": "Mid"}
        _fingers(rows, side, hand, lambda f, n, c=c, words=words: f"{c}{words.get(f, f)}{n}")
        leg = (("Thigh", "Hip"), ("Calf", "Knee"), ("Foot", "Ankle"), ("ToeBase", "Foot"))
        _chain(rows, pelvis, *((c + name, p + part) for name, part in leg))
        for name, above, ends in (
            ("UpperarmTwist", "Upperarm", f"{p}Shoulder>{p}Elbow"),
            ("ForearmTwist", "Forearm", f"{p}Elbow>{p}Wrist"),
            ("ThighTwist", "Thigh", f"{p}Hip>{p}Knee"),
            ("CalfTwist", "Calf", f"{p}Knee>{p}Ankle"),
        ):
            for number, share in ((1, 0.3), (2, 0.7)):
                rows.append((f"{c}{name}0{number}", c + above, f"{ends}:{share}"))
    return Exporter("reallusion", rows, Stance(lowered=45.0), order="ZYX", axes="Y")


def xsens() -> Exporter:
    """Xsens MVN: vertebrae as spine, T-pose, no fingers, y up, centimetres, YXZ."""
    rows: Rows = []
    top = _chain(rows, "", ("Hips", "Pelvis"))
    chest = _chain(rows, top, ("L5", "Spine1"), ("L3", "Spine2"), ("T12", "Spine3"), ("T8", "Spine4"))
    _chain(rows, chest, ("Neck", "Neck"), ("Head", "Head"))
    for side, word in (("R", "Right"), ("L", "Left")):
        arm = (("Shoulder", "Collar"), ("UpperArm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist"))
        _chain(rows, chest, *((word + name, f"{side}_{part}") for name, part in arm))
        leg = (("UpperLeg", "Hip"), ("LowerLeg", "Knee"), ("Foot", "Ankle"), ("Toe", "Foot"))
        _chain(rows, top, *((word + name, f"{side}_{part}") for name, part in leg))
    return Exporter("xsens", rows, order="YXZ")


#: The nine rigs.
EXPORTERS = (mixamo, cmu, rigify, vroid, unreal, daz, makehuman, reallusion, xsens)
