"""The look of tables in the terminal."""

from rich import box
from rich.table import Table
from rich.text import Text


def new_table(title: str, caption: str = "") -> Table:
    """An empty table with a title above it and, perhaps, words below."""
    return Table(
        title=Text(title), caption=Text(caption) if caption else None,
        title_justify="left", caption_justify="left", title_style="bold", caption_style="",
        box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0),
    )  # fmt: skip
