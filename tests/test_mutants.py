import subprocess

import pytest
from benchmarks import mutants


@pytest.mark.parametrize("mutant", mutants.all_mutants(), ids=lambda mutant: mutant.path.stem)
def test_every_mutant_can_be_made_of_this_tree_and_names_tests_that_exist(mutant):
    check = ["git", "apply", "--check", str(mutant.path)]
    said = subprocess.run(check, cwd=mutants.HERE, capture_output=True, text=True, check=False)
    assert said.stderr == ""
    for test in mutant.tests:
        assert (mutants.HERE / test.partition("::")[0]).exists()


def test_a_patch_that_nobody_notices_is_told_of(tmp_path):
    patch = tmp_path / "harmless.patch"
    patch.write_text(
        "Promise: none\nTests: tests/protocol/test_tokens.py\n\n"
        "--- a/README.md\n+++ b/README.md\n@@ -1 +1 @@\n-# tramnet\n+# Tramnet\n"
    )

    assert mutants.failed_test(mutants.Mutant.read(patch)) is None


def test_a_patch_that_is_noticed_names_the_test(tmp_path):
    patch = tmp_path / "harmful.patch"
    patch.write_text(
        "Promise: tokens\nTests: tests/protocol/test_tokens.py\n\n"
        "--- a/protocol/tramnet_protocol/tokens.py\n+++ b/protocol/tramnet_protocol/tokens.py\n"
        "@@ -1 +1 @@\n-"
        + (mutants.HERE / "protocol/tramnet_protocol/tokens.py").read_text().split("\n")[0]
        + "\n+raise RuntimeError\n"
    )

    noticed = mutants.failed_test(mutants.Mutant.read(patch))

    assert noticed is not None
    assert noticed.startswith("tests/protocol/test_tokens.py")
