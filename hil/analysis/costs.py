"""Tuning costs: what one number makes of a run's figures, where a search needs one (`hil tune`)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from hil.core.errors import BadInput
from hil.core.figures import tuning_cost
from hil.core.registries import TUNING_COSTS
from hil.core.registry import Entry, in_one_line, place_of
from hil.core.time_limit import TooLongError, time_limit

Figures = Mapping[str, float]

# The usual cost is the sum of weight * figure: error, time to come within 20 mm, where it rests (1 mm is
# worth half a second of settling), and the variation of the commands (chatter) at about a tenth of the
# whole in a calm run. ITAE in place of IAE would weigh the rest error by chance of the duration.
COST_WEIGHTS = {
    "iae_m_s": 1.0,
    "settling_20mm_s": 0.1,
    "delta1_worst_last_second_m": 50.0,
    "eta1_variation_m_s": 0.2,
    "theta_dot_variation_rad_s": 0.02,
}
# Usual cost of a run that gives no figure: a safety stop, a law that diverged, never within 20 mm.
COST_FAILED = 20.0
# Longest that a cost may take for one run, s.
_TIME_MAX_S = 1.0


@tuning_cost(
    "usual",
    meaning="error over time, settling, rest and variation of the commands",
    failed=COST_FAILED,
)
def usual(figures: Figures) -> float:
    """Return the weighted sum of COST_WEIGHTS.

    A run of a deck with conditions brings its own cost, normalised by its task.
    """
    if "cost" in figures:
        return figures["cost"]
    return sum(weight * figures.get(name, math.nan) for name, weight in COST_WEIGHTS.items())


@dataclass(frozen=True, slots=True)
class Cost:
    """A registered cost; one from outside that misbehaves is bad input."""

    entry: Entry

    @property
    def name(self) -> str:
        """Return its name."""
        return self.entry.name

    @property
    def is_usual(self) -> bool:
        """Say whether it is the one that is used unless another is named."""
        return self.entry.factory is usual

    @property
    def failed(self) -> float:
        """Return what a run without a cost costs, the most that any does."""
        value: float = self.entry.extra["failed"]
        return value

    def told(self) -> str:
        """Return how it is made up, for the origin of a gain set."""
        if self.is_usual:
            return " + ".join(f"{weight:g} {name}" for name, weight in COST_WEIGHTS.items())
        return f"{self.name} ({self.entry.summary})"

    def of(self, figures: Figures) -> float:
        """Return the cost of one run; `failed` at most, also without figures or where it is NaN.

        Raises BadInput that names file and line where the cost raises, takes too long, or gives no number.
        """
        if not figures:
            return self.failed
        try:
            with time_limit(_TIME_MAX_S):
                given = self.entry.factory(dict(figures))
            number = given if isinstance(given, float) else float(_number(given))
        except TooLongError as error:
            raise self._refused(f"took longer than {_TIME_MAX_S:g} s", error) from None
        except KeyError as error:
            said = f"raised KeyError: {error}: this run has no such figure; one of your own: --figure FILE.py"
            raise self._refused(said, error) from None
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise self._refused(f"raised {in_one_line(error)}", error) from None
        return min(number, self.failed) if math.isfinite(number) else self.failed

    def _refused(self, said: str, error: BaseException) -> BadInput:
        return BadInput(f"tuning cost {self.name} ({place_of(self.entry, error)}): {said}")


def _number(given: object) -> float:
    if isinstance(given, bool | str) or not hasattr(given, "__float__"):
        raise TypeError(f"gave {given!r:.60}, a number is needed")
    return float(given.__float__())


def cost_of(name: str) -> Cost:
    """Return a cost by its name, FILE.py or FILE.py:NAME; raises BadInput."""
    return Cost(TUNING_COSTS.get(name))


USUAL = cost_of("usual")
