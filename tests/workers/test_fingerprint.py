"""The fingerprint of what the kernels compute on this machine."""

import os
import re
import subprocess
import sys

from tramnet_workers.kernels import fingerprint
from tramnet_workers.kernels.fingerprint import kernel_fingerprint

# What every processor, vector width and optimisation gave so far. It changes with the kernels'
# arithmetic alone; results of runs then differ from those of earlier versions.
KNOWN = "c425ca0d08e4cfed2dee522a48b07a9ace016d76e4ac9e593e080fca6d4266a7"

PRINT_FINGERPRINT = "from tramnet_workers.kernels import fingerprint as f; print(f.{expression})"


def in_a_fresh_process(expression: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", PRINT_FINGERPRINT.format(expression=expression)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def test_the_fingerprint_is_a_sha_256_in_hexadecimal() -> None:
    assert re.fullmatch("[0-9a-f]{64}", kernel_fingerprint())


def test_the_fingerprint_is_the_same_every_time() -> None:
    assert kernel_fingerprint() == kernel_fingerprint()


def test_the_fingerprint_is_the_one_of_all_known_machines() -> None:
    assert kernel_fingerprint() == KNOWN


def test_python_itself_computes_the_same_bits_as_the_compiled_kernels() -> None:
    assert in_a_fresh_process("kernel_fingerprint()", NUMBA_DISABLE_JIT="1") == KNOWN


def test_the_smallest_processor_computes_the_same_bits_as_this_one() -> None:
    """The generic target has the shortest vectors, so other instructions do the same work."""
    found = in_a_fresh_process(
        "kernel_fingerprint()", NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES=""
    )

    assert found == KNOWN


def test_a_single_different_bit_changes_the_fingerprint(monkeypatch) -> None:
    elementary = fingerprint._elementary

    def one_bit_off(stream):
        values = elementary(stream)
        values.view("u8")[500, 2] ^= 1
        return values

    monkeypatch.setattr(fingerprint, "_elementary", one_bit_off)

    assert kernel_fingerprint() != KNOWN


def test_the_kernels_do_not_load_pinocchio() -> None:
    loaded = in_a_fresh_process("kernel_fingerprint() and 'pinocchio' in __import__('sys').modules")

    assert loaded == "False"
