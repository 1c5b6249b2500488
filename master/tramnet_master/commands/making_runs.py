"""What all `tramnet run` commands share: how a run is made and what it shows, in options of one meaning."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import fields
from typing import Annotated, NamedTuple

import msgspec
import typer

from tramnet_master import options as words
from tramnet_master.commands.launch import Presentation, launch
from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.experiments.run_options import RunOptions

Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        envvar="TRAMNET_SET",
        help="A setting of the method or problem; may be repeated, or with spaces between in the environment.",
    ),
]

_SHOWN = inspect.Parameter.KEYWORD_ONLY
_PRESENTATION = {
    "out": (words.Out, None),
    "overwrite": (words.Overwrite, False),
    "pictures": (words.Pictures, True),
    "progress": (words.Progress, "auto"),
}


class _Shared(NamedTuple):
    parameters: list[inspect.Parameter]
    farm: tuple[str, ...]


def _shared() -> _Shared:
    farm = {
        field.name: (getattr(words, _alias(field.name)), field.default)
        for field in fields(RunOptions)
    }
    parameters = [
        inspect.Parameter(name, _SHOWN, default=default, annotation=annotation)
        for name, (annotation, default) in {**farm, **_PRESENTATION}.items()
    ]
    return _Shared(parameters, tuple(farm))


def _alias(name: str) -> str:
    """Name of the option in ``options.py``: ``FirstDeadline`` for ``first_deadline``."""
    return "".join(word.capitalize() for word in name.split("_"))


def makes_a_run(prepare: Callable[..., Experiment]) -> Callable[..., None]:
    """Make a command of a function that prepares an experiment.

    Args:
        prepare: Takes the options of its own; its docstring is the command's help.

    Returns:
        A command that takes these and the shared options, and makes the run.
    """
    own = inspect.signature(prepare, eval_str=True)
    shared = _shared()

    @functools.wraps(prepare)
    def command(**values: object) -> None:
        farm = RunOptions(**{name: values.pop(name) for name in shared.farm})  # type: ignore[arg-type]
        shown = Presentation(**{name: values.pop(name) for name in _PRESENTATION})  # type: ignore[arg-type]
        launch(functools.partial(prepare, **values), farm, shown)

    mine = [parameter.replace(kind=_SHOWN) for parameter in own.parameters.values()]
    signature = inspect.Signature([*mine, *shared.parameters])
    command.__signature__ = signature  # type: ignore[attr-defined]  # what typer reads
    command.__annotations__ = {p.name: p.annotation for p in signature.parameters.values()}
    return command


def read_settings(settings: list[str] | None) -> dict[str, object]:
    """Return ``NAME=VALUE`` words as plain values: a number, true, false, a JSON list, or else a word.

    Raises:
        InvalidOption: A word has no ``=``.
    """
    values: dict[str, object] = {}
    for setting in settings or []:
        name, equals, text = setting.partition("=")
        if not (name and equals):
            raise InvalidOption("--set", repr(setting), "NAME=VALUE")
        try:
            values[name] = msgspec.json.decode(text)
        except msgspec.DecodeError:
            values[name] = text
    return values
