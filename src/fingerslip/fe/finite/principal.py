"""Principal values and directions of symmetric tensors in 3D: Jacobi's rotations, for many points at once.

A rotation costs two roots and two quotients. In a loop over points, which are lanes of an array, the compiler takes
several at a time, as many as the processor's vectors hold.
"""

from __future__ import annotations

import numba
import numpy as np

__all__ = ["LANES", "ROWS", "diagonalise"]

# Points at once; rows of the array: the tensor's components, then the components of its three directions.
LANES, ROWS = 64, 15
_XX, _YY, _ZZ, _XY, _XZ, _YZ, _FIRST, _SECOND, _THIRD = 0, 1, 2, 3, 4, 5, 6, 9, 12
_SWEEPS = 30
# Far below the square root of the least number: keeps 0/0 away.
_NOTHING = 1e-150


# Compiled with NumPy's errors, because a check for a quotient by zero would part the lanes.
@numba.njit(cache=True, nogil=True, error_model="numpy")
def diagonalise(lanes):  # type: ignore[no-untyped-def]
    """Turn tensors into their principal values, and fill in their directions.

    In `lanes` (15, LANES) rows 0 to 2 are xx, yy, zz and become the principal values, rows 3 to 5 are xy, xz, yz and
    become zero; rows 6 to 8 take the components of the first direction, and so on. What is no number stays so.
    """
    for row in range(_FIRST, ROWS):
        lanes[row] = 1.0 if row in {_FIRST, _SECOND + 1, _THIRD + 2} else 0.0
    for _ in range(_SWEEPS):
        turning = False
        for lane in range(LANES):
            beside = lanes[_XY, lane] ** 2 + lanes[_XZ, lane] ** 2 + lanes[_YZ, lane] ** 2
            along = lanes[_XX, lane] ** 2 + lanes[_YY, lane] ** 2 + lanes[_ZZ, lane] ** 2
            # Smaller than rounding of the eigenvalues by far, as their squares.
            turning |= beside > 1e-40 * along
        if not turning:
            return
        _rotate(lanes, _XX, _YY, _XY, _XZ, _YZ, _FIRST, _SECOND)
        _rotate(lanes, _XX, _ZZ, _XZ, _XY, _YZ, _FIRST, _THIRD)
        _rotate(lanes, _YY, _ZZ, _YZ, _XY, _XZ, _SECOND, _THIRD)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _rotate(lanes, column, other, beside, left, right, first, second):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Take the component `beside` to zero by a rotation in the plane of the axes `one` and `other`.

    `left` and `right` are the components that both have with the third axis, `first` and `second` their directions.
    """
    for lane in range(LANES):
        shear = lanes[beside, lane]
        apart = lanes[other, lane] - lanes[column, lane]
        doubled = 2.0 * shear if apart >= 0.0 else -2.0 * shear
        tangent = doubled / (np.abs(apart) + np.sqrt(apart * apart + doubled * doubled) + _NOTHING)
        cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
        sine = tangent * cosine
        lanes[column, lane] -= tangent * shear
        lanes[other, lane] += tangent * shear
        lanes[beside, lane] = 0.0
        near, far = lanes[left, lane], lanes[right, lane]
        lanes[left, lane], lanes[right, lane] = cosine * near - sine * far, sine * near + cosine * far
        for i in range(3):
            near, far = lanes[first + i, lane], lanes[second + i, lane]
            lanes[first + i, lane], lanes[second + i, lane] = cosine * near - sine * far, sine * near + cosine * far
