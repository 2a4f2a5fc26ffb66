"""What of a law is not as it was translated is run in Python, and what native code asks of Python."""

import pytest

from hil import control
from hil.config.control import ControlConfig, OuterLimits
from hil.control import _outer, translated
from hil.control.laws import axes, chain, let_go
from hil.control.laws.asg_ism import AsgIsm
from hil.control.laws.turn_first import TurnFirst
from hil.control.references import make_reference
from hil.control.vehicles.vehicle import TwoSided
from hil.core.types import OuterCommand
from tests.laws.support import D0_M, estimate, point
from tests.laws.test_translated import REFERENCES, Traced, shipped


def test_a_law_with_more_names_than_there_is_room_for_stays_in_python():
    """Its own names take a place each."""
    names = tuple(f"term_{k}" for k in range(_outer.OWN_TERMS_MOST + 1))
    assert translated.native_law(Traced({}), names) is None
    assert translated.native_law(Traced({}), names[1:]) is not None


def test_a_law_may_change_its_step_on_the_way():
    """The step of that moment is asked, as Python does."""
    law = Traced({})
    native = translated.native_law(law)
    law.reset = lambda *_: setattr(law, "step", lambda *_: OuterCommand(0.3, 0.4, {}))
    native.reset(point(0, 0), estimate())
    assert native.step(point(0, 0), estimate(), 0.1)[:2] == (0.3, 0.4)


def test_native_arithmetic_raises_what_python_raises():
    """A speed whose square is no number any more: the same error of the same class."""
    limits = OuterLimits(approach_speed_m_s=1e-200)
    made = AsgIsm(ControlConfig().active_gains.asg_ism, limits, D0_M)
    for law in (made, translated.native_law(made)):
        with pytest.raises(ZeroDivisionError, match=r"division by zero$"):
            law.reset(point(0, 0), estimate(0.3))


def test_the_vehicle_is_among_the_sources_that_are_looked_at():
    """Native code goes from the geometry to the wheels without it: an edited one is run in Python."""
    assert "hil/control/vehicles/vehicle.py" in [path for path, _ in _outer.SOURCES]


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        (chain, "damped_inverse", lambda *_, **__: (0.0, 0.0)),
        (chain, "clip", lambda value, _: value),
        (chain, "Chain", type("Chain", (), {})),
        (let_go, "_WAIT_S", 0.5),
        (axes, "_pairs", lambda _: ()),
        (axes._pairs.__wrapped__, "__code__", (lambda _: ()).__code__),
        (axes.TurnedAxes, "_back", lambda _, trace: trace),
        (TurnFirst, "_wanted_share", staticmethod(lambda *_: 0.5)),
        (TwoSided, "wheels", lambda *_: (0.0, 0.0)),
        (chain.clip, "__code__", (lambda value, limit: value * limit).__code__),
    ],
)
def test_a_replaced_part_switches_native_laws_off(owner, name, value, monkeypatch):
    """Whoever replaces a function or a number of a law has it used: native code would not."""
    reference = make_reference(REFERENCES["circle"])
    assert translated.native_law(shipped()) is not None
    assert translated.native_forms(shipped(), reference) is not None
    monkeypatch.setattr(owner, name, value)
    assert translated.native_law(shipped()) is None
    assert translated.native_forms(shipped(), reference) is None


def test_a_replaced_block_is_not_taken_for_the_built_in_one(monkeypatch):
    """A law made over another sliding block is asked in Python."""
    monkeypatch.setattr(control, "AsgIsm", type("AsgIsm", (control.AsgIsm,), {}))
    assert not translated.is_translated(shipped())


class Slotted:
    """A reference of somebody's own, with nothing but what it names."""

    __slots__ = ("place",)

    def at(self, t_s):
        return point(0.1, t_s)


def test_a_reference_of_any_shape_is_asked_in_python():
    """One without a dictionary too."""
    assert translated.native_reference(Slotted()) is None
    assert translated.native_forms(shipped(), Slotted()) is None


def test_a_part_that_is_gone_switches_native_laws_off(monkeypatch):
    """One that was deleted is as one that was replaced."""
    monkeypatch.delattr(let_go, "_WAIT_S")
    assert translated.native_law(shipped()) is None


def test_a_source_that_has_changed_since_is_run_in_python(monkeypatch):
    """Native code of an older source is not used."""
    (path, _), *others = _outer.SOURCES
    monkeypatch.setattr(_outer, "SOURCES", ((path, "0" * 64), *others))
    translated._as_translated.cache_clear()
    try:
        assert translated.native_law(shipped()) is None
    finally:
        translated._as_translated.cache_clear()
