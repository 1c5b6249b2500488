"""The steps of Progressive Design and the constraints that act in each.

Kim & Khosla (1992), section 6. Which constraints act in which step is Fig. 8, as the text describes it;
the figure itself is lost. A given arm has no step 1 proper: its first step is path placement, "just by
fixing variables corresponding to dimension (D) and turning off LC and HC" (section 4).
"""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class Step(StrEnum):
    """Steps of Progressive Design; ``PLACEMENT`` is the first one of a given arm."""

    DESIGN = "design"
    PLACEMENT = "placement"
    PROTOTYPE = "prototype"
    PLANNING = "planning"
    CONTROL = "control"


#: The terms of eq (4), in its order.
TERM_NAMES = ("dm", "tc", "rc", "hc", "jlc", "lc", "bpc", "jac")

#: Fig. 8: which terms of eq (4) act in which step; control only checks.
CONSTRAINTS: Mapping[Step, frozenset[str]] = MappingProxyType(
    {
        Step.DESIGN: frozenset({"dm", "tc", "hc", "jlc", "lc", "bpc", "jac"}),
        Step.PLACEMENT: frozenset({"dm", "tc", "rc", "jlc", "bpc", "jac"}),
        Step.PROTOTYPE: frozenset({"dm", "tc", "rc", "jlc", "bpc", "jac"}),
        Step.PLANNING: frozenset({"dm", "tc", "rc", "jlc", "jac"}),
        Step.CONTROL: frozenset({"rc", "jlc"}),
    }
)
