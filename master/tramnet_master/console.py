"""The terminal: what people read goes to standard error, what programs read to standard output."""

from rich.console import Console

people = Console(stderr=True, highlight=False)
programs = Console(highlight=False, soft_wrap=True)
