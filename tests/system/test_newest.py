"""What is kept of a scenario from run to run is found anew once somebody changes what the scenario holds."""

import pytest

from hil.core.errors import BadInput
from hil.core.newest import of_newest
from hil.runs.execute import execute_in_memory
from tests.system.test_native_intake import ONE, differences, spec_of


def test_a_scenario_that_is_changed_in_place_is_run_as_it_is():
    """As a notebook may: the robot is another one, and the record holds the scenario that was run."""
    spec = spec_of(ONE)
    before = execute_in_memory(spec)
    assert differences(execute_in_memory(spec), before) == []
    spec.scenario.mismatch["mass_kg"] = 1.5
    spec.scenario.board["W_MAX"] = 3.0
    after = execute_in_memory(spec)
    fresh = spec_of(ONE)
    fresh.scenario.mismatch["mass_kg"] = 1.5
    fresh.scenario.board["W_MAX"] = 3.0
    assert differences(after, execute_in_memory(fresh)) == []
    assert "samples.est_x_m" in differences(after, before)
    assert after.manifest.scenario["mismatch"]["mass_kg"] == 1.5
    assert after.manifest.scenario["board"]["W_MAX"] == 3.0


@pytest.mark.parametrize(("table", "key"), [("mismatch", "no_such"), ("board", "W_MAX")])
def test_values_changed_in_place_are_checked(table, key):
    """What does not fit is refused as it would be of a new scenario."""
    spec = spec_of(ONE)
    execute_in_memory(spec)
    getattr(spec.scenario, table)[key] = 300.0
    with pytest.raises(BadInput, match=key):
        execute_in_memory(spec)


def test_what_is_unchanged_is_asked_once():
    """Until a table of it, however deep, holds something else."""
    calls = []
    ask = of_newest(calls.append)
    scenario = spec_of(ONE).scenario
    for _ in range(3):
        ask(scenario)
    assert len(calls) == 1
    scenario.mismatch["mass_kg"] = 1.5
    ask(scenario)
    ask(scenario)
    assert len(calls) == 2
    ask(scenario.model_copy())
    assert len(calls) == 3
