"""The simulated rig: robot, board, link and camera in lockstep on a virtual host clock.

Twin stands in at the byte stream and at the camera frame (`hil.core.rig.Rig`). Time moves only
in `wait`; nothing here reads a real clock. Host time is virtual time + HOST_START_S.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from random import Random
from typing import TYPE_CHECKING

from hil.config.robot import BUILT_IN_PLANT
from hil.control.vehicles.vehicle import make_vehicle
from hil.core.errors import BadInput, RigFault
from hil.core.rig import PORT_BYTES, Frame, LineBacklog, Truth
from hil.core.types import Pose
from sim_twin.camera_faults import FaultyMaker, FrameMaker, covered_front
from sim_twin.camera_timing import Exposure, Shutter, Span
from sim_twin.drawn_poses import DrawnPoses, PoseTuple, load_localiser_error
from sim_twin.host_faults import HostFaults
from sim_twin.link_model import BITS_PER_BYTE, Channel, Serialiser
from sim_twin.outside_plant import PERIOD_US, OutsidePlant
from sim_twin.setup import make_kernel

if TYPE_CHECKING:
    from hil.config.camera import CameraConfig
    from hil.config.events import Disturbance, Fault
    from hil.config.link import LinkConfig
    from hil.config.robot import RobotConfig
    from hil.core.rig import ByteStream

# No clock of a real rig starts at zero; whoever mixes up host, board and camera time shall notice.
HOST_START_S = 1000.0
# Poses handed to the renderer over one exposure, an odd number so that one is at its middle:
# 0.75 mm apart at 0.5 m/s and 6 ms.
POSES_PER_EXPOSURE = 5
# And over all rows of a rolling shutter: 15 ms more at 30 us a row.
POSES_PER_READOUT = 17


@dataclass(frozen=True, slots=True)
class TwinSetup:
    """All that the simulated rig is made of; `start` is the robot's pose at rest."""

    robot: RobotConfig
    link: LinkConfig
    camera: CameraConfig
    start: Pose
    seed: int
    disturbances: tuple[Disturbance, ...] = ()
    faults: tuple[Fault, ...] = ()


