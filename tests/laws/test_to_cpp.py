"""Python written as C++: what it makes of loops, tuples and bases, and what it refuses with its place."""

import textwrap

import pytest

from hil.core.to_cpp.kinds import NotUnderstoodError, Part
from hil.core.to_cpp.modules import Translation

OBSERVERS = """
class Observer:
    def __init__(self, rate_s: float) -> None:
        self.rate_s = rate_s
        self.reset(0.0)

    def reset(self, speed: float) -> None:
        self.speed, self.seen = speed, False

class Law:
    def __init__(self, rate_s: float) -> None:
        self._axes = (Observer(rate_s), Observer(rate_s))

    def go(self, pair: Vec2) -> float:
        BODY
"""


def translated(tmp_path, source, names):
    """Return the C++ of a module's names."""
    (tmp_path / "source.py").write_text(textwrap.dedent(source), encoding="utf-8")
    return Translation(tmp_path, [Part("source.py", names)], {}).text()


def of_body(tmp_path, body):
    """Return the C++ of a law with a method of this body."""
    source = OBSERVERS.replace("BODY", body.replace("\n", "\n        "))
    return translated(tmp_path, source, ("Observer", "Law"))


def test_members_are_those_that_the_constructor_and_its_methods_give(tmp_path):
    """A value that a called method gives first is a member too, of that value's type."""
    text = of_body(tmp_path, "return 0.0")
    for member in ("double rate_s;", "double speed{};", "bool seen{};"):
        assert member in text
    assert "std::tuple<Observer, Observer> _axes;" in text
    assert ": rate_s(rate_s) { this->reset(0.0); }" in text


def test_another_name_for_a_part_with_a_state_is_no_copy(tmp_path):
    """What is changed by one name is changed by the other, as in Python; numbers are copied."""
    text = of_body(tmp_path, "first, second = self._axes\nx, y = pair\nreturn first.speed + x")
    assert "auto& first = m::item<0>(this->_axes);" in text
    assert "auto x = m::item<0>(" in text


def test_a_loop_over_tuples_has_their_entries(tmp_path):
    """Of one or, by zip, of several."""
    text = of_body(
        tmp_path,
        "for axis, speed in zip(self._axes, pair, strict=True):\n    axis.reset(speed)\n"
        "for axis in self._axes:\n    axis.reset(0.0)\nreturn 0.0",
    )
    assert text.count("m::each(") == 2
    assert "}, this->_axes, pair);" in text


def test_a_list_of_a_known_length_is_a_tuple(tmp_path):
    """Made in order, entry by entry."""
    text = of_body(tmp_path, "twice = [2.0 * pair[i] for i in range(2)]\nreturn twice[0]")
    assert "m::listed<2>([&](int i) { return (2.0 * m::element(pair, i)); })" in text


@pytest.mark.parametrize(
    "body",
    [
        pytest.param("return [pair[i] for i in range(n)][0]", id="a length that is not known"),
        pytest.param("return [pair[i] for i in range(2) if i][0]", id="some of a list"),
        pytest.param(
            "for a, b in zip(self._axes, pair):\n    a.reset(b)", id="lengths that may differ"
        ),
        pytest.param(
            "for a, b in zip(self._axes, pair, strict=True):\n    return b",
            id="a way out of a loop",
        ),
        pytest.param("for a in self._axes:\n    a = 1.0", id="an entry that is replaced"),
        pytest.param(
            "first = 1.0\nfirst, second = self._axes", id="a name that was something else"
        ),
        pytest.param("a, b = self._axes, 1.0", id="a part with a state among others"),
        pytest.param("self.kept, other = self._axes", id="a part of a part"),
        pytest.param("raise ValueError", id="an error of its own"),
        pytest.param("while True:\n    pass", id="a loop with no end"),
    ],
)
def test_what_is_not_understood_ends_the_translation_with_its_place(tmp_path, body):
    """Rather than C++ that does something else."""
    with pytest.raises(NotUnderstoodError, match=r"^source\.py: line \d+: "):
        of_body(tmp_path, body)


BASE = """
Own = TypeVar("Own", bound=int)
_SHARE = 0.5

class Staged(Generic[Own]):
    def __init__(self, gain: Own) -> None:
        self._gain = gain

    def wish(self, x: float) -> float:
        raise NotImplementedError

    def step(self, x: float) -> float:
        return STEP

class Mine(Staged[float]):
    def wish(self, x: float) -> float:
        return self._gain * x
"""


def test_a_derived_class_has_what_its_base_has(tmp_path):
    """Its own methods in place of the base's, its type in place of the variable."""
    text = translated(tmp_path, BASE.replace("STEP", "self.wish(x)"), ("Staged", "Mine"))
    assert "class Mine" in text
    assert "class Staged" not in text
    assert "double _gain;" in text
    assert "double wish([[maybe_unused]] double x) {\n    return (this->_gain * x);" in text
    assert "double step([[maybe_unused]] double x) {\n    return this->wish(x);" in text


def test_a_base_that_needs_its_module_is_refused(tmp_path):
    """It is written out in other modules, where that name may be another."""
    with pytest.raises(NotUnderstoodError, match="Staged uses _SHARE of its module"):
        translated(tmp_path, BASE.replace("STEP", "_SHARE * x"), ("Staged", "Mine"))


def test_a_member_after_the_calls_is_refused(tmp_path):
    """In C++ it would have its value before them."""
    source = OBSERVERS.replace("BODY", "return 0.0").replace(
        "self.reset(0.0)", "self.reset(0.0)\n        self.late = 1.0"
    )
    with pytest.raises(NotUnderstoodError, match=r"self\.late = 1\.0 after a call"):
        translated(tmp_path, source, ("Observer", "Law"))


def test_one_name_in_two_modules_is_refused(tmp_path):
    """Which of them a law means would not be known."""
    for name in ("one.py", "other.py"):
        (tmp_path / name).write_text("def f(x: float) -> float:\n    return x\n", encoding="utf-8")
    with pytest.raises(NotUnderstoodError, match=r"other\.py: the names f once more"):
        Translation(tmp_path, [Part("one.py", ("f",)), Part("other.py", ("f",))], {}).text()
