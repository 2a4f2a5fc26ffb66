"""Encoders faster than the board can count."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.config.limits import check_edges
from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.runs.execute import RunSpec, execute


def test_an_encoder_that_the_board_cannot_count_is_refused_before_the_run(tmp_path: Path) -> None:
    """10,000 counts a turn at OVER_W 28 rad/s: BadInput with figure and limit, no record begun."""
    spec = RunSpec(
        scenario=load_scenario("scenario-1", ["robot.encoder_counts_per_turn=10000"]),
        target="twin", camera="pose", outer="asg-ism", inner="asg-ism", seed=1,
        out=tmp_path / "run", rerun=False,
    )  # fmt: skip
    with pytest.raises(BadInput, match=r"10000 counts/turn: the board counts up to 31750 counts/s"):
        execute(spec)
    assert not spec.out.exists()


@pytest.mark.parametrize(
    ("counts_per_turn", "overspeed", "fits"),
    [(1920.0, 100.0, True), (7124.0, 28.0, True), (7126.0, 28.0, False)],
)
def test_the_limit_is_127_counts_a_tick(
    counts_per_turn: float, overspeed: float, fits: bool
) -> None:
    """ENC_COUNTS * OVER_W / 2 pi: 30,558, 31,747 counts/s pass and 31,756 do not."""
    values = {"ENC_COUNTS": counts_per_turn, "OVER_W": overspeed}
    if fits:
        check_edges(values)
    else:
        with pytest.raises(BadInput, match="31756 counts/s"):
            check_edges(values)
