import pytest
import typer

from tramnet_master import tracking_times
from tramnet_master.cli import app, run
from tramnet_master.tracking_times import MethodTime


@pytest.fixture(autouse=True)
def private_runtime_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "200")


def test_the_version_is_shown(capsys):
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("tramnet 0.")


def test_the_installed_problems_are_listed(capsys):
    assert run(["problems"]) == 0
    assert {"sphere", "puma560-smooth"} <= set(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["scale", "2"], "none is live here"),
        (["inspect", "--once", "--network", "alpha"], "network 'alpha': not found"),
        (["inspect", "--sort", "speed"], "bytes_per_s"),
        (["inspect", "--filter", "speed>3"], "utilisation"),
        (["inspect", "--show", "topics"], "topics come with --sniff"),
        (["inspect", "--csv", "--show", "trams,links"], "one table for --csv"),
        (["echo", "--tag", "shout"], "one of evaluate"),
        (["record", "a.mcap", "--arrays", "some"], "base64"),
        (["traffic", "nowhere.mcap"], "no such file"),
        (["run", "problem", "sphere", "--observers", "tcp/127.0.0.1:1"], "a protocol of its own"),
        (
            ["run", "problem", "sphere", "--observers", "ws/127.0.0.1:1", "--tls", "x"],
            "beside --tls",
        ),
        (["resume", "nowhere"], "no such folder"),
        (["report", "nowhere"], "nowhere"),
        (["table", "puma560", "--cases", "8"], "cases between 1 and 7"),
        (["table", "juggling"], "juggling"),
        (["run", "problem", "sphere", "--set", "dimension"], "expected NAME=VALUE"),
        (["run", "problem", "sphere", "--set", "size=3"], "size"),
        (["run", "problem", "sphere", "--on-failure", "cry"], "penalise, retry or stop"),
        (["run", "problem", "sphere", "--progress", "loud"], "quiet"),
        (["run", "problem", "sphere", "--network", "a/b"], "letters, digits"),
        (["run", "problem", "sphere", "--topology", "moebius"], "expected one of star"),
        (["run", "problem", "sphere", "--workers", "-1"], "--workers"),
    ],
)
def test_bad_input_is_refused_in_words_with_exit_code_2(words, said, capsys, tmp_path):
    if words[0] == "run":
        words = [*words, "--out", str(tmp_path / "run")]

    assert run(words) == 2
    assert said in capsys.readouterr().err


def test_every_option_can_come_from_the_environment(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("TRAMNET_OUT", str(tmp_path / "run"))
    monkeypatch.setenv("TRAMNET_NETWORK", "not a name")

    assert run(["run", "problem", "sphere"]) == 2
    assert "not a name" in capsys.readouterr().err


RUNS = [["run", name] for name in ("crank", "problem", "puma560", "redundant8")]


@pytest.mark.parametrize("words", [*RUNS, ["worker"], ["inspect"], ["status"]], ids=" ".join)
def test_each_option_has_its_environment_variable(words):
    command = typer.main.get_command(app)
    for word in words:
        command = command.commands[word]
    options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]

    assert len(options) > 3
    for option in options:
        name = max(option.opts, key=len).removeprefix("--").replace("-", "_").upper()
        assert option.envvar == f"TRAMNET_{name}"


def test_several_settings_come_from_the_environment_with_spaces_between(monkeypatch, capsys):
    monkeypatch.setenv("TRAMNET_SET", "dimension=2 size=3")

    assert run(["run", "problem", "sphere"]) == 2
    assert "size" in capsys.readouterr().err


def test_a_run_file_that_was_altered_is_refused(tmp_path, capsys):
    (tmp_path / "run.toml").write_text('experiment = "juggling"\n')

    assert run(["resume", str(tmp_path)]) == 2
    assert "'juggling'" in capsys.readouterr().err


def test_the_times_of_a_paper_s_table_are_printed_beside_ours(monkeypatch, capsys):
    times = [MethodTime("EAMP 500/10", 0.0005, 5480, 1000, None)]
    monkeypatch.setattr(tracking_times, "measure_methods", lambda task, told: times)

    assert run(["table", "redundant8"]) == 0
    said = capsys.readouterr().err
    (row,) = (line for line in said.splitlines() if "EAMP 500/10 " in line)
    assert row.split() == ["EAMP", "500/10", "78", "244", "48", "398", "0.5", "156"]
    assert "The paper's 398 is against the naive search" in said
