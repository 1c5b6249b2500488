import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and scores are Linux's own")

GREEDY = """
from pathlib import Path
import numpy as np
from tramnet_workers.node.memory import be_first_to_go
be_first_to_go({limit})
print(Path("/proc/self/oom_score_adj").read_text().strip())
try:
    np.empty(2**28)  # 2 GiB
except MemoryError:
    print("refused")
"""


def told(limit: int) -> list[str]:
    words = [sys.executable, "-c", GREEDY.format(limit=limit)]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()


def test_an_allocation_beyond_the_limit_fails_where_it_is_asked_for():
    assert told(1000) == ["500", "refused"]


def test_without_a_limit_a_worker_is_only_the_first_to_go():
    assert told(0) == ["500"]
