"""The keys of a ``result.json`` as reports ask for them: what a run lacks is None or empty, never an error."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import msgspec

from tramnet_master.results import ServoResult
from tramnet_master.run_folder import RunFolder


@dataclass(frozen=True)
class Findings:
    """What a run found.

    Attributes:
        keys: The keys of its ``result.json``.
    """

    keys: Mapping[str, object]

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read the result of a run folder.

        Raises:
            NotARunFolder: There is no finished run in it.
            DamagedFile: The result is torn.
        """
        return cls(RunFolder(folder).result())

    def number(self, key: str) -> float | None:
        """A number, or None where there is none."""
        value = self.keys.get(key)
        return float(value) if isinstance(value, int | float) else None

    def text(self, key: str) -> str:
        """A value in words, empty where there is none."""
        value = self.keys.get(key)
        return "" if value is None else str(value)

    def table(self, key: str) -> Mapping[str, object]:
        """A map, empty where there is none."""
        value = self.keys.get(key)
        return value if isinstance(value, dict) else {}

    def rows(self, key: str) -> list[Mapping[str, object]]:
        """A list of maps, empty where there is none."""
        value = self.keys.get(key)
        return [row for row in value if isinstance(row, dict)] if isinstance(value, list) else []

    def column(self, key: str) -> list[float]:
        """A list of numbers, empty where there is none."""
        value = self.keys.get(key)
        return [float(x) for x in value] if isinstance(value, list) else []

    def limits(self, key: str, n_joints: int) -> list[float | None]:
        """A limit a joint, None where a joint has none or the run does not say."""
        values = self.table("limits").get(key)
        return values if isinstance(values, list) and len(values) == n_joints else [None] * n_joints

    @property
    def servo(self) -> ServoResult | None:
        """What replays through a servo showed, or None where there were none."""
        try:
            return msgspec.convert(self.table("servo"), ServoResult)
        except msgspec.ValidationError:
            return None

    @property
    def caption(self) -> str:
        """What ran, in a line: job, case, robot or variant, method, settings and seed."""
        parts = [self.text(k) for k in ("robot", "variant", "method", "settings")]
        parts = [self.text("experiment"), self._task, *parts]
        return "  ·  ".join([*(part for part in parts if part), f"seed {self.text('seed')}"])

    @property
    def _task(self) -> str:
        """What was to be done: a case of the paper, or the user's own."""
        scenes = len(self.rows("scenes"))
        if scenes > 1:
            return f"{scenes} scenes"
        if not self.text("case"):
            return "own task"
        # The paper of a run with scenes has one task only.
        return "the paper's task" if scenes else f"case {self.text('case')}"
