"""What a worker may take of its machine's memory: an evaluation that runs away ends its worker, not the root.

``RLIMIT_DATA`` counts what is allocated (heap and private mappings), so an allocation beyond it fails in the
evaluation that asks for it. ``RLIMIT_AS`` would count what is only reserved as well, which the compiler of kernels
does by the gigabyte. Without a limit, the kernel ends somebody when the memory is used up: workers first.
"""

import contextlib
import resource
from pathlib import Path

MIB = 2**20
_PREFERENCE = "500"  # of -1000 to 1000; the processes of a user have 0
_SCORE = Path("/proc/self/oom_score_adj")


def be_first_to_go(limit: int) -> None:
    """Limit the memory of this process, and let it be ended before others where there is none left.

    Args:
        limit: What it may allocate [MiB], or 0 for any.
    """
    if limit:
        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        wanted = limit * MIB if most == resource.RLIM_INFINITY else min(limit * MIB, most)
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, most))
    with contextlib.suppress(OSError):  # no such file where the system is not Linux
        _SCORE.write_text(_PREFERENCE)
