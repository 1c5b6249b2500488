"""What an arm is to be designed for: the task of ``crank``, checked once, here.

Without arguments a ``DesignTask`` is the crank of Kim & Khosla (1992), section 2: a planar arm of three
links that turns a crank, with four task points on its circle. The paper's figure with the circle is
not in the text; centre, radius and joint limits are our choice. The switches for the variants that
the paper promises are fields as well: ``lengths`` (path placement and workspace design for a given
arm), ``mobility`` (mobile base) and ``strokes`` (prismatic joints).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from tramnet_workers.errors import InvalidTask
from tramnet_workers.mpga_settings import Weights
from tramnet_workers.problems.stock import Stock, shipped_stock
from tramnet_workers.problems.trajectory import Circle, Trajectory, trajectory_from

Floats = NDArray[np.float64]
Pair = tuple[float, float]
Box = tuple[float, float, float, float]

MOST_POINTS = 4096
MOST_LINKS = 8
_WEIGHTS = tuple(field.name for field in fields(Weights))


@dataclass(frozen=True)
class Base:
    """Where the arm stands.

    Attributes:
        free: Whether its place is to be found.
        position: Its place, if it is given [m].
        lower: Smallest coordinates, if it is free [m].
        upper: Largest coordinates [m].
    """

    free: bool = False
    position: Pair = (0.0, 0.0)
    lower: Pair = (-0.5, -0.5)
    upper: Pair = (0.5, 0.5)

    def __post_init__(self) -> None:
        for name in ("position", "lower", "upper"):
            _check_numbers(f"base.{name}", getattr(self, name), 2)
        for i in range(2):
            if self.free and not self.lower[i] < self.upper[i]:
                expected = f"less than base.upper[{i}] = {self.upper[i]}"
                raise InvalidTask(f"base.lower[{i}]", f"{self.lower[i]}", expected)


@dataclass(frozen=True)
class Genes:
    """Coding of the places of joints.

    Attributes:
        bits: Bits of a gene.
        lower: Smallest coordinate of a joint relative to the base [m].
        upper: Largest coordinate [m].
    """

    bits: int = 10
    lower: float = -1.2
    upper: float = 1.2

    def __post_init__(self) -> None:
        if (
            isinstance(self.bits, bool)
            or not isinstance(self.bits, int)
            or not 5 <= self.bits <= 16
        ):
            raise InvalidTask("genes.bits", f"{self.bits}", "a whole number from 5 to 16")
        _check_numbers("genes.lower", (self.lower,), 1)
        _check_numbers("genes.upper", (self.upper,), 1)
        if not self.lower < self.upper:
            raise InvalidTask(
                "genes.lower", f"{self.lower}", f"less than genes.upper = {self.upper}"
            )


@dataclass(frozen=True)
class Stroke:
    """A prismatic joint that extends a link.

    Attributes:
        link: The link, from 0 at the base.
        length: Longest extension [m].
        scale: Length that makes a stroke comparable to an angle in the Jacobian [m].
    """

    link: int
    length: float
    scale: float = 0.3


_CRANK = Circle((0.8, 0.4), 0.25)
_CRANK_LOWER = tuple(float(x) for x in np.deg2rad([-180.0, -150.0, -150.0]))
_CRANK_UPPER = tuple(float(x) for x in np.deg2rad([180.0, 150.0, 150.0]))


@dataclass(frozen=True)
class DesignTask:
    """A design task for a planar arm.

    Attributes:
        trajectory: Path of the tip.
        stations: Path parameters of the task points, ascending.
        lower: Smallest joint angles, one for each link [rad].
        upper: Largest joint angles [rad].
        weights: Weights of eq (4) by name that replace those of the settings.
        stock: Link modules for the prototype.
        base: Where the arm stands.
        genes: Coding of the places of joints.
        boxes: Obstacles as x_min, y_min, x_max, y_max [m].
        terms: Names of the user's task constraints.
        lengths: Link lengths of a given arm [m], or None if they are to be designed.
        mobility: How far the base may move between neighbouring points [m]; infinite for an
            omnidirectional base, None for one that stands still.
        strokes: Prismatic joints.
        most_returns: How often Progressive Design may go back to step 1.
    """

    trajectory: Trajectory = _CRANK
    stations: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75)
    lower: tuple[float, ...] = _CRANK_LOWER
    upper: tuple[float, ...] = _CRANK_UPPER
    weights: Mapping[str, float] = field(default_factory=dict)
    stock: Stock = field(default_factory=shipped_stock)
    base: Base = field(default_factory=Base)
    genes: Genes = field(default_factory=Genes)
    boxes: tuple[Box, ...] = ()
    terms: tuple[str, ...] = ()
    lengths: tuple[float, ...] | None = None
    mobility: float | None = None
    strokes: tuple[Stroke, ...] = ()
    most_returns: int = 3

    def __post_init__(self) -> None:
        self._check_stations()
        self._check_limits()
        check_weights(self.weights)
        self._check_arm()
        for i, box in enumerate(self.boxes):
            _check_numbers(f"boxes[{i}]", box, 4)
            if not (box[0] < box[2] and box[1] < box[3]):
                raise InvalidTask(f"boxes[{i}]", f"{box}", "x_min < x_max and y_min < y_max")

    @property
    def n_links(self) -> int:
        """Number n of links, each with a revolute joint at its beginning."""
        return len(self.lower)

    @property
    def points(self) -> Floats:
        """Task points, of shape (t, 2) [m]."""
        return np.array([self.trajectory.point(s) for s in self.stations])

    @property
    def extensions(self) -> Floats:
        """By how much prismatic joints can extend each link, of shape (n,) [m]."""
        found = np.zeros(self.n_links)
        for stroke in self.strokes:
            found[stroke.link] += stroke.length
        return found

    def parameters(self) -> dict[str, object]:
        """Return the task as plain values, for the wire and for run files."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "trajectory"}
        plain = {name: _plain(value) for name, value in values.items() if value is not None}
        return {"trajectory": self.trajectory.parameters(), **plain}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, object]) -> Self:
        """Rebuild a task from what ``parameters`` returned; what is left out has its default.

        Raises:
            InvalidTask: With the field, what was found and what was expected.
        """
        known = {f.name: f for f in fields(cls)}
        values: dict[str, object] = {}
        for name, value in parameters.items():
            if name not in known:
                raise InvalidTask(name, "a field of no task", f"one of {', '.join(sorted(known))}")
            if name == "trajectory":
                values[name] = trajectory_from(_mapping(name, value))
                continue
            try:
                values[name] = msgspec.convert(value, _TYPES[name])
            except msgspec.ValidationError as error:
                expected, _, place = f"{error}".replace("`", "").partition(" - at $")
                raise InvalidTask(name + place, f"{value!r}", expected) from error
        return cls(**values)  # type: ignore[arg-type]

    def _check_stations(self) -> None:
        if not 1 <= len(self.stations) <= MOST_POINTS:
            found = f"{len(self.stations)} points"
            raise InvalidTask("stations", found, f"1 to {MOST_POINTS} points")
        most = self.trajectory.length
        for i, s in enumerate(self.stations):
            inside = 0.0 <= s < most or (s == most and not self.trajectory.closed)
            if not inside or (i and not s > self.stations[i - 1]):
                expected = f"ascending path parameters from 0 to {most}"
                raise InvalidTask(f"stations[{i}]", f"{s}", expected)

    def _check_limits(self) -> None:
        if not 1 <= len(self.lower) <= MOST_LINKS:
            found = f"{len(self.lower)} numbers"
            raise InvalidTask("lower", found, f"1 to {MOST_LINKS} joint angles, one for each link")
        _check_numbers("lower", self.lower, len(self.lower))
        _check_numbers("upper", self.upper, len(self.lower))
        for i in range(len(self.lower)):
            if not self.lower[i] < self.upper[i]:
                expected = f"less than upper[{i}] = {self.upper[i]}"
                raise InvalidTask(f"lower[{i}]", f"{self.lower[i]}", expected)

    def _check_arm(self) -> None:
        if self.lengths is not None:
            _check_numbers("lengths", self.lengths, self.n_links)
            for i, length in enumerate(self.lengths):
                if not length > 0.0:
                    raise InvalidTask(f"lengths[{i}]", f"{length}", "a length above 0 m")
        if self.mobility is not None and not self.mobility >= 0.0:
            raise InvalidTask("mobility", f"{self.mobility}", "a distance of at least 0 m, or inf")
        if self.mobility is not None and not self.base.free:
            raise InvalidTask("base.free", "false", "true, for a base that moves")
        if not 0 <= self.most_returns <= 100:
            raise InvalidTask("most_returns", f"{self.most_returns}", "0 to 100")
        for i, stroke in enumerate(self.strokes):
            if not 0 <= stroke.link < self.n_links:
                expected = f"a link from 0 to {self.n_links - 1}"
                raise InvalidTask(f"strokes[{i}].link", f"{stroke.link}", expected)
            if not 0.0 < stroke.length < np.inf:
                raise InvalidTask(f"strokes[{i}].length", f"{stroke.length}", "a length above 0 m")
            if not 0.0 <= stroke.scale < np.inf:
                raise InvalidTask(
                    f"strokes[{i}].scale", f"{stroke.scale}", "a length, at least 0 m"
                )


