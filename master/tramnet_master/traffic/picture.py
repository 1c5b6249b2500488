"""A view of the terminal as an SVG picture, without anything that is loaded from elsewhere."""

import io
import re
from pathlib import Path

from rich.console import Console, RenderableType
from rich.terminal_theme import TerminalTheme

from tramnet_master.files import write_atomically

TITLE = "tramnet inspect"
FONT = "DejaVu Sans Mono, Menlo, Consolas, monospace"

_THEME = TerminalTheme(
    (255, 255, 255),
    (36, 41, 47),
    [
        (36, 41, 47), (180, 30, 30), (20, 120, 60), (130, 90, 0),
        (0, 80, 180), (140, 50, 140), (0, 115, 130), (90, 98, 107),
    ],
)  # fmt: skip
_FONT_FACES = re.compile(r"@font-face \{.*?\}\s*", re.DOTALL)


def write_picture(path: Path, view: RenderableType, width: int) -> None:
    """Write a view as it stands in a terminal of so many columns.

    Raises:
        CannotWrite: The disk refuses.
    """
    console = Console(
        record=True, width=width, file=io.StringIO(), force_terminal=True, highlight=False,
        color_system="standard",
    )  # fmt: skip
    console.print(view)
    picture = console.export_svg(title=TITLE, theme=_THEME, unique_id="tramnet")
    picture = _FONT_FACES.sub("", picture).replace("Fira Code", FONT)
    picture = picture.replace("<text ", '<text xml:space="preserve" ')  # some drop blanks in front
    write_atomically(path, picture.encode())
