"""Errors of the workers, each saying what was found and what was expected.

* WorkersError
  x InvalidTask: a field of a task that no robot can carry out
  x InvalidParameters: a problem or an algorithm with a setting that makes no sense
  x UnknownProblem: a problem of a name that is not installed
  x BrokenProblem: an installed problem that cannot be loaded
  x UnsuitableWork: work that does not fit the worker's problem
  x WrongResult: a problem returned something that is no column of objectives
"""

from collections.abc import Iterable


class WorkersError(Exception):
    """Anything that is wrong with what a worker was asked to compute."""


class InvalidTask(WorkersError):
    """A field of a task is wrong.

    Attributes:
        field: Name of the field, with an index where one element is meant: ``start[2]``.
        found: What stands there.
        expected: What should stand there.
    """

    def __init__(self, field: str, found: str, expected: str) -> None:
        self.field, self.found, self.expected = field, found, expected
        super().__init__(f"{field}: found {found}, expected {expected}")


class InvalidParameters(WorkersError):
    """The parameters of a problem or the settings of an algorithm are wrong.

    Attributes:
        owner: Name of the problem or algorithm.
        reason: What was found and what was expected.
    """

    def __init__(self, owner: str, reason: str) -> None:
        self.owner, self.reason = owner, reason
        super().__init__(f"parameters of {owner}: {reason}")


class UnknownProblem(WorkersError):
    """No problem of this name is installed.

    Attributes:
        name: The name that was asked for.
        known: The names that would work.
    """

    def __init__(self, name: str, known: Iterable[str]) -> None:
        self.name, self.known = name, tuple(sorted(known))
        super().__init__(f"no problem is named {name!r}; installed are {', '.join(self.known)}")


class BrokenProblem(WorkersError):
    """A problem is registered but what its entry point names cannot be used.

    Attributes:
        name: Name of the problem.
        target: What the entry point names, ``module:attribute``.
        reason: What went wrong.
    """

    def __init__(self, name: str, target: str, reason: str) -> None:
        self.name, self.target, self.reason = name, target, reason
        super().__init__(f"problem {name!r} ({target}) cannot be used: {reason}")


class UnsuitableWork(WorkersError):
    """The work does not fit this worker's problem.

    Attributes:
        problem: Name of the problem.
        found: What the work asks for.
        expected: What the problem can do.
    """

    def __init__(self, problem: str, found: str, expected: str) -> None:
        self.problem, self.found, self.expected = problem, found, expected
        super().__init__(f"work for {problem}: found {found}, expected {expected}")


class WrongResult(WorkersError):
    """A problem returned something that is no column of objectives.

    Attributes:
        problem: Name of the problem.
        found: Element type and shape of what it returned.
        expected: Element type and shape of what was asked for.
    """

    def __init__(
        self, problem: str, found: tuple[str, tuple[int, ...]], expected: tuple[int, ...]
    ) -> None:
        self.problem, self.found, self.expected = problem, found, ("float64", expected)
        super().__init__(
            f"result of {problem}: found {found[0]} of shape {found[1]}, "
            f"expected float64 of shape {expected}"
        )
