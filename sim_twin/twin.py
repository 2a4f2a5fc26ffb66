"""The simulated rig: robot, board, link and camera in lockstep on a virtual host clock.

Twin stands in at the byte stream and at the camera frame (`hil.core.rig.Rig`). Time moves only
in `wait`; nothing here reads a real clock. Host time is virtual time + HOST_START_S.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING

from hil.config.robot import BUILT_IN_PLANT
from hil.control.vehicles.vehicle import TwoSided, make_vehicle
from hil.core.errors import BadInput, RigFault
from hil.core.rig import PORT_BYTES, Frame, LineBacklog, Truth
from hil.core.types import Pose
from sim_twin import _native
from sim_twin.camera_faults import FaultyMaker, FrameMaker, covered_front
from sim_twin.camera_timing import Shutter, Span
from sim_twin.drawn_poses import DrawnPoses, load_localiser_error
from sim_twin.host_faults import HostFaults
from sim_twin.link_model import Channel
from sim_twin.outside_plant import PERIOD_US, OutsidePlant
from sim_twin.setup import make_kernel

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from hil.config.events import Disturbance, Fault
    from hil.config.link import LinkConfig
    from hil.config.robot import RobotConfig
    from hil.core.rig import ByteStream, Picture

# No clock of a real rig starts at zero; whoever mixes up host, board and camera time shall notice.
HOST_START_S = 1000.0
# Poses handed to the renderer over one exposure, an odd number so that one is at its middle:
# 0.75 mm apart at 0.5 m/s and 6 ms.
POSES_PER_EXPOSURE = 5
# And over all rows of a rolling shutter: 15 ms more at 30 us a row.
POSES_PER_READOUT = 17


@dataclass(frozen=True, slots=True)
class TwinSetup:
    """All that the simulated rig is made of; `start` is the robot's pose at rest.

    `eeprom` is what the board's storage holds at first, the rest of it erased; `wired` says that the
    host is on the board's USB port, and not on its Bluetooth one.
    """

    robot: RobotConfig
    link: LinkConfig
    camera: CameraConfig
    start: Pose
    seed: int
    disturbances: tuple[Disturbance, ...] = ()
    faults: tuple[Fault, ...] = ()
    eeprom: bytes = b""
    wired: bool = False


class TwinStream:
    """Host end of the link: a serial port at the link's baud rate with a radio behind it.

    The port holds PORT_BYTES; a host that sends faster than the line carries meets it full (RigFault).
    """

    def __init__(self, rig: _native.Rig, backlog: LineBacklog) -> None:
        self._rig = rig
        self._backlog = backlog
        self.read = rig.read  # every byte that has arrived by now, b"" if none

    def write(self, data: bytes) -> None:
        """Send the bytes towards the board; raises RigFault when the port is full."""
        try:
            self._backlog.write(self._rig.now_s(), len(data))
        except RigFault as error:
            raise RigFault(f"twin: {error}") from None
        self._rig.send(data)

    def room_bytes(self) -> int:
        """Return how many bytes `write` takes now."""
        waiting = self._backlog.waiting_bytes(self._rig.now_s())
        return max(PORT_BYTES - math.ceil(waiting), 0)

    def discard_unsent(self) -> None:
        """Forget what the line has not begun to carry."""
        self._rig.discard_unsent()
        self._backlog.clear()


class Twin:
    """One simulated rig; `maker` None gives drawn poses in place of images.

    `board` is the handle of another board than the firmware core compiled for this machine.
    """

    stream: ByteStream

    def __init__(
        self, setup: TwinSetup, maker: FrameMaker | None = None, board: object | None = None
    ) -> None:
        def rng(part: str) -> Random:
            return Random(f"{setup.seed} {part}")

        self._setup = setup
        self._vehicle = make_vehicle(setup.robot)
        self._maker = maker
        self._pictures = FaultyMaker(maker, setup.faults, lambda: _covered_maker(setup))
        self._host = HostFaults(setup.faults)
        self._kernel = make_kernel(
            setup.robot, setup.link.baud, rng("kernel"), setup.disturbances, setup.faults, board,
            wired=setup.wired, eeprom=setup.eeprom,
        )  # fmt: skip
        self._kernel.reset(setup.start.x_m, setup.start.y_m, setup.start.theta_rad)
        self._rig = _native.Rig(
            self._kernel,
            HOST_START_S,
            setup.link.baud,
            down=Channel(setup.link, rng("link down")),
            up=Channel(setup.link, rng("link up")),
            shutter=Shutter(setup.camera, rng("shutter"), HOST_START_S),
            readout_s=setup.camera.line_time_s * (setup.camera.height_px - 1),
        )
        backlog = LineBacklog(setup.link.baud)
        self.stream = TwinStream(self._rig, backlog)
        self._drawn = drawn = DrawnPoses(load_localiser_error(), setup.camera, rng("localiser"))
        self._eye = _native.DrawnRig(
            self._rig,
            drawn.native,
            backlog,
            drawn.quality,
            drawn.sigma_xy_m,
            drawn.sigma_theta_rad,
            self._vehicle.geometry.d0_m,
            0 if maker is None else _poses_of(setup.camera),
        )
        self._picture: tuple[int, Picture] | None = None  # the last one, and its number
        self._set_spans(math.inf)
        self._outside = self._open_outside(setup)
        self._outside_told = False

    def _open_outside(self, setup: TwinSetup) -> OutsidePlant | None:
        """Have the robot's motion worked out by another program where the robot's file says so."""
        if setup.robot.plant == BUILT_IN_PLANT:
            return None
        outside = OutsidePlant(setup.robot.plant, setup.robot, setup.start, setup.seed)
        loads = [item.target for item in setup.disturbances if item.target != "battery_sag_v"]
        stuck = [fault.kind for fault in setup.faults if fault.kind == "motor_stuck"]
        try:
            outside.check_takes([*loads, *stuck])
        except BadInput:
            outside.close()
            raise
        self._kernel.set_outside(outside.step, PERIOD_US)
        return outside

    def now_s(self) -> float:
        """Return the virtual host clock."""
        now_s = self._rig.now_s()
        return now_s + self._host.step_s(now_s)

    def world_s(self) -> float:
        """Return the time of everything but the host, whose clock may have stepped."""
        return self._rig.now_s()

    def begin(self, t_start_s: float) -> None:
        """Let timed disturbances and faults count from `t_start_s`."""
        t_start_s -= self._host.step_s(self._rig.now_s())
        self._kernel.begin(_kernel_us(t_start_s))
        self._set_spans(t_start_s)

    def wait(self, until_s: float) -> None:
        """Move to `until_s`, or to the next arrival of bytes or of a frame before it.

        Farther, where the host's process is kept from running then.
        """
        self._move(self._host.world_s(until_s, self._rig.now_s()))
        runs_s = self._host.runs_at_s(self._rig.now_s())
        while self._rig.now_s() < runs_s:
            self._move(runs_s)

    def _move(self, until_s: float) -> None:
        # Where no image is drawn a frame is the one pose at the middle of its exposure.
        poses = 1 if self._maker is None else _poses_of(self._setup.camera)
        try:
            if self._outside is None:
                self._rig.wait(until_s, poses)
                return
            arrived = False
            while not arrived:
                self._rig.advance(until_s)
                if self._outside.fault and not self._outside_told:
                    self._outside_told = True  # once: the board must be told to stop after it
                    raise RigFault(self._outside.fault)
                arrived = self._rig.arrive(until_s, poses)
        except RuntimeError as error:
            raise RigFault(f"twin: {error}; check the robot's parameters") from None

    def poll_frame(self) -> Frame | None:
        """Return the oldest frame not yet taken; it is drawn only now."""
        taken = self._eye.take_frame()
        if taken is None:
            return None
        index, t_cam_s, pose, reason = taken
        if self._maker is None:
            return Frame(index, t_cam_s, None, self._drawn.said(pose, reason))
        return Frame(index, t_cam_s, self.picture())

    def picture(self) -> Picture:
        """Return the picture of the frame taken last; one that repeats the frame before has that one's."""
        shown = self._eye.shown()
        assert shown is not None  # else there is no frame, or it brings a drawn pose
        index, start_s, poses = shown
        if self._picture is None or self._picture[0] != index:
            self._picture = index, self._pictures.make(start_s, index, poses)
        return self._picture[1]

    def native(self) -> object | None:
        """Return the handle by which native code drives this rig, None where it needs Python code."""
        if self._outside is not None or self._host.any:
            return None
        if self._maker is not None and (self._pictures.any or self._setup.camera.line_time_s > 0.0):
            return None  # what is drawn at once is told apart by its pixels, not by what it shows
        own = (getattr(type(self), name) is method for name, method in _OWN.items())
        if type(self.stream) is not TwinStream or not all(own):
            return None  # a rig that does one of these in its own way is asked
        two_sided = getattr(type(self._vehicle), "flat_output", None) is TwoSided.flat_output
        return self._eye.handle() if two_sided else None

    def truth(self) -> Truth:
        """Return the true state now."""
        x_m, y_m, theta_rad, eta1_m_s, theta_dot_rad_s = self._rig.truth()
        pose = Pose(x_m, y_m, theta_rad)
        return Truth(pose, eta1_m_s, theta_dot_rad_s, self._vehicle.flat_output(pose))

    def pose_at(self, t_s: float) -> Pose:
        """Return the true pose at a time of the last four seconds of `world_s`."""
        return Pose(*self._rig.pose_at(t_s))

    def close(self) -> None:
        """End the program that works out the robot's motion, where there is one."""
        if self._outside is not None:
            self._outside.close()

    def _set_spans(self, t_begin_s: float) -> None:
        def spans(kind: str) -> list[Span]:
            return [_span(fault, t_begin_s) for fault in self._setup.faults if fault.kind == kind]

        stamp_steps = [
            (fault.step_s, _span(fault, t_begin_s))
            for fault in self._setup.faults
            if fault.kind == "camera_clock_step"
        ]
        self._eye.set_faults(spans("camera_repeated"), stamp_steps)
        self._rig.set_spans(sorted(spans("camera_stall")), spans("camera_occluded"))
        both = spans("link_cut")
        for channel, one in ((self._rig.down, "link_down_cut"), (self._rig.up, "link_up_cut")):
            channel.cuts = both + spans(one)
            channel.doubles = spans("link_duplicated")
            channel.swaps = spans("link_reordered")
        self._pictures.begin(lambda fault: _span(fault, t_begin_s))
        self._host.begin(lambda fault: _span(fault, t_begin_s))


# What native code does in place of these.
_OWN = {name: getattr(Twin, name) for name in ("now_s", "wait", "poll_frame", "picture", "truth")}


def _poses_of(camera: CameraConfig) -> int:
    """Return how many poses a picture takes along."""
    return POSES_PER_READOUT if camera.line_time_s > 0.0 else POSES_PER_EXPOSURE


def _covered_maker(setup: TwinSetup) -> FrameMaker:
    from sim_twin.camera_sim import RenderedCamera  # noqa: PLC0415 - only where pictures are drawn

    return RenderedCamera(covered_front(setup.camera), setup.seed)


def _kernel_us(t_s: float) -> int:
    """Return the first whole microsecond of the kernel's clock not before host time `t_s`."""
    return math.ceil(1e6 * (t_s - HOST_START_S) - 1e-3)


def _span(fault: Fault, t_begin_s: float) -> Span:
    """Return the host times between which a fault is there (see `hil.config.events.Fault`)."""
    start_s = t_begin_s + fault.start_s if fault.start_s > 0.0 else -math.inf
    return start_s, math.inf if fault.end_s is None else t_begin_s + fault.end_s
