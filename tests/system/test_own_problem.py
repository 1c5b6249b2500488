"""The example of docs/writing-a-problem.md, as a user would install it."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.system

DOCUMENT = Path(__file__).parents[2] / "docs" / "writing-a-problem.md"


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Puts the example where Python finds installed packages, entry point included."""
    site = tmp_path / "site"
    (site / "reach-1.0.dist-info").mkdir(parents=True)
    (site / "reach.py").write_text(block("python"))
    (site / "reach-1.0.dist-info" / "METADATA").write_text("Name: reach\nVersion: 1.0\n")
    name, target = re.findall(r'^(\S+) = "(.*)"$', block("toml"), re.MULTILINE)[0]
    (site / "reach-1.0.dist-info" / "entry_points.txt").write_text(
        f"[tramnet.problems]\n{name} = {target}\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=":")


def test_the_problem_of_the_documentation_is_listed_and_solved(installed, start):
    listing = start("problems")
    assert listing.finish() == 0
    assert "reach" in listing.output.split()

    result = start("run", "problem", "reach", "--set", "x=0.5", "--workers", 2).result()

    assert result["problem"] == "reach"
    assert result["best"]["objective"] < 0.01
    assert len(result["genome"]) == 4
