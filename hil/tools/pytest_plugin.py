"""A pytest plugin: tests that run a scenario with a law and hold it to its requirements.

    @pytest.mark.hil("scenario-1", outer="my_law.py", camera="pose")
    def test_my_law(hil_run):
        assert hil_run.figures().values["ise_m2_s"] < 0.9

The marked test fails where a requirement of the scenario does, with what was measured, the limit,
and where report and record are; its body may look at the record further. `hil_check` is the same as
a function, for tests that choose scenario or law while they run. pytest loads the plugin by itself
when the harness is installed. Files are looked for beside the test first, then from where pytest
was started. Two files that register one name cannot be used by one pytest process.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

_MARK = "hil"
_RUN = "hil_run"
_OPTION = "--hil-records"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option for where records go."""
    parser.getgroup("hil", "hardware-in-the-loop runs").addoption(
        _OPTION,
        type=Path,
        metavar="DIR",
        help="keep records and reports of hil runs in DIR, a folder for each; "
        "default: in pytest's own temporary folder",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    config.addinivalue_line(
        "markers",
        f"{_MARK}(scenario, outer=None, inner='asg-ism', target='twin', camera=None, seed=1, set=()): "
        "run the scenario with the law and assert its requirements; the record is the fixture hil_run",
    )


def pytest_itemcollected(item: pytest.Item) -> None:
    """Have a marked test run its scenario even where it does not ask for the record."""
    if not isinstance(item, pytest.Function) or item.get_closest_marker(_MARK) is None:
        return
    if _RUN not in item.fixturenames:
        item.fixturenames.append(_RUN)


@pytest.fixture
def hil_run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    """Return the record of the run that the test's marker asks for."""
    mark = request.node.get_closest_marker(_MARK)
    if mark is None:
        pytest.fail(f"{_RUN}: the test has no marker pytest.mark.{_MARK}(scenario)", pytrace=False)
    folder = _new_folder(request, tmp_path_factory)
    try:
        asked = inspect.signature(_run).bind(folder, request.path.parent, *mark.args, **mark.kwargs)
    except TypeError as error:
        said = str(error)
    else:
        return _run(*asked.args, **asked.kwargs)
    pytest.fail(f"marker {_MARK}: {said}", pytrace=False)


@pytest.fixture
def hil_check(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., RunRecord]:
    """Return a function that runs as the marker does, asserts the requirements, gives the record."""

    def check(scenario: str, **how: Any) -> RunRecord:
        __tracebackhide__ = True
        folder = _new_folder(request, tmp_path_factory)
        record = _run(folder, request.path.parent, scenario, **how)
        assert_requirements(record)
        return record

    return check


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, Any, Any]:
    """Assert the requirements of a marked test's run, before its body."""
    if pyfuncitem.get_closest_marker(_MARK) is not None:
        record: Any = pyfuncitem.funcargs[_RUN]
        assert_requirements(record)
    return (yield)


def assert_requirements(record: RunRecord) -> None:
    """Fail the running test unless the run is complete and holds every requirement.

    The failure says value and limit of each that does not, and the paths of a report, which is
    written for it, and of the record.
    """
    from hil.report.junit import cases_of, run_title  # noqa: PLC0415 - pytest starts without it

    wrong = [case for case in cases_of(record) if case.kind]
    if not wrong:
        return
    total = len(cases_of(record))
    lines = [
        f"{run_title(record.manifest)}: {len(wrong)} of {total} requirements do not hold",
        *dict.fromkeys(f"  {case.message}" for case in wrong),
        f"report: {_report(record)}",
        f"record: {record.path}",
    ]
    pytest.fail("\n".join(lines), pytrace=False)


def _report(record: RunRecord) -> Path:
    from hil.report.compare import compare_runs  # noqa: PLC0415 - only where something failed
    from hil.report.html import write_report  # noqa: PLC0415

    path = record.path.parent / "report.html"
    write_report(path, [compare_runs([record], 1)], command=record.manifest.command)
    return path


def _new_folder(request: pytest.FixtureRequest, factory: pytest.TempPathFactory) -> Path:
    """Return a new folder for one run, named after the test."""
    name = "".join(c if c.isalnum() else "-" for c in request.node.name)[:60]
    root: Path | None = request.config.getoption(_OPTION)
    if root is None:
        return factory.mktemp(name)
    root = root.resolve()
    number = 1
    while (folder := root / f"{name}-{number}").exists():
        number += 1
    folder.mkdir(parents=True)
    return folder


def _run(
    folder: Path,
    beside: Path,
    scenario: str,
    *,
    outer: str | None = None,
    inner: str = "asg-ism",
    target: str = "twin",
    camera: str | None = None,
    seed: int = 1,
    set: str | Sequence[str] = (),
) -> RunRecord:
    """Run a scenario into `folder`; input that is refused fails the test with its one line."""
    from hil.board.wheel_laws import require_wheel_law  # noqa: PLC0415
    from hil.config.load import load_scenario  # noqa: PLC0415 - pytest starts without it
    from hil.core.errors import HilError  # noqa: PLC0415
    from hil.core.registries import OUTER_LAWS  # noqa: PLC0415
    from hil.runs.execute import RunSpec, camera_for, execute  # noqa: PLC0415

    try:
        require_wheel_law(inner)
        law = OUTER_LAWS.get(_found(outer, beside)) if outer else None
        overrides = (set,) if isinstance(set, str) else tuple(set)
        resolved = load_scenario(_found(scenario, beside), overrides)
        law = law or OUTER_LAWS.get(resolved.control.outer)
        spec = RunSpec(
            scenario=resolved,
            target=target,
            camera=camera_for(resolved, target, camera),
            outer=law.name,
            inner=inner,
            seed=seed,
            out=folder / "run",
            rerun=False,
            command="pytest",
        )
        return execute(spec)
    except HilError as error:
        said = str(error)
    pytest.fail(f"hil: {said}", pytrace=False)


def _found(name: str, beside: Path) -> str:
    """Return the path of a file that lies beside the test, else the name as it is."""
    file = name.rpartition(":")[0] if ".py:" in name else name
    if file.endswith((".py", ".toml")) and (beside / file).is_file():
        return str(beside / name)
    return name
