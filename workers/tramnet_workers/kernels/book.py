"""The book of a block of trajectories: where each number stands, for ``kernels.motion`` and its parts.

States stand side by side in lanes, as in ``kernels.dynamics``. Page j belongs to node j and to the
segment that begins there. Its rows are the joints, once for each posture at which torques are
bounded; what does not depend on the posture is repeated. The last row is what is known of all joints
together. Columns are LANES wide: element ``[j, row, COLUMN + lane]``.

All this stands in one array, into which all functions index, for two reasons. LLVM vectorises a loop
over lanes only if it can tell that no lane reads what another one writes; columns at constant
distances in one row tell it. And every array that an inlined function takes, and every view of one,
counts references with two locked instructions: with an array for each thing, that was a fifth of
the time of an evaluation.
"""

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import device, kernel
from tramnet_workers.kernels.dynamics import LANES

Book = NDArray[np.float64]

# Columns of a joint.
ANGLE = 0  # [rad]
SINE = LANES
COSINE = 2 * LANES
A = 3 * LANES  # the torque at x = 1 / h is A x^2 + 2 B x + C [N m]
B = 4 * LANES
C = 5 * LANES
GAP_START = 6 * LANES  # the torque is out of bounds between these x [1/s]
GAP_END = 7 * LANES
SLOPE = 8 * LANES  # scratch of the brake rule, which also uses the two columns of the gap
NODE = 9 * LANES  # angle at the node [rad]
STEP = 10 * LANES  # displacement D to the next node [rad]
RATE = 11 * LANES  # velocity v at the node [rad/s]

# Columns of the last row.
LOW = 0  # range of allowed x [1/s]
TOP = LANES
CHOSEN = 2 * LANES  # the x chosen [1/s]
BRAKING = 3 * LANES  # x of the brake rule [1/s]
SHARE = 4 * LANES  # how far to accelerate rather than brake, in [0, 1]
OUTSIDE = 5 * LANES  # least x that keeps all joints in their range, where CHOSEN does not; else 0
SUM = 6 * LANES  # scratch
TIME = 7 * LANES  # since the start, at the node [s]
IMPULSE = 8 * LANES  # since the start, at the node [s]
FAILED = 9 * LANES  # 1 from the first node on that cannot be reached, else 0
LOST = 10 * LANES  # 1 if no x is allowed, else 0

COLUMNS = 12 * LANES

# Rows of the limits of the joints.
TORQUE = 0  # bound in either direction [N m]
VELOCITY = 1  # bound in either direction [rad/s]; may be inf
LOWER = 2  # smallest angle [rad]; may be -inf
UPPER = 3  # largest angle [rad]; may be inf
LIMIT_ROWS = 4


@kernel
def new_book(segments: int, n_joints: int, n_postures: int) -> Book:
    """Return an empty book, of shape (segments + 1, n_postures * n_joints + 1, COLUMNS)."""
    return np.zeros((segments + 1, n_postures * n_joints + 1, COLUMNS))


@device
def n_segments(book: Book) -> int:
    """Return the number of segments."""
    return int(book.shape[0]) - 1


@device
def last_row(book: Book) -> int:
    """Return the index of the row of all joints together; the number of rows before it."""
    return int(book.shape[1]) - 1
