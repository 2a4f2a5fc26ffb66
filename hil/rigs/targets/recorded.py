"""The target `replay:RUN`: a record answers, open loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hil.core.registries import TARGETS

if TYPE_CHECKING:
    from hil.core.rig import Rig
    from hil.rigs.asked import Asked


@TARGETS.register("replay", summary="a record answers, open loop", form="replay:RUN", order=1)
def replay(asked: Asked) -> Rig:
    """Return the rig that a record makes; raises BadInput for a record of another task, or none."""
    from hil.record.source import read_source, recorded_scenario  # noqa: PLC0415
    from hil.rigs.replay import open_replay, refuse_other_task  # noqa: PLC0415

    source = read_source(Path(asked.where))
    recorded = recorded_scenario(source.manifest, source.path)
    refuse_other_task(asked.scenario, recorded, source.path)
    return open_replay(source, recorded)
