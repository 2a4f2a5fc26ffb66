"""`hil.make_env`: a scenario stepped by the one who decides the commands."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv

import hil
from hil.analysis.costs import COST_FAILED, USUAL
from hil.record.schema import SAMPLE_NAMES
from hil.study.gym_env import OBSERVATION, HilEnv

LAW = '''
"""Sends commands that were written down."""
import math
import hil


@hil.outer_law("written-down", hold=False)
class WrittenDown:
    def __init__(self, gains, limits, d0_m):
        self._tick = 0

    def reset(self, reference, estimate):
        self._tick = 0

    def step(self, reference, estimate, dt_s):
        self._tick += 1
        k = self._tick - 1
        return hil.OuterCommand(0.2 + 0.1 * math.sin(0.3 * k), 0.8 * math.cos(0.2 * k), {})
'''


@pytest.fixture(scope="module")
def law_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("law") / "written.py"
    file.write_text(LAW, encoding="utf-8")
    return file


def command(tick: int) -> np.ndarray:
    return np.array([0.2 + 0.1 * math.sin(0.3 * tick), 0.8 * math.cos(0.2 * tick)])


def env(camera: str = "pose", **overrides: object) -> HilEnv:
    return hil.make_env("scenario-1", camera=camera, **{"duration_s": 1.0} | overrides)


def play(made: HilEnv, seed: int | None = None) -> tuple[list[float], bool, bool, dict]:
    """Return rewards, terminated, truncated and info of an episode of `command`."""
    made.reset(seed=seed)
    rewards: list[float] = []
    while True:
        _, reward, terminated, truncated, info = made.step(command(len(rewards)))
        rewards.append(reward)
        if terminated or truncated:
            return rewards, terminated, truncated, info


@pytest.mark.filterwarnings("ignore:.*:UserWarning")
def test_gymnasium_finds_nothing_wrong() -> None:
    """Gymnasium's own checker accepts spaces, seeding, determinism and signatures."""
    check_env(env())


@pytest.mark.parametrize("camera", ["pose", "rendered"])
def test_same_seed_and_commands_give_the_rows_of_a_run(
    camera: str, law_file: Path, tmp_path: Path
) -> None:
    """Every column of every tick is that of a run whose law sends these commands, to the bit."""
    made = env(camera)
    rewards, *_ = play(made, seed=5)
    run = hil.run(
        "scenario-1",
        str(law_file),
        5,
        camera=camera,
        duration_s=1.0,
        out=tmp_path / "run",
    )
    stepped = made.record().samples
    assert run.outcome == "complete"
    assert len(rewards) == run.samples["t_s"].size == 31
    for name in SAMPLE_NAMES:
        assert stepped[name].tobytes() == run.samples[name].tobytes(), name
    other = env(camera)
    play(other, seed=6)
    assert other.record().samples["est_x_m"].tobytes() != stepped["est_x_m"].tobytes()


def test_rewards_add_up_to_minus_the_cost_of_tuning() -> None:
    """The return of an episode is minus the cost that the gain procedure gives its figures."""
    made = env(duration_s=3.0, reference__x_m=-0.6, reference__y_m=-0.3)
    rewards: list[float] = []
    made.reset(seed=2)
    done = False
    while not done:
        _, reward, terminated, done, info = made.step(np.zeros(2))
        assert not terminated
        rewards.append(reward)
    cost = USUAL.of(info["figures"])
    assert 0.0 < cost < COST_FAILED
    assert sum(rewards) == pytest.approx(-cost, abs=1e-9)
    # At rest |delta1| is constant e: each tick costs e / 30, from the second on.
    error_m = float(np.hypot(*(made.record().samples[f"true_delta1_{a}_m"][10] for a in "xy")))
    assert rewards[10] == pytest.approx(-error_m / 30, rel=1e-3)


