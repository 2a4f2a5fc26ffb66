"""A robot whose motion another program works out: lockstep, determinism, faults, refusals."""

from __future__ import annotations

import json
import re
import socket
import sys
import threading
from importlib import import_module, util
from pathlib import Path

import numpy as np
import pytest

from hil.core.types import Pose
from hil.record.reader import read_run
from sim_twin import outside_plant
from sim_twin.outside_plant import OutsidePlant
from sim_twin.plant_server import serve
from tests.cli.command import hil, run_pose
from tests.twin.rigs import NO_LOADS, Drive, robot

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLE = re.search(
    r"```python my_plant.py\n(.*?)```", (DOCS / "own-plant.md").read_text("utf-8"), re.DOTALL
)[1]

# The built-in robot by way of the wire: duty is voltage over what the battery has at rest.
BUILT_IN = """
from hil import serve_plant
from hil.config.robot import RobotConfig
from sim_twin import _native
from sim_twin.setup import plant_params

class Same:
    def reset(self, robot, start, dt_s, seed):
        self.plant = _native.Plant(plant_params(RobotConfig.model_validate(robot)))
        self.plant.reset(start["x_m"], start["y_m"], start["theta_rad"])
    def step(self, volts, dt_s, loads):
        full = self.plant.battery_v(0.0, 0.0)
        duty = [v / full for v in volts]
        self.plant.run(40, dt_s / 40, *duty, [0.0] * len(_native.LOADS))
        return dict(zip(_native.STATES, self.plant.state))

serve_plant(Same())
"""

# Stands still and goes wrong in one way 1.5 s after power-up.
WRONG = """
import json, math, sys, time
for line in sys.stdin:
    asked = json.loads(line)
    state = dict(x_m=-0.6, y_m=-0.35, theta_rad=1.5708, eta1_m_s=0.0, theta_dot_rad_s=0.0,
                 wheel_left_rad=0.0, wheel_right_rad=0.0)
    if asked.get("t_s", 0.0) > 1.5:
        {wrong}
    print(json.dumps({{"ready": 1}} if "hello" in asked else state), flush=True)
"""


@pytest.fixture
def plant_file(tmp_path):
    """Return what writes a plant's file and names it."""

    def write(text: str, name: str = "my_plant.py") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_the_example_of_the_docs_drives_an_experiment_the_same_every_time(tmp_path, plant_file):
    """It reaches the point, two runs are the same bytes, and the record keeps the text that ran."""
    path = plant_file(EXAMPLE)
    files = []
    for name in ("one", "two"):
        done = run_pose("--set", f"robot.plant={path}", "--set", "duration_s=8",
                        "--out", tmp_path / name)  # fmt: skip
        assert done.status == 0, done.out + done.err
        files.append((tmp_path / name / "samples.parquet").read_bytes())
    assert files[0] == files[1]
    (plugin,) = read_run(tmp_path / "one").manifest.plugins
    assert (plugin.kind, plugin.origin) == ("plant", str(path))
    assert (tmp_path / "one" / plugin.file).read_text("utf-8") == EXAMPLE
    replayed = hil("replay", tmp_path / "one", "--out", tmp_path / "again")
    assert replayed.status == 0, replayed.out + replayed.err


def test_the_built_in_robot_by_way_of_the_wire_is_the_built_in_robot(plant_file):
    """Driven at constant wheel speeds for 1 s, straight and then in a curve, within 1 mm and 5 mrad.

    What is left is the voltage held over 4 ms and a battery that does not sag.
    """
    path = plant_file(BUILT_IN)
    ends = []
    for where in ("builtin", str(path)):
        drive = Drive(robot(plant=where, battery_resistance_ohm=0.0, battery_idle_a=0.0))
        drive.arm()
        drive.run(0.5, 6.0, 6.0)
        drive.run(0.5, 3.0, 8.0)
        ends.append(drive.twin.truth().pose)
        drive.twin.close()
    assert ends[0].x_m > 0.15
    assert ends[0].theta_rad > 0.2
    assert ends[1].x_m == pytest.approx(ends[0].x_m, abs=1e-3)
    assert ends[1].y_m == pytest.approx(ends[0].y_m, abs=1e-3)
    assert ends[1].theta_rad == pytest.approx(ends[0].theta_rad, abs=5e-3)


class Listener:
    """A plant in this process that keeps what it is asked."""

    takes = ("force_forward_n",)

    def __init__(self):
        self.robot, self.start, self.asked = {}, {}, []

    def reset(self, robot, start, dt_s, seed):
        self.robot, self.start, self.hello = robot, start, (dt_s, seed)

    def step(self, volts, dt_s, loads):
        self.asked.append((volts, dt_s, loads))
        return {
            "x_m": self.start["x_m"], "y_m": self.start["y_m"], "theta_rad": self.start["theta_rad"],
            "eta1_m_s": 0.0, "theta_dot_rad_s": 0.0, "wheel_left_rad": 0.0, "wheel_right_rad": 0.0,
        }  # fmt: skip


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def listening(plant):
    """Serve a plant from a thread of this process; return its port once it listens."""
    port = free_port()
    threading.Thread(target=serve, args=(plant, port), daemon=True).start()
    for _ in range(200):
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
        except ConnectionRefusedError:
            threading.Event().wait(0.01)
        else:
            return port
    raise AssertionError("does not listen")