_TYPES: Mapping[str, object] = {
    "stations": tuple[float, ...],
    "lower": tuple[float, ...],
    "upper": tuple[float, ...],
    "weights": dict[str, float],
    "stock": Stock,
    "base": Base,
    "genes": Genes,
    "boxes": tuple[Box, ...],
    "terms": tuple[str, ...],
    "lengths": tuple[float, ...] | None,
    "mobility": float | None,
    "strokes": tuple[Stroke, ...],
    "most_returns": int,
}


def check_weights(weights: Mapping[str, float]) -> None:
    """Check weights of eq (4) by name.

    Raises:
        InvalidTask: A name is unknown or a weight negative.
    """
    for name, weight in weights.items():
        if name not in _WEIGHTS:
            raise InvalidTask(f"weights.{name}", "an unknown name", f"one of {', '.join(_WEIGHTS)}")
        if not 0.0 <= weight < np.inf:
            raise InvalidTask(f"weights.{name}", f"{weight}", "a finite number, at least 0")


def _plain(value: object) -> object:
    """Return a value made of tables, lists, numbers and words only."""
    value = msgspec.to_builtins(value, enc_hook=_number)
    if isinstance(value, Mapping):
        return {key: _plain(element) for key, element in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(element) for element in value]
    return value


def _number(value: object) -> object:
    """Return a number of NumPy's as one of Python's."""
    if isinstance(value, np.generic):
        return value.item()
    raise NotImplementedError(f"no plain value for {type(value).__name__}")


def _mapping(name: str, value: object) -> Mapping[str, object]:
    if not isinstance(value, Mapping):
        raise InvalidTask(name, f"{value!r}", "a table")
    return value


def _check_numbers(name: str, values: Iterable[float], count: int) -> None:
    found = list(values)
    if len(found) != count:
        raise InvalidTask(name, f"{len(found)} numbers", f"{count} numbers")
    for i, value in enumerate(found):
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InvalidTask(
                f"{name}[{i}]" if count > 1 else name, f"{value!r}", "a finite number"
            )
