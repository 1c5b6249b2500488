"""What is to happen and when, in whole nanoseconds of virtual time: a simpy environment for functions."""

from collections.abc import Callable
from typing import TypeVar

Value = TypeVar("Value")

SECOND = 1_000_000_000
"""Nanoseconds in a second."""


class Agenda:
    """Calls functions at their times; at equal times, those that were planned first come first."""

    def __init__(self) -> None:
        import simpy  # noqa: PLC0415  every command reads this file, and few plan anything

        self._env = simpy.Environment()

    @property
    def now(self) -> int:
        """Virtual time [ns]."""
        return int(self._env.now)

    def after(self, delay: int, act: Callable[[Value], None], value: Value) -> None:
        """Call a function with a value later.

        Args:
            delay: How much later [ns]; 0 is after all that was planned for now before.
            act: The function.
            value: Its argument.
        """
        callbacks = self._env.timeout(delay).callbacks
        assert callbacks is not None, "an event to come has its list of callbacks"
        callbacks.append(lambda _: act(value))

    def run(self) -> None:
        """Go on until nothing is planned any more."""
        self._env.run()
