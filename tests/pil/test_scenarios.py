"""The experiments on the real binary: every scenario with both laws holds its requirements."""

import pytest

from hil.config.load import load_scenario
from hil.runs.execute import RunSpec, execute
from tests.pil.rigs import needs_toolchain

pytestmark = needs_toolchain


def run(name, law, out):
    """Run a scenario on target pil with drawn poses and one law at both levels."""
    spec = RunSpec(
        scenario=load_scenario(name),
        target="pil",
        camera="pose",
        outer=law,
        inner=law,
        seed=1,
        out=out,
        rerun=False,
    )
    return execute(spec)


@pytest.mark.parametrize("law", ["pid", "asg-ism"])
@pytest.mark.parametrize("name", ["scenario-1", "scenario-2", "scenario-3"])
def test_requirements_hold(name, law, tmp_path):
    """The run completes and every requirement of the scenario holds."""
    record = run(name, law, tmp_path / "run")
    assert record.manifest.outcome == "complete"
    failed = [verdict for verdict in record.verdicts() if not verdict.holds]
    assert not failed


def test_same_seed_gives_the_same_samples(tmp_path):
    """Bit for bit, as on the twin."""
    files = []
    for folder in ("a", "b"):
        run("scenario-3", "asg-ism", tmp_path / folder)
        files.append((tmp_path / folder / "samples.parquet").read_bytes())
    assert files[0] == files[1]