def test_a_fault_terminates_and_costs_what_a_failed_run_costs() -> None:
    """Out of the fence the robot is stopped, the episode ends, and the cause is named."""
    made = env(duration_s=20.0, safety__fence_y_max_m=-0.2)
    made.reset(seed=1)
    total, terminated, truncated = 0.0, False, False
    while not (terminated or truncated):
        _, reward, terminated, truncated, info = made.step(np.array([0.5, 0.0]))
        total += reward
    assert terminated
    assert not truncated
    assert info["detail"].startswith("geofence: robot ")
    assert total == pytest.approx(-COST_FAILED)
    assert made.record().events[-2].kind == "stopped"
    with pytest.raises(hil.BadInput, match="call reset first"):
        made.step(np.zeros(2))


def test_observation_is_estimate_and_reference() -> None:
    """Names stand for what they say: the start pose, the point, and no motion yet."""
    made = env()
    seen, info = made.reset(seed=1)
    value = dict(zip((quantity.name for quantity in OBSERVATION), seen, strict=True))
    assert value["x_m"] == pytest.approx(-0.60, abs=0.01)
    assert value["y_m"] == pytest.approx(-0.35, abs=0.01)
    assert value["theta_rad"] == pytest.approx(math.pi / 2, abs=0.02)
    assert (value["ref_z1_x_m"], value["ref_z1_y_m"]) == (0.05, 0.35)
    assert value["z1_y_m"] - value["y_m"] == pytest.approx(0.03, abs=0.005)
    assert abs(value["eta1_m_s"]) < 0.02
    assert info["seed"] == 1
    assert made.action_space.high.tolist() == [0.5, 2.5]


def test_episodes_in_parallel_are_those_alone() -> None:
    """In a vector of environments each one is as it is by itself."""
    vector = SyncVectorEnv([env, env])
    vector.reset(seed=[3, 4])
    for tick in range(20):
        together = vector.step(np.array([command(tick), command(tick)]))[0]
    for place, seed in enumerate((3, 4)):
        alone = env()
        alone.reset(seed=seed)
        for tick in range(20):
            seen = alone.step(command(tick))[0]
        assert seen.tobytes() == together[place].tobytes()
        alone.close()
    vector.close()


def test_seeds_without_a_seed_are_drawn_from_the_first() -> None:
    """Episodes differ, and the same first seed gives the same sequence of them."""
    first, second = env(), env()
    seeds = [[made.reset()[1]["seed"] for _ in range(3)] for made in (first, second)]
    assert seeds[0] == seeds[1]
    assert len(set(seeds[0])) == 3


def test_closing_in_the_middle_stops_the_robot() -> None:
    """A learner that gives up leaves no robot running."""
    made = env()
    made.reset(seed=1)
    for tick in range(5):
        made.step(command(tick))
    made.close()
    made.close()
    record = made.record()
    assert record.manifest.outcome == "interrupted"
    assert [event.kind for event in record.events][-2:] == ["stopped", "interrupted"]
    assert record.samples["t_s"].size == 5


@pytest.mark.parametrize(
    ("action", "said"),
    [([math.nan, 0.0], "two finite numbers"), ([0.1], "two finite numbers")],
)
def test_an_action_that_is_none_is_refused(action: list[float], said: str) -> None:
    """Nonsense is not sent to the board."""
    made = env()
    made.reset(seed=1)
    with pytest.raises(hil.BadInput, match=said):
        made.step(np.array(action))


def test_actions_beyond_the_limits_are_clipped() -> None:
    """The board is asked for no more than the scenario's limits."""
    made = env()
    made.reset(seed=1)
    for _ in range(3):
        made.step(np.array([100.0, -100.0]))
    rows = made.record().samples
    assert rows["eta1_cmd_m_s"].max() <= 0.5
    assert rows["theta_dot_cmd_rad_s"].min() >= -2.5


def test_a_real_rig_is_refused() -> None:
    """A real robot's time does not wait."""
    with pytest.raises(hil.BadInput, match="does not wait"):
        hil.make_env("scenario-1", on="serial:/dev/ttyUSB0")
