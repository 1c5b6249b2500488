"""What every command loads before it does anything: a health check is one, many times an hour."""

import subprocess
import sys

HEAVY = {"cma", "llvmlite", "matplotlib", "mcap", "numba", "pinocchio", "scipy", "simpy"}


def test_the_command_line_loads_nothing_that_only_some_commands_need():
    code = "import sys, tramnet_master.cli; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = set(run.stdout.split())

    assert "tramnet_master.cli" in loaded
    assert not HEAVY & loaded
