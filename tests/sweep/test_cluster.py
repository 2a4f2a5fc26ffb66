"""A campaign on a cluster that grows, has no worker, cannot run the program, or goes away."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from hil.core.errors import RigFault
from hil.study.campaign import cluster
from hil.study.campaign.cluster import on_dask

pytestmark = pytest.mark.realtime

distributed = pytest.importorskip("distributed")


@pytest.fixture
def one_worker() -> Iterator[Any]:
    """Return a cluster of one thread."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50
    ) as found:
        yield found


def pid_after(pause_s: float) -> int:
    time.sleep(pause_s)
    return os.getpid()


def test_worker_that_joins_later_gets_its_share(one_worker: Any) -> None:
    """Twenty jobs are out for the one thread of the beginning; the second worker does many."""
    done: Counter[int] = Counter()
    results = on_dask(pid_after, [0.1] * 60, one_worker.scheduler_address, needed=("time",))
    for number, pid in enumerate(results):
        done[pid] += 1
        if number == 3:
            one_worker.scale(2)
            one_worker.wait_for_workers(2)
    assert done.total() == 60
    assert len(done) == 2
    assert min(done.values()) >= 10


def test_without_a_worker_it_is_said_and_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scheduler alone: one line while it waits, one that ends it."""
    monkeypatch.setattr(cluster, "_SAY_S", 0.0)
    monkeypatch.setattr(cluster, "_GIVE_UP_S", 1.5)
    said: list[str] = []
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None, silence_logs=50) as alone,
        pytest.raises(RigFault, match=r"has no worker for .* the same command goes on"),
    ):
        list(on_dask(pid_after, [0.0] * 3, alone.scheduler_address, say=said.append))
    assert len(said) == 1
    assert "waiting for one" in said[0]


def test_worker_without_the_program_is_named(one_worker: Any) -> None:
    """What it cannot import is in the one line."""
    with pytest.raises(RigFault, match=r"none of 1 workers can run this program .*no_such_module"):
        list(on_dask(pid_after, [0.0], one_worker.scheduler_address, needed=("no_such_module",)))


def test_scheduler_that_goes_away_is_one_line(one_worker: Any) -> None:
    """What came before is kept by the caller."""
    found = []

    def take() -> None:
        for result in on_dask(
            pid_after, [0.2] * 20, one_worker.scheduler_address, needed=("time",)
        ):
            found.append(result)
            if len(found) == 2:
                one_worker.close()

    with pytest.raises(RigFault, match="the scheduler is gone") as ended:
        take()
    assert len(found) >= 2
    assert "\n" not in str(ended.value)


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("tcp://127.0.0.1:8786", False),
        ("localhost:8786", False),
        ("tcp://[::1]:8786", False),
        ("tls://cluster.example:8786", False),
        ("tcp://192.168.1.7:8786", True),
        ("cluster.example:8786", True),
        ("tcp://127.0.0.1.example:8786", True),
    ],
)
def test_a_scheduler_that_others_reach_is_told(address: str, told: bool) -> None:
    """What is exchanged is code; only this machine's own and checked connections go without a word."""
    assert bool(cluster.open_to_others(address)) is told
