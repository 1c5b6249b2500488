"""What the kernels compute on this machine, as one hash.

Two machines with the same fingerprint give the same bits; a processor, compiler or version that
rounds anything differently shows here, before its answers are mixed with those of others.
"""

import hashlib

import numpy as np
from numpy.typing import NDArray

from tramnet_workers.kernels import kernel
from tramnet_workers.kernels.dynamics import ARM_COLUMNS, LANES, inverse_dynamics_batch
from tramnet_workers.kernels.random import (
    Stream,
    below,
    gaussian,
    new_stream,
    next_word,
    open_stream,
    uniform,
)
from tramnet_workers.kernels.transforms import atan2, log, sincos

_SEED = 560
_SAMPLES = 1000
_JOINTS = 6
_STATES = 3 * LANES + 1  # whole blocks, and one that is padded


def kernel_fingerprint() -> str:
    """Return the SHA-256 of the kernels' outputs on fixed inputs, as 64 hexadecimal digits."""
    stream = new_stream()
    digest = hashlib.sha256(_words(stream).astype("<u8").tobytes())
    digest.update(_elementary(stream).astype("<f8").tobytes())
    digest.update(_torques(stream).astype("<f8").tobytes())
    return digest.hexdigest()


@kernel
def _words(stream: Stream) -> NDArray[np.uint64]:
    open_stream(stream, _SEED, 1, 2, 3, 4)
    words = np.empty((_SAMPLES, 2), np.uint64)
    for k in range(_SAMPLES):
        words[k, 0] = next_word(stream)
        words[k, 1] = np.uint64(below(stream, k + 1))
    return words


@kernel
def _elementary(stream: Stream) -> NDArray[np.float64]:
    open_stream(stream, _SEED, 0, 0, 0, 1)
    values = np.empty((_SAMPLES, 5))
    for k in range(_SAMPLES):
        angle = (uniform(stream) - 0.5) * k * k
        values[k, 0], values[k, 1] = sincos(angle)
        values[k, 2] = atan2(uniform(stream) - 0.5, uniform(stream) - 0.5)
        values[k, 3] = log(uniform(stream) + 0.25)
        values[k, 4] = gaussian(stream)
    return values


@kernel
def _torques(stream: Stream) -> NDArray[np.float64]:
    """Return torques of an arm whose numbers mean nothing, but use every term."""
    open_stream(stream, _SEED, 0, 0, 0, 2)
    arm = _uniforms(stream, _JOINTS, ARM_COLUMNS)
    gravity = _uniforms(stream, 1, 3)[0]
    q = 6.0 * _uniforms(stream, _STATES, _JOINTS)
    qd = _uniforms(stream, _STATES, _JOINTS)
    qdd = _uniforms(stream, _STATES, _JOINTS)
    return inverse_dynamics_batch(arm, gravity, q, qd, qdd)


@kernel
def _uniforms(stream: Stream, rows: int, columns: int) -> NDArray[np.float64]:
    values = np.empty((rows, columns))
    for i in range(rows):
        for j in range(columns):
            values[i, j] = uniform(stream) - 0.5
    return values
