"""The container files, without an engine: that they hang together, and that their commands exist."""

import re
import shlex
from pathlib import Path

import pytest
import typer
import yaml

from tramnet_master.cli import app

ROOT = Path(__file__).parents[2]
COMPOSE = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
SERVICES = COMPOSE["services"]
DOCKERFILES = sorted({service["build"]["dockerfile"] for service in SERVICES.values()})


def parse(words: list[str]) -> str:
    """Parse a command line of tramnet and return the name of its last command; bad options raise."""
    command = typer.main.get_command(app)
    context = command.make_context("tramnet", list(words))
    while hasattr(command, "resolve_command"):
        rest = [*context._protected_args, *context.args]
        name, command, rest = command.resolve_command(context, rest)
        context = command.make_context(name, rest, parent=context)
    return context.info_name


@pytest.mark.parametrize("name", SERVICES)
def test_the_command_of_each_service_is_a_valid_command_line(name):
    assert parse(SERVICES[name]["command"]) in ("puma560", "worker", "inspect")


def test_an_invalid_command_line_would_be_noticed():
    with pytest.raises(typer.BadParameter.__base__, match="no-such-option"):
        parse(["run", "puma560", "--no-such-option"])


@pytest.mark.parametrize("dockerfile", DOCKERFILES)
def test_everything_an_image_copies_exists(dockerfile):
    lines = (ROOT / dockerfile).read_text().splitlines()
    copies = [shlex.split(line) for line in lines if line.startswith("COPY ")]
    sources = [
        source for words in copies if not words[1].startswith("--from=") for source in words[1:-1]
    ]

    assert {"protocol", "workers", "master", "pyproject.toml"} <= set(sources)
    assert [source for source in sources if not (ROOT / source).exists()] == []


@pytest.mark.parametrize("dockerfile", DOCKERFILES)
def test_images_do_not_run_as_root_and_start_tramnet(dockerfile):
    text = (ROOT / dockerfile).read_text()

    assert re.search(r"^USER tramnet$", text, re.MULTILINE)
    assert re.search(r'^ENTRYPOINT \["tramnet"\]$', text, re.MULTILINE)


def test_addresses_come_from_the_environment_alone_and_meet():
    listen = SERVICES["root"]["environment"]["TRAMNET_LISTEN"]
    connect = SERVICES["worker"]["environment"]["TRAMNET_CONNECT"]

    assert listen.rpartition(":")[2] == connect.rpartition(":")[2]
    assert connect.startswith("tcp/root:")
    for service in SERVICES.values():
        assert not any("tcp/" in word for word in service["command"])
