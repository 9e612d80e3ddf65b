"""Rotations in PyTorch: matrices from six numbers, and the angle between two."""

import torch
from torch import Tensor


def matrix_from_6d(six: Tensor) -> Tensor:
    """Gram-Schmidt of (..., 6) to (..., 3, 3)."""
    first, second = six[..., :3], six[..., 3:]
    first = first / first.norm(dim=-1, keepdim=True)
    second = second - (first * second).sum(-1, keepdim=True) * first
    second = second / second.norm(dim=-1, keepdim=True)
    return torch.stack([first, second, torch.linalg.cross(first, second)], dim=-1)


def geodesic_distance(first: Tensor, second: Tensor) -> Tensor:
    """Angle between rotations (..., 3, 3), radians, with zero gradient where they are equal.

    Sine and cosine of the angle from the rows, without forming the product of the matrices: the same numbers.
    """
    skew = torch.linalg.cross(first, second, dim=-1).sum(-2)
    square = (skew * skew).sum(-1)
    positive = square > torch.finfo(square.dtype).tiny
    norm = torch.where(positive, torch.sqrt(torch.where(positive, square, 1.0)), 0.0)
    return torch.atan2(norm / 2, ((first * second).sum((-1, -2)) - 1) / 2)
