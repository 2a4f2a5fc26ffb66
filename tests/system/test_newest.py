"""What is kept of a scenario from run to run is found anew once somebody changes what the scenario holds."""

from dataclasses import replace

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput
from hil.core.newest import of_newest
from hil.core.registries import VEHICLES
from hil.runs.execute import execute_in_memory
from tests.own.starts import written
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


VEHICLE = """
import hil


class Long(hil.VehicleConfig):
    kind: str = "long"


@hil.vehicle("long", settings=Long)
class LongVehicle(hil.TwoSided):
    def __init__(self, robot):
        super().__init__(robot)
        self.contacts = hil.Contacts(robot.front_axle_m, {times} * robot.rear_axle_m)
"""


def test_a_vehicle_that_is_registered_anew_is_what_moves(tmp_path):
    """The robot's section is the same object, the code that its name stands for is not."""
    file = written(tmp_path / "long.py", VEHICLE.format(times="1.0"))
    given = [f"robot.vehicle={{kind={str(file)!r}}}", "robot.variant=slip", "duration_s=2"]
    spec = replace(spec_of(ONE), scenario=load_scenario("circle", given))
    before = execute_in_memory(spec)
    written(file, VEHICLE.format(times="0.4"))
    VEHICLES.get(str(file))
    after = execute_in_memory(spec)
    fresh = replace(spec, scenario=load_scenario("circle", given))
    assert differences(after, execute_in_memory(fresh)) == []
    assert "samples.true_x_m" in differences(after, before)
