"""A scenario on the serial target, against the twin served by another process in real time."""

import json
import signal
import subprocess
import sys
import time

HIL = [sys.executable, "-m", "hil"]


def test_a_scenario_runs_on_the_served_twin(tmp_path):
    """Two seconds of scenario 1 over pseudo-terminal and socket: complete, robot moved, recorded."""
    port, frames = tmp_path / "board", tmp_path / "camera"
    server = subprocess.Popen(
        [*HIL, "twin", "serve", "--camera", "pose", "--pty", str(port), "--frames", str(frames)],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        end_s = time.monotonic() + 10.0
        while not frames.exists() and time.monotonic() < end_s:
            time.sleep(0.05)
        run = subprocess.run(
            [
                *HIL, "run", "scenario-1", "--on", f"serial:{port}", "--camera", f"twin:{frames}",
                "--set", "duration_s=2", "--out", str(tmp_path / "run"), "--json",
            ],
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
    finally:
        server.send_signal(signal.SIGINT)
        _, said = server.communicate(timeout=10)
    # Two seconds do not reach the goal, so requirements may fail (1); a rig fault (3) may not be.
    assert run.returncode in (0, 1), run.stderr
    json.loads(run.stdout)
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    assert manifest["outcome"] == "complete"
    figures = json.loads((tmp_path / "run" / "metrics.json").read_text())
    text = json.dumps(figures)
    assert "rtt_median_s" in text
    assert server.returncode == 130
    assert "kept real time within" in said
    assert not port.is_symlink()
