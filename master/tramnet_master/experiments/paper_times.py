"""Computing times of Lin, Chen & Yu (2017), table 4, under the names by which ours are compared with them.

The paper calls one method CEA on its GPU and GA on its CPU, and EAMP elsewhere. Its text has a speed-up of 224
where its table has 244, which is what the times give.
"""

from typing import NamedTuple

NAIVE = "perturbation 5^8, naive"
"""How the paper searched its grid; its n_i = 4 intervals are 5 values a joint."""


class Printed(NamedTuple):
    """A time as the paper prints it.

    Attributes:
        milliseconds: Time of a step [ms].
        speed_up: How many times as long its search of the grid takes.
    """

    milliseconds: float
    speed_up: float


class PaperTime(NamedTuple):
    """The rows of table 4 for a method.

    Attributes:
        cpu: On the paper's CPU.
        gpu: On its GPU, None where it has no such row.
    """

    cpu: Printed
    gpu: Printed | None = None


PAPER_TIMES = {
    "EAMP 500/10": PaperTime(Printed(78.0, 244.0), Printed(48.0, 398.0)),
    "EAMP 1000/10": PaperTime(Printed(152.0, 126.0), Printed(106.0, 180.0)),
    NAIVE: PaperTime(Printed(19083.0, 1.0)),
}
"""Table 4, by method, population and generations."""
