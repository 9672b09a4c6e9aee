"""Real roots of many polynomials at once, within an interval."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TOUCHES = 1e-13
"""A polynomial that turns back so near to zero, over the sum of its coefficients, touches it: two equal roots."""


def real_roots(coefficients: Array, low: float, high: float) -> Array:
    """Roots inside an interval: between two neighbouring extrema a polynomial is monotone and has at most one.

    The extrema are the roots of the derivative, found in the same way. Leading coefficients may vanish.

    Args:
        coefficients: Of degree n >= 1 (..., n + 1), the constant first.
        low: Lower end of the interval.
        high: Upper end.

    Returns:
        (..., n), ascending; NaN for those that are not there.
    """
    degree = coefficients.shape[-1] - 1
    slopes = coefficients[..., 1:] * np.arange(1, degree + 1)
    ends = np.broadcast_to([low, high], (*coefficients.shape[:-1], 2))
    extrema = real_roots(slopes, low, high) if degree > 1 else ends[..., :0]
    edges = np.sort(np.concatenate([ends, np.where(np.isnan(extrema), high, extrema)], axis=-1), axis=-1)
    values = evaluate(coefficients, edges)
    signs = np.sign(values)
    left, right = edges[..., :-1], edges[..., 1:]
    crosses = signs[..., :-1] * signs[..., 1:] < 0
    # An extremum at zero but for rounding, from which no root is found on either side.
    touches = np.abs(values) <= TOUCHES * np.sum(np.abs(coefficients), axis=-1, keepdims=True)
    touches[..., :-1] &= ~crosses
    touches[..., 1:] &= ~crosses
    touches &= (edges > low) & (edges < high)
    found = np.where(touches[..., :-1], left, np.where(touches[..., 1:], right, np.nan))
    if crosses.any():
        owners = np.broadcast_to(coefficients[..., np.newaxis, :], (*crosses.shape, degree + 1))[crosses]
        found[crosses] = _bracketed(owners, left[crosses], right[crosses], signs[..., :-1][crosses])
    return np.sort(found, axis=-1)


def evaluate(coefficients: Array, x: Array) -> Array:
    """Values (..., m) of polynomials (..., n + 1), the constant first, at x (..., m)."""
    value = np.zeros_like(x)
    for coefficient in np.moveaxis(coefficients, -1, 0)[::-1]:
        value = value * x + coefficient[..., np.newaxis]
    return value


def _bracketed(coefficients: Array, left: Array, right: Array, left_sign: Array, iterations: int = 100) -> Array:
    """The only root (m) between left and right (m): Newton's steps, or halving where they would leave the bracket."""
    slopes = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
    x = 0.5 * (left + right)
    for _ in range(iterations):
        value, slope = evaluate(coefficients, x[:, np.newaxis])[:, 0], evaluate(slopes, x[:, np.newaxis])[:, 0]
        before = value * left_sign > 0
        left, right = np.where(before, x, left), np.where(before, right, x)
        middle = 0.5 * (left + right)
        newton = x - value / np.where(slope == 0, np.inf, slope)
        moved = np.where((newton > left) & (newton < right) & (value != 0), newton, middle)
        moved = np.where(value == 0, x, moved)
        if np.all(np.abs(moved - x) <= 4e-16 * (1.0 + np.abs(x))):
            return moved
        x = moved
    return x