class TwinStream:
    """Host end of the link: a serial port at the link's baud rate with a radio behind it.

    The port holds PORT_BYTES; a host that sends faster than the line carries meets it full (RigFault).
    """

    def __init__(self, twin: Twin, baud: int, down: Channel, arrived: list[bytes]) -> None:
        self._twin = twin
        self._baud = baud
        self._port = Serialiser(baud)
        self._backlog = LineBacklog(baud)
        self._unsent: deque[tuple[float, float, bytes]] = deque()  # begins, has left, bytes
        self._down = down
        self._arrived = arrived

    def read(self) -> bytes:
        """Return every byte that has arrived by now, b"" if none."""
        if not self._arrived:
            return b""
        data = b"".join(self._arrived)
        self._arrived.clear()
        return data

    def write(self, data: bytes) -> None:
        """Send the bytes towards the board; raises RigFault when the port is full."""
        now_s = self._twin.world_s()
        try:
            self._backlog.write(now_s, len(data))
        except RigFault as error:
            raise RigFault(f"twin: {error}") from None
        left_s = self._port.send(now_s, len(data))
        self._unsent.append((left_s - len(data) * BITS_PER_BYTE / self._baud, left_s, data))

    def room_bytes(self) -> int:
        """Return how many bytes `write` takes now."""
        waiting = self._backlog.waiting_bytes(self._twin.world_s())
        return max(PORT_BYTES - math.ceil(waiting), 0)

    def discard_unsent(self) -> None:
        """Forget what the line has not begun to carry."""
        self._unsent.clear()
        self._backlog.clear()
        self._port = Serialiser(self._baud)

    def carry(self, until_s: float) -> None:
        """Hand the radio what begins to leave the port by `until_s`."""
        while self._unsent and self._unsent[0][0] <= until_s:
            _, left_s, data = self._unsent.popleft()
            carried = self._down.carry(left_s, data)
            if carried is not None:
                self._twin.deliver_to_board(*carried)


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
            setup.robot, setup.link.baud, rng("kernel"), setup.disturbances, setup.faults, board
        )
        self._kernel.reset(setup.start.x_m, setup.start.y_m, setup.start.theta_rad)
        self._down = Channel(setup.link, rng("link down"))
        self._up = Channel(setup.link, rng("link up"))
        self._arrived: list[bytes] = []
        self._port = TwinStream(self, setup.link.baud, self._down, self._arrived)
        self.stream = self._port
        self._drawn = DrawnPoses(load_localiser_error(), setup.camera, rng("localiser"))
        self._shutter = Shutter(setup.camera, rng("shutter"), HOST_START_S)
        self._now_s = HOST_START_S
        self._uplink: deque[tuple[float, bytes]] = deque()
        self._readout_s = setup.camera.line_time_s * (setup.camera.height_px - 1)
        self._exposed: deque[tuple[Exposure, tuple[PoseTuple, ...]]] = deque()
        self._last_frame: Frame | None = None
        self._set_spans(math.inf)
        self._next_frame = self._shutter.next(self._stalls)
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
        return self._now_s + self._host.step_s(self._now_s)

    def world_s(self) -> float:
        """Return the time of everything but the host, whose clock may have stepped."""
        return self._now_s

    def begin(self, t_start_s: float) -> None:
        """Let timed disturbances and faults count from `t_start_s`."""
        t_start_s -= self._host.step_s(self._now_s)
        self._kernel.begin(_kernel_us(t_start_s))
        self._set_spans(t_start_s)

    def wait(self, until_s: float) -> None:
        """Move to `until_s`, or to the next arrival of bytes or of a frame before it.

        Farther, where the host's process is kept from running then.
        """
        self._move(self._host.world_s(until_s, self._now_s))
        runs_s = self._host.runs_at_s(self._now_s)
        while self._now_s < runs_s:
            self._move(runs_s)

    def _move(self, until_s: float) -> None:
        arrived = False
        while not arrived:
            frame_s = self._next_frame.arrival_s if self._next_frame else math.inf
            bytes_s = self._uplink[0][0] if self._uplink else math.inf
            target_s = min(until_s, frame_s, bytes_s)
            if not self._advance(target_s):
                continue
            self._now_s = max(self._now_s, target_s)
            arrived = self._take_arrivals() or target_s >= until_s

    def poll_frame(self) -> Frame | None:
        """Return the oldest frame not yet taken; it is drawn only now."""
        if not self._exposed:
            return None
        exposure, poses = self._exposed.popleft()
        repeated = any(start_s <= exposure.start_s < end_s for start_s, end_s in self._repeats)
        if repeated and self._last_frame is not None:
            again = replace(self._last_frame, index=exposure.index, t_cam_s=exposure.t_cam_s)
            self._last_frame = again
        elif self._maker is None:
            measured = self._drawn.measure(poses[0] if poses else None)
            self._last_frame = Frame(exposure.index, exposure.t_cam_s, None, measured)
        else:
            image = self._pictures.make(exposure.start_s, exposure.index, poses)
            self._last_frame = Frame(exposure.index, exposure.t_cam_s, image)
        step_s = sum(
            size_s
            for size_s, (start_s, end_s) in self._stamp_steps
            if start_s <= exposure.start_s < end_s
        )
        if not step_s:
            return self._last_frame
        return replace(self._last_frame, t_cam_s=exposure.t_cam_s + step_s)

    def truth(self) -> Truth:
        """Return the true state now."""
        state = self._kernel.state()
        pose = Pose(*self._pose_at(self._now_s))
        return Truth(pose, state[3], state[5], self._vehicle.flat_output(pose))

    def pose_at(self, t_s: float) -> Pose:
        """Return the true pose at a time of the last four seconds of `world_s`."""
        return Pose(*self._pose_at(t_s))

    def close(self) -> None:
        """End the program that works out the robot's motion, where there is one."""
        if self._outside is not None:
            self._outside.close()

    def deliver_to_board(self, t_s: float, data: bytes) -> None:
        """Let bytes reach the board's UART at `t_s`; in time order."""
        self._kernel.receive(_kernel_us(t_s), data)

    def _set_spans(self, t_begin_s: float) -> None:
        def spans(kind: str) -> list[Span]:
            return [_span(fault, t_begin_s) for fault in self._setup.faults if fault.kind == kind]

        self._stalls = spans("camera_stall")
        self._occlusions = spans("camera_occluded")
        self._repeats = spans("camera_repeated")
        self._stamp_steps = [
            (fault.step_s, _span(fault, t_begin_s))
            for fault in self._setup.faults
            if fault.kind == "camera_clock_step"
        ]
        both = spans("link_cut")
        self._down.cuts, self._up.cuts = both + spans("link_down_cut"), both + spans("link_up_cut")
        self._down.doubles = self._up.doubles = spans("link_duplicated")
        self._down.swaps = self._up.swaps = spans("link_reordered")
        self._pictures.begin(lambda fault: _span(fault, t_begin_s))
        self._host.begin(lambda fault: _span(fault, t_begin_s))

    def _advance(self, target_s: float) -> bool:
        """Run towards `target_s`; False when the board has sent bytes on the way."""
        target_us = _kernel_us(target_s)
        self._port.carry(target_s)
        try:
            reached_us = self._kernel.advance(target_us)
        except RuntimeError as error:
            raise RigFault(f"twin: {error}; check the robot's parameters") from None
        if self._outside is not None and self._outside.fault and not self._outside_told:
            self._outside_told = True  # once: the board must be told to stop after it
            raise RigFault(self._outside.fault)
        for t_us, data in self._kernel.take_sent():
            carried = self._up.carry(HOST_START_S + 1e-6 * t_us, data)
            if carried is not None:
                self._uplink.append(carried)
        return reached_us >= target_us

    def _take_arrivals(self) -> bool:
        """Move what has arrived by now to where the host reads; True when there was any."""
        arrived = False
        while self._uplink and self._uplink[0][0] <= self._now_s:
            self._arrived.append(self._uplink.popleft()[1])
            arrived = True
        while self._next_frame and self._next_frame.arrival_s <= self._now_s:
            self._exposed.append((self._next_frame, self._poses_over(self._next_frame)))
            self._next_frame = self._shutter.next(self._stalls)
            arrived = True
        return arrived

    def _pose_at(self, t_s: float) -> PoseTuple:
        t_us = 1e6 * (t_s - HOST_START_S)
        return self._kernel.pose_at(min(max(t_us, 0.0), self._kernel.time_us))

    def _poses_over(self, exposure: Exposure) -> tuple[PoseTuple, ...]:
        """Return the robot's poses from start to end of the exposure; none while it is hidden.

        Where no image is drawn it is the one pose at the middle.
        """
        for start_s, end_s in self._occlusions:
            if start_s <= exposure.start_s < end_s:
                return ()
        if self._maker is None:
            return (self._pose_at(0.5 * (exposure.start_s + exposure.end_s)),)
        # A rolling shutter's first and last rows are exposed earlier and later than the middle one.
        rows_s = 0.5 * self._readout_s
        count = POSES_PER_EXPOSURE if rows_s == 0.0 else POSES_PER_READOUT
        step_s = (exposure.end_s - exposure.start_s + 2.0 * rows_s) / (count - 1)
        return tuple(self._pose_at(exposure.start_s - rows_s + i * step_s) for i in range(count))


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
