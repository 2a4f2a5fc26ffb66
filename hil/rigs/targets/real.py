"""The target `serial:DEV[@BAUD]`: a real board on a port, a real camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.core.registries import TARGETS

if TYPE_CHECKING:
    from hil.core.rig import Rig
    from hil.rigs.asked import Asked


@TARGETS.register(
    "serial", summary="a real board on a port, a real camera", form="serial:DEV[@BAUD]"
)
def serial(asked: Asked) -> Rig:
    """Return the rig on a port; raises BadInput for a name that is none, RigFault without the port."""
    from hil.rigs.frames import open_source  # noqa: PLC0415 - loads video
    from hil.rigs.serial import SerialRig, parse_target  # noqa: PLC0415

    device, baud = parse_target(f"serial:{asked.where}")
    rig = SerialRig(
        device, baud, None, asked.key
    )  # the port first: it is what was asked for by name
    try:
        rig.watch_by(open_source(asked.camera, asked.scenario.camera))
    except BaseException:
        rig.close()
        raise
    return rig
