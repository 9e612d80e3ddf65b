"""Japanese, Chinese and Korean words in joint names, in English.

MikuMikuDance and its exporters name joints in Japanese (``左ひじ``: left elbow). Words are translated and the rest of a
name is kept, so that :mod:`~a2g_jax.geometry.joint_names` reads the result as any other name.
"""

import unicodedata

_WORDS = {
    "Left": ("左", "왼쪽", "왼"),
    "Right": ("右", "오른쪽", "오른"),
    "Thumb": ("親指", "拇指", "大拇指", "엄지"),
    "Index": ("人差し指", "人差指", "人指", "食指", "검지"),
    "Middle": ("中指", "중지"),
    "Ring": ("薬指", "无名指", "無名指", "약지"),
    "Pinky": ("小指", "새끼", "소지"),
    "Spine": ("上半身", "脊柱", "脊椎", "脊骨", "척추"),
    "Pelvis": ("下半身", "骨盤", "骨盆", "골반"),
    "Neck": ("首", "脖子", "颈部", "颈", "頸", "목"),
    "Head": ("頭", "头部", "头", "머리"),
    "Collar": ("鎖骨", "锁骨", "쇄골"),
    "Shoulder": ("肩膀", "肩", "어깨"),
    "UpperArm": ("上腕", "上臂", "大臂", "위팔"),
    "ForeArm": ("前腕", "前臂", "小臂", "아래팔"),
    "Arm": ("腕", "팔"),
    "Elbow": ("ひじ", "肘", "팔꿈치"),
    "Wrist": ("手首", "手腕", "손목"),
    "Hand": ("手掌", "手", "손"),
    "Thigh": ("太もも", "大腿", "허벅지"),
    "Calf": ("すね", "小腿", "종아리"),
    "Leg": ("足", "腿", "다리"),
    "Knee": ("ひざ", "膝盖", "膝", "무릎"),
    "Ankle": ("足首", "脚踝", "踝", "발목"),
    "Foot": ("脚掌", "脚", "발"),
    "Toe": ("つま先", "爪先", "脚趾", "脚尖", "발가락", "발끝"),
    "Twist": ("捩り", "捩"),
}
#: Longer words first: 手首 is a wrist, though 手 is a hand and 首 a neck.
_TABLE = sorted(((word, english) for english, words in _WORDS.items() for word in words), key=lambda row: -len(row[0]))


def in_english(name: str) -> str:
    """The name with Japanese, Chinese and Korean words in English and full-width digits as ASCII; others unchanged."""
    if name.isascii():
        return name
    name = unicodedata.normalize("NFKC", name)
    for word, english in _TABLE:
        if word in name:
            name = name.replace(word, f" {english} ")
    return name
