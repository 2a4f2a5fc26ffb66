"""What a signature would cost the board, so that the reason why there is none stays a measured one."""

from __future__ import annotations

import pytest

from tests.pil import signing_cost
from tests.pil.rigs import needs_toolchain
from tests.pil.signing_cost import CLOCK_HZ, RATES_HZ, measure

pytestmark = needs_toolchain

# Of tick and link, measured (docs/firmware.md), and their budget.
USED, BUDGET = 0.348, 0.40


def test_a_signature_leaves_the_budget_however_it_is_hashed() -> None:
    """For eight bits it takes a fourth of mavgen's cycles; set-points alone are still too many."""
    cost = measure()
    quick = cost.eight_bits()
    for name, cycles in cost.mavgen.items():
        assert quick[name] < cycles / 4
    assert cost.block == pytest.approx(41_168, rel=0.05)  # another compiler may do a little better
    assert quick["WHEEL_SETPOINT"] == 2 * cost.block  # 32 + 19 + 10 bytes and 9 of padding
    share = quick["WHEEL_SETPOINT"] * RATES_HZ["WHEEL_SETPOINT"] / CLOCK_HZ
    assert share > 2.0 * (BUDGET - USED)
    assert quick["WHEEL_SETPOINT"] > 0.004 * CLOCK_HZ  # longer than a tick


def test_a_digest_that_is_none_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: from another state the first word is another one."""
    other = signing_cost._PROGRAM.replace("0x6a09e667", "0x6a09e668")
    monkeypatch.setattr(signing_cost, "_PROGRAM", other)
    with pytest.raises(ValueError, match="the digest begins with"):
        measure()