def test_a_port_of_this_machine_is_asked_every_tick_with_what_acts():
    """4 ms a step, voltage of the stalled wheels up to the battery's, the true robot, the push."""
    plant = Listener()
    port = listening(plant)
    from hil.config.events import Disturbance  # noqa: PLC0415

    push = Disturbance(target="force_forward_n", shape="step", amplitude=2.0, start_s=0.2)
    drive = Drive(
        robot(plant=f"tcp:127.0.0.1:{port}", mass_kg=3.1),
        start=Pose(0.1, -0.2, 0.5),
        seed=9,
        disturbances=(push,),
    )
    drive.arm()
    begin = drive.twin.now_s()
    drive.twin.begin(begin)
    asked_before = len(plant.asked)
    assert all(loads == {} for _, _, loads in plant.asked)
    drive.run(0.4, 5.0, -5.0)
    drive.twin.close()
    assert plant.hello == (0.004, 9)
    assert plant.start == {"x_m": 0.1, "y_m": -0.2, "theta_rad": 0.5}
    assert plant.robot["mass_kg"] == 3.1
    during = plant.asked[asked_before:]
    assert len(during) == pytest.approx(0.4 / 0.004, abs=2)
    assert {dt_s for _, dt_s, _ in during} == {0.004}
    left, right = during[-1][0]
    assert 1.0 < left < 12.3
    assert -12.3 < right < -1.0
    pushed = [loads for _, _, loads in during if loads]
    assert set(pushed[0]) == {"force_forward_n"}
    assert pushed[0]["force_forward_n"] == 2.0
    assert len(pushed) == pytest.approx(0.2 / 0.004, abs=2)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("sys.exit(3)", "ended with status 3"),
        (
            "sys.exit(0)",
            "ended with status 0 and said nothing; a plant's file ends with hil.serve_plant",
        ),
        ("state['x_m'] / 0", "ended with status 1: line 8: ZeroDivisionError"),
        ("state['theta_rad'] = math.nan", "answered theta_rad = nan at t = 1.504 s"),
        ("state['x_m'] = 'far'", "answered x_m = 'far' at t = 1.504 s"),
        ("del state['wheel_left_rad']", "has no wheel_left_rad"),
        ("state['wheel_left_rad'] = 1e9", "wheel_left_rad jumps at t = 1.504 s"),
        ("state['y_m'] = 4.0", "y_m jumps"),
        ("print('hello world', flush=True)", "answered 'hello world', which is no JSON object"),
        ("time.sleep(60)", "no answer for 0.3 s"),
    ],
)
def test_a_plant_that_fails_is_a_named_fault_after_the_robot_is_stopped(
    tmp_path, plant_file, monkeypatch, wrong, said
):
    """Exit status 3, the cause in one line, the board disarmed, a record that is whole."""
    monkeypatch.setattr(outside_plant, "STEP_TIMEOUT_S", 0.3 if "sleep" in wrong else 10.0)
    path = plant_file(WRONG.format(wrong=wrong))
    out = tmp_path / "run"
    done = run_pose("--set", f"robot.plant={path}", "--set", "duration_s=3", "--out", out)
    assert done.status == 3, done.out + done.err
    record = read_run(out)
    assert record.manifest.outcome == "fault"
    assert record.manifest.outcome_detail.startswith(f"plant {path}: ")
    assert said in record.manifest.outcome_detail
    events = [event.kind for event in record.events]
    assert "stopped" in events
    assert events.index("stopped") < events.index("fault")


def test_a_program_that_hangs_is_ended_with_the_run(tmp_path, plant_file, monkeypatch):
    """A plant deaf to the end of its input does not outlive the rig."""
    monkeypatch.setattr(outside_plant, "HELLO_TIMEOUT_S", 0.2)
    path = plant_file("import time\nwhile True:\n    time.sleep(1)\n")
    started = []
    real = outside_plant.subprocess.Popen
    monkeypatch.setattr(
        outside_plant.subprocess,
        "Popen",
        lambda *a, **k: started.append(real(*a, **k)) or started[-1],
    )
    done = run_pose("--set", f"robot.plant={path}", "--out", tmp_path / "run")
    assert done.status == 3
    assert "no answer for 0.2 s" in done.err
    assert started[0].poll() is not None


