"""The example of docs/writing-a-problem.md, as a user would install it."""

import re
from pathlib import Path

import pytest
from packages import install

pytestmark = pytest.mark.system

DOCUMENT = Path(__file__).parents[2] / "docs" / "writing-a-problem.md"


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Installs the example, entry point included."""
    ((name, target),) = re.findall(r'^(\S+) = "(.*)"$', block("toml"), re.MULTILINE)
    module, builder = target.split(":")
    assert module == name
    install(tmp_path, monkeypatch, module, block("python"), builder)


def test_the_problem_of_the_documentation_is_listed_and_solved(installed, start):
    listing = start("problems")
    assert listing.finish() == 0
    assert "reach" in listing.output.split()

    result = start("run", "problem", "reach", "--set", "x=0.5", "--workers", 2).result()

    assert result["problem"] == "reach"
    assert result["best"]["objective"] < 0.01
    assert len(result["genome"]) == 4
