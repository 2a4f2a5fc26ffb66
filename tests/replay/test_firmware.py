"""The recorded wheel loops come out of the firmware core again, as far as reports tell."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from hil.core.errors import BadInput
from hil.replays.elf import elf
from hil.replays.firmware import PHASES_US, Sent, Tick, core, replay_wheels
from tests.pil.rigs import needs_toolchain
from tests.replay.records import cut, record


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four seconds under way."""
    return record(tmp_path_factory.mktemp("firmware") / "run", ("duration_s=4",)).path


@pytest.mark.parametrize("inner", ["asg-ism", "pid"])
def test_pwm_of_the_recorded_law_comes_out_again(tmp_path: Path, inner: str) -> None:
    """Within a fifth of its size, although only every fifth tick's counts are known."""
    path = record(tmp_path / "run", ("duration_s=4",), inner=inner).path
    report = replay_wheels(path)
    assert not report.shadow
    assert report.reports > 180
    for side in (report.left, report.right):
        assert side.rms_recorded > 50
        assert side.rms_difference < 0.2 * side.rms_recorded
        assert side.correlation > 0.98


def test_changed_board_parameter_shows(made: Path) -> None:
    """Negative control: a board without feed-forward is told apart from the recorded one."""
    same = replay_wheels(made)
    other = replay_wheels(made, None, ["board.FF_GAIN=0", "board.FF_DEAD=0"])
    assert other.shadow
    assert other.left.rms_difference > 2 * same.left.rms_difference


def test_other_wheel_law_is_a_shadow(made: Path) -> None:
    """It sets another PWM, and says that the wheels did not follow it."""
    report = replay_wheels(made, "pid")
    assert report.shadow
    assert "shadow" in report.text()
    same = replay_wheels(made)
    assert report.phase_us == same.phase_us  # where the encoder was read is a fact of the record
    assert report.left.rms_difference > same.left.rms_difference


def test_too_short_a_log_is_refused(tmp_path: Path) -> None:
    """A link log that ends before the arming has nothing to compare."""
    path = record(tmp_path / "run", ("duration_s=0.5",)).path
    cut(path / "link.tlog", 0.3)
    with pytest.raises(BadInput, match="reports while armed"):
        replay_wheels(path)


@needs_toolchain
@pytest.mark.parametrize(("target", "inner"), [("twin", "pid"), ("pil", "asg-ism")])
def test_the_elf_sets_the_pwm_of_the_core(tmp_path: Path, target: str, inner: str) -> None:
    """The binary under simavr, by UART and encoder pins, sets the core's PWM at every phase.

    But for the disarming, whose arrival no report tells: on the ELF its 44 bytes take 7.6 ms, two
    ticks in which the core is off already.
    """
    path = record(tmp_path / "run", ("duration_s=3",), target=target, inner=inner).path
    on_elf = elf()
    differing: list[list[tuple[int, int]]] = []
    moving = []

    def both(frames: Sequence[Sent], ticks: Sequence[Tick]) -> list[tuple[int, int]]:
        pwm, of_core = on_elf.pwm(frames, ticks), core().pwm(frames, ticks)
        differing.append([b for a, b in zip(pwm, of_core, strict=True) if a != b])
        moving.append(sum(a != (0, 0) for a in pwm))
        return pwm

    report = replay_wheels(path, firmware=on_elf._replace(pwm=both))
    assert len(differing) == len(PHASES_US)
    assert min(moving) > 500
    assert all(len(of_core) <= 2 and {*of_core} <= {(0, 0)} for of_core in differing)
    assert report.left.rms_difference < 0.2 * report.left.rms_recorded
    assert "on the ELF (simavr)" in report.text()
    assert report.to_json()["firmware"] == "elf"


@needs_toolchain
def test_changed_board_parameter_shows_on_the_elf(made: Path) -> None:
    """Negative control: the ELF without feed-forward is told apart, and like the core's shadow."""
    changes = ["board.FF_GAIN=0", "board.FF_DEAD=0"]
    same = replay_wheels(made, firmware=elf())
    other, on_core = replay_wheels(made, None, changes, elf()), replay_wheels(made, None, changes)
    assert other.shadow
    assert other.left.rms_difference > 2 * same.left.rms_difference
    assert other.left.rms_difference == pytest.approx(on_core.left.rms_difference, rel=0.05)


def test_without_simavr_the_elf_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The line has the packages to install."""
    monkeypatch.setitem(sys.modules, "sim_twin._pil", None)
    with pytest.raises(BadInput, match=r"through the ELF.*apt install") as told:
        elf()
    assert "\n" not in str(told.value)