@pytest.mark.parametrize(
    ("plant", "said"),
    [
        ("tcp:10.0.0.7:5555", "on this machine only"),
        ("tcp:0.0.0.0:5555", "on this machine only"),
        ("tcp:127.0.0.1:0", "1 to 65535"),
        ("tcp:127.0.0.1:99999", "1 to 65535"),
        ("mujoco", "choose builtin, tcp:127.0.0.1:PORT or a file"),
        ("./not_there.py", "no such file"),
    ],
)
def test_a_plant_that_cannot_be_is_refused_before_anything_is_written(tmp_path, plant, said):
    out = tmp_path / "run"
    assert said in run_pose("--set", f"robot.plant={plant}", "--out", out).refusal
    assert not out.exists()


def test_a_port_nobody_listens_at_is_a_rig_fault(tmp_path):
    done = run_pose("--set", f"robot.plant=tcp:127.0.0.1:{free_port()}", "--out", tmp_path / "run")
    assert done.status == 3
    assert "start the program that listens there first" in done.err


def test_a_load_that_the_plant_does_not_know_is_refused(tmp_path, plant_file):
    """The example takes load_left_n_m only: a scenario that pushes forward is refused, with its names."""
    plant_file(EXAMPLE)
    scenario = tmp_path / "pushed.toml"
    scenario.write_text(
        'base = "scenario-1"\n[robot]\nplant = "my_plant.py"\n'
        '[[disturbances]]\ntarget = "force_forward_n"\nshape = "step"\namplitude = 1.0\n',
        encoding="utf-8",
    )
    done = hil("run", scenario, "--camera", "pose", "--out", tmp_path / "run")
    assert "does not take force_forward_n" in done.refusal
    assert "it takes: load_left_n_m" in done.refusal


def test_a_wrapped_heading_is_carried_on():
    """A plant whose theta jumps from pi to -pi turns on in the record."""

    class Turning(Listener):
        theta = 3.13

        def step(self, volts, dt_s, loads):
            self.theta += 0.01
            wrapped = (self.theta + np.pi) % (2 * np.pi) - np.pi
            return super().step(volts, dt_s, loads) | {"theta_rad": wrapped}

    where = f"tcp:127.0.0.1:{listening(Turning())}"
    plant = OutsidePlant(where, robot(plant=where), Pose(0.0, 0.0, 3.13), 1)
    headings = [plant.step(4000 * i, (0.0, 0.0), NO_LOADS, (0.0, 0.0))[2] for i in range(5)]
    plant.close()
    assert plant.fault == ""
    assert headings == pytest.approx([3.14, 3.15, 3.16, 3.17, 3.18])


@pytest.mark.skipif(util.find_spec("mujoco") is None, reason="mujoco is not installed")
@pytest.mark.parametrize(
    ("scenario", "outer"), [("scenario-1", "pid"), ("scenario-2", "asg-ism"), ("scenario-3", "pid")]
)
def test_mujoco_drives_the_three_experiments(tmp_path, scenario, outer):
    """The example's engine, floor and contacts under the differential robot: requirements hold."""
    done = hil("run", scenario, "--outer", outer, "--camera", "pose", "--set", "robot.file=diff-2wd",
               "--set", "camera.file=diff-2wd", "--set", "duration_s=12",
               "--set", f"robot.plant={DOCS / 'examples' / 'mujoco_plant.py'}",
               "--out", tmp_path / "run")  # fmt: skip
    assert done.status == 0, done.out + done.err


def test_served_over_its_own_input_a_plant_may_print(plant_file):
    """What a plant prints goes to stderr and does not disturb the wire."""
    begin = "    def step(self, volts, dt_s, loads):"
    path = plant_file(EXAMPLE.replace(begin, f"{begin}\n        print(volts)"))
    plant = OutsidePlant(str(path), robot(), Pose(0.0, 0.0, 0.0), 1)
    state = plant.step(0, (6.0, 6.0), NO_LOADS, (0.0, 0.0))
    plant.close()
    assert plant.fault == ""
    assert 0.0 < state[3] < 1.0


def test_the_wire_of_the_docs_is_the_wire():
    """Every key of the questions and answers shown is one that is spoken."""
    shown = re.findall(r"^    (->|<-) (\{.*\})$", (DOCS / "own-plant.md").read_text("utf-8"), re.M)
    assert len(shown) == 5
    for arrow, text in shown:
        keys = set(json.loads(text.replace("{...}", "{}")))
        if arrow == "->":
            known = {"hello", "dt_s", "seed", "start", "robot", "t_s", "volts", "loads"}
        else:
            known = {"ready", "takes", *outside_plant._WANTED, *outside_plant._OPTIONAL}
        assert keys <= known
    module = import_module("sim_twin.plant_server")
    assert module.PROTOCOL == outside_plant.PROTOCOL
    assert sys.modules["sim_twin.plant_server"] is module
