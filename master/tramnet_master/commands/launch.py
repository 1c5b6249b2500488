"""From an experiment to a finished run folder: what all `tramnet run` commands have in common."""

import datetime
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tramnet_master.errors import InvalidOption
from tramnet_master.experiments.experiment import Experiment
from tramnet_master.experiments.run_options import RunOptions
from tramnet_master.progress import ProgressMode, QuietProgress, open_progress
from tramnet_master.results import Result
from tramnet_master.run_folder import OpenRunFolder, default_folder

RUNS = Path("runs")
"""Where run folders go whose user named none."""


@dataclass(frozen=True)
class Presentation:
    """What a run shows and where it keeps what it found.

    Attributes:
        out: The run folder, or None for a new one.
        overwrite: Whether a run that is there gives way.
        pictures: Whether the figures are drawn.
        progress: ``auto``, ``quiet`` or ``json``.
    """

    out: Path | None
    overwrite: bool
    pictures: bool
    progress: str

    @property
    def mode(self) -> ProgressMode:
        """How progress is shown.

        Raises:
            InvalidOption: There is no such way.
        """
        try:
            return ProgressMode(self.progress)
        except ValueError as error:
            known = ", ".join(ProgressMode)
            raise InvalidOption("--progress", self.progress, f"one of {known}") from error


def launch(
    prepare: Callable[[], Experiment], options: RunOptions, presentation: Presentation
) -> None:
    """Make a run from the beginning."""
    experiment = prepare()

    def open_folder(document: dict[str, object]) -> OpenRunFolder:
        path = presentation.out
        if path is None:
            today = datetime.datetime.now().astimezone().date()
            path = default_folder(RUNS, experiment.name, today)
        return OpenRunFolder.create(path, document, presentation.overwrite)

    from tramnet_master.experiments.runner import run  # noqa: PLC0415  slow to import

    mode = presentation.mode
    folder, _ = run(experiment, options, open_folder, open_progress(mode), prepare)
    show(folder, presentation.pictures, mode)


def make_run(experiment: Experiment, options: RunOptions, folder: Path, overwrite: bool) -> Result:
    """Make a run that shows nothing and draws nothing; return its result."""
    from tramnet_master.experiments.runner import run  # noqa: PLC0415

    _, result = run(
        experiment,
        options,
        lambda document: OpenRunFolder.create(folder, document, overwrite),
        QuietProgress(),
    )
    return result


def go_on(
    prepare: Callable[[], Experiment],
    options: RunOptions,
    folder: Path,
    presentation: Presentation,
) -> None:
    """Go on with a run that was not finished."""
    from tramnet_master.experiments.runner import run  # noqa: PLC0415

    mode = presentation.mode
    resume = lambda _: OpenRunFolder.resume(folder)  # noqa: E731
    run(prepare(), options, resume, open_progress(mode), prepare)
    show(folder, presentation.pictures, mode)


def show(folder: Path, pictures: bool, mode: ProgressMode) -> None:
    """Draw the figures of a finished run and print its summary."""
    if pictures:
        from tramnet_master.reports.figures import write_figures  # noqa: PLC0415  slow to import

        write_figures(folder)
    if mode is ProgressMode.AUTO:
        from tramnet_master.reports.summary import print_summary  # noqa: PLC0415

        print_summary(folder)
