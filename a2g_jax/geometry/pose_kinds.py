"""The kinds of poses; importable without JAX."""

#: Values of each joint, bone or point. 6d: the first two columns of a local rotation matrix (Zhou et al. 2019);
#: exponential: axis times angle of a local rotation, radians, at most pi; euler: its intrinsic angles about y, x and z,
#: radians; directions: a unit vector from parent to child; keypoints: the place of a point in the image.
WIDTHS = {"6d": 6, "exponential": 3, "euler": 3, "directions": 3, "keypoints": 2}
