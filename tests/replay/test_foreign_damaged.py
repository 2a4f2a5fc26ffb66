"""Whatever bytes a foreign log is made of: signals in order of time, or one line that refuses them."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path
from random import Random

import numpy as np
import pytest

from hil.core.errors import BadInput
from hil.record.log_csv import read_csv
from hil.record.log_mapping import LogMapping
from hil.record.log_telemetry import read_tlog
from tests.replay.logs import MAP, arc, arc_rows, link_of, pose_frames

ROWS = 30
CSV = "t,x,y,theta\n" + "\n".join(
    ",".join(f"{value:.4f}" for value in row) for row in arc_rows(ROWS)
)
TLOG = b"".join(pose_frames(0.05 * k, arc(0.05 * k), link_of(1)) for k in range(ROWS))


def damaged(data: bytes, rng: Random) -> bytes:
    """Return the log with one to six pieces altered, cut out, put in, or repeated."""
    result = bytearray(data)
    for _ in range(rng.randint(1, 6)):
        at, size = rng.randrange(len(result)), rng.randint(1, 80)
        other = rng.randrange(len(result))
        match rng.randrange(4):
            case 0:
                result[at] = rng.choice(b',;"\n\r.-0eE \xff\xfd\x00')
            case 1 if len(result) > 2 * size:
                del result[at : at + size]
            case 2:
                result[at:at] = rng.randbytes(size)
            case _:
                result[at:at] = result[other : other + size]
    return bytes(result)


@pytest.mark.parametrize(("name", "data"), [("log.csv", CSV.encode()), ("log.tlog", TLOG)])
def test_a_damaged_log_is_read_or_refused(tmp_path: Path, name: str, data: bytes) -> None:
    """400 damaged logs each: no exception but BadInput in one line, no warning, no time twice."""
    rng, path = Random(11), tmp_path / name
    mapping = LogMapping.model_validate(tomllib.loads(MAP))
    read, refused = 0, []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(400):
            path.write_bytes(damaged(data, rng))
            try:
                signals = (read_csv if name == "log.csv" else read_tlog)(path, mapping)
            except BadInput as refusal:
                refused.append(str(refusal))
                continue
            read += 1
            assert (np.diff(signals.t_s) > 0.0).all()
            assert np.isfinite(signals.columns["est_theta_rad"]).all()
    assert read > 10
    assert len(refused) > 10
    assert not any("\n" in line for line in refused)
