"""Robot model, lockstep kernel and camera renderer, compiled from sim_twin/native.

SI units. World X right, Y up; body x forward, y left; theta counter-clockwise. Left is 0, right 1.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from hil.core.rig import LineBacklog

PARAMETERS: tuple[str, ...]
"""Names of the attributes of PlantParams besides `slip`."""
STATES: tuple[str, ...]
"""Names of the entries of Plant.state and Kernel.state()."""
LOADS: tuple[str, ...]
"""Targets of disturbances, by number."""
SHAPES: tuple[str, ...]
"""Shapes of disturbances, by number."""
FAULTS: tuple[str, ...]
"""Kinds of faults of robot and board, by number."""

Zone = tuple[float, float, float]
"""World X, Y and radius in m; radius 0 is everywhere."""

class PlantParams:
    """Parameters of the robot model; the names in PARAMETERS, all floats, all 0 at first."""

    slip: bool
    castor: bool
    castor_friction_ratio: float
    lifted: bool
    def __setattr__(self, name: str, value: float, /) -> None: ...
    def __getattr__(self, name: str, /) -> float: ...

CHAINS: tuple[str, ...]

def chained(chain: int, operations: int) -> float:
    """Do operations of a kind of CHAINS, each of which waits for the result of the one before."""

def widest_register() -> int:
    """Return how many doubles a register of this processor holds at most: 2, 4 or 8."""

def side_by_side(width: int, operations: int, quotients: bool = False) -> int:
    """Do at least so many independent sums and products, or quotients, `width` doubles a register.

    Returns how many; 0 where the processor does not have the width.
    """

class Plant:
    """The robot alone: bridge duty in, motion out."""

    state: Sequence[float]
    def __init__(self, params: PlantParams) -> None: ...
    def reset(self, x_m: float, y_m: float, theta_rad: float) -> None:
        """Put it at rest at a pose with the battery's start charge."""
    def step(self, h_s: float, duty_left: float, duty_right: float, loads: Sequence[float]) -> None:
        """Take one RK4 step with duty (-1..1) and loads (in the order of LOADS) held."""
    def run(
        self,
        steps: int,
        h_s: float,
        duty_left: float,
        duty_right: float,
        loads: Sequence[float] | None,
    ) -> None:
        """Take many such steps; without loads a robot that stands costs a twentieth, same bits."""
    def derivative(
        self, duty_left: float, duty_right: float, loads: Sequence[float]
    ) -> list[float]:
        """Return the time derivative of the state."""
    def battery_v(self, duty_left: float, duty_right: float) -> float:
        """Return the battery's terminal voltage at these duties and the present currents."""

class Encoder:
    """One two-channel encoder; angle 0 at first."""

    def __init__(self, counts_per_turn: int) -> None: ...
    def move(
        self,
        angle_rad: float,
        t0_us: float,
        h_us: float,
        dead_a: bool = False,
        dead_b: bool = False,
        swapped: bool = False,
    ) -> list[tuple[float, int]]:
        """Turn evenly to `angle_rad` in `h_us`; return (time, (A << 1) | B) of every edge."""

def disturbance_value(
    shape: int,
    amplitude: float,
    start_s: float,
    end_s: float,
    frequency_hz: float,
    phase_rad: float,
    seed: int,
    zone: Zone,
    t_s: float,
    x_m: float,
    y_m: float,
) -> float:
    """Return what a disturbance adds at a time and place."""

def host_board(
    clock_ppm: float, clock_start_us: int, baud: float, wired: bool = False, eeprom: bytes = b""
) -> object:
    """Return the handle of a board that is the firmware core compiled for this machine."""

class Kernel:
    """Robot and board in lockstep; its clock counts whole microseconds from reset.

    `board` is the handle of a board: `host_board`, or `sim_twin._pil.Board.handle`.
    """

    def __init__(
        self, params: PlantParams, step_us: int, counts_per_turn: int, board: object
    ) -> None: ...
    def reset(self, x_m: float, y_m: float, theta_rad: float) -> None:
        """Put the robot at rest at a pose, switch the board on, set the clock to zero."""
    def add_disturbance(
        self,
        load: int,
        shape: int,
        amplitude: float,
        start_s: float,
        end_s: float,
        frequency_hz: float,
        phase_rad: float,
        seed: int,
        zone: Zone,
    ) -> None:
        """Add a disturbance; times count from `begin`."""
    def add_fault(
        self, kind: int, left: bool, right: bool, start_s: float, end_s: float,
        strength: float = 1.0,
    ) -> None:  # fmt: skip
        """Add a fault; times count from `begin`, and one with start 0 is there before it too."""
    def set_outside(
        self,
        outside: Callable[[int, Sequence[float], Sequence[float], Sequence[float]], list[float]],
        period_us: int,
    ) -> None:
        """Have the state once a period from outside: (t_us, volts, loads, jam) -> the state at its end."""
    def begin(self, t_us: int) -> None:
        """Let the times of disturbances and faults count from `t_us`."""
    def advance(self, t_us: int) -> int:
        """Run to `t_us`, or to the end of the step in which the board sent; return the time.

        Raises RuntimeError when the state diverges.
        """
    def receive(self, t_us: int, data: bytes) -> None:
        """Let bytes reach the board's UART, the last one at `t_us`; in time order."""
    def take_sent(self) -> list[tuple[int, bytes]]:
        """Return what left the board's UART: time of the last byte in us, and the bytes."""
    def pose_at(self, t_us: float) -> tuple[float, float, float]:
        """Return X, Y, theta at a time of the last four seconds; raises IndexError outside."""
    def state(self) -> tuple[float, ...]:
        """Return the state now, in the order of STATES."""
    @property
    def time_us(self) -> int:
        """Kernel time."""
    @property
    def battery_v(self) -> float:
        """Terminal voltage of the battery."""
    @property
    def duty(self) -> tuple[float, float]:
        """Share of the battery voltage on the left and right motors, -1..1."""
    @property
    def true_counts(self) -> tuple[int, int]:
        """Encoder counts of the left and right wheel as a sound encoder would show them."""

# Link, camera timing, drawn poses and the rig about them (rig_bind.cpp). Times are host times in s;
# `chance` is the state of a random.Random, getstate()[1].

_Span = tuple[float, float]

def lane_widths() -> list[int]:
    """Return how many robots this processor can move side by side, 1 (one by one) first."""

def plant_lane_time(params: PlantParams, lanes: int, runs: int, steps: int) -> float:
    """Return the processor time in s of `steps` plain steps of `runs` rolling robots, `lanes` side by side.

    Without boards and encoders; `runs` is a multiple of `lanes`, which is one of `lane_widths`.
    """

def directions(
    angle_rad: NDArray[np.float64], lanes: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cosines and sines of the angles as a step of the plant has them, `lanes` side by side."""

def advance_together(
    kernels: Sequence[Kernel], t_us: Sequence[int], lanes: int = 0
) -> list[tuple[int | str, int]]:
    """Do `Kernel.advance` of each, side by side; the same bits for every number of `lanes` (0: the widest).

    Returns for each the time reached, or the text of what `advance` raises, and how many of its steps were
    taken in a lane. No kernel may be there twice. Raises ValueError where the processor lacks the width.
    """

class Serialiser:
    """A UART that sends one byte after the other, `byte_s` each."""

    def __init__(self, byte_s: float) -> None: ...
    def send(self, t_s: float, size: int) -> float:
        """Return the time at which the last of `size` bytes given at `t_s` has left."""

class Channel:
    """One direction of the link behind the serial port; chunks arrive in the order they left."""

    cuts: Sequence[_Span]
    doubles: Sequence[_Span]
    swaps: Sequence[_Span]
    def __init__(
        self,
        latency_s: float,
        jitter_s: float,
        to_good: float,
        to_bad: float,
        corruption_ratio: float,
        chance: Sequence[int],
    ) -> None: ...
    def carry(self, t_s: float, data: bytes) -> tuple[float, bytes] | None:
        """Return arrival time and bytes of a chunk that left at `t_s`; None when it is lost."""

class Shutter:
    """Draws the exposures one after the other."""

    def __init__(
        self,
        period_s: float,
        exposure_s: float,
        latency_s: float,
        jitter_s: float,
        drop_ratio: float,
        t_first_s: float,
        clock_start_s: float,
        clock_rate: float,
        most_sigmas: float,
        chance: Sequence[int],
    ) -> None: ...
    def next(self, stalls: Sequence[_Span]) -> tuple[int, float, float, float, float] | None:
        """Return index, start, end, stamp and arrival of the next frame; stalls in order of start."""

LOCALISER_ERROR: tuple[str, ...]

class DrawnPoses:
    """What a localiser would say of a pose; `error` in the order of LOCALISER_ERROR."""

    def __init__(
        self,
        error: Sequence[float],
        swapped: bool,
        shift_m: float,
        chance: Sequence[int],
    ) -> None: ...
    def measure(
        self, x_m: float, y_m: float, theta_rad: float
    ) -> tuple[float, float, float] | None:
        """Return the pose seen; None where the localiser misses the robot."""

class Rig:
    """Kernel, line, radio and camera between two looks of the host; its clock is host time."""

    def __init__(
        self,
        kernel: Kernel,
        start_s: float,
        baud: int,
        down: Channel,
        up: Channel,
        shutter: Shutter,
        readout_s: float = 0.0,
    ) -> None: ...
    def set_spans(self, stalls: Sequence[_Span], hidden: Sequence[_Span]) -> None:
        """Set when the camera stalls (in order of start) and the robot is hidden."""
    @property
    def down(self) -> Channel:
        """Way from host to board, for the times of its faults."""
    @property
    def up(self) -> Channel:
        """Way from board to host."""
    def pose_at(self, t_s: float) -> tuple[float, float, float]:
        """Return X, Y, theta at a time of the last four seconds."""
    def now_s(self) -> float:
        """Return the host clock."""
    def wait(self, until_s: float, poses: int) -> None:
        """Move to `until_s`, or to the next arrival before it; raises RuntimeError as Kernel.advance."""
    def advance(self, until_s: float) -> None:
        """Run towards the next arrival, the first half of `wait`."""
    def arrive(self, until_s: float, poses: int) -> bool:
        """Take what has arrived, the second half; False when there is further to run."""
    def read(self) -> bytes:
        """Return what has arrived from the board."""
    def send(self, data: bytes) -> None:
        """Give the host's port bytes now."""
    def discard_unsent(self) -> None:
        """Forget what the line has not begun to carry."""
    def take_frame(
        self,
    ) -> tuple[int, float, float, tuple[tuple[float, float, float], ...]] | None:
        """Return index, start and stamp of the oldest frame that has arrived, and the robot's poses."""
    def truth(self) -> tuple[float, float, float, float, float]:
        """Return X, Y, theta, eta1 and theta_dot now."""

# The renderer (render_bind.cpp). Lengths in m, sizes in px, colours (blue, green, red).

_Colour = Sequence[float]

class View:
    """Size, lens and pose of the camera."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    dist: Sequence[float]
    below: Sequence[float]
    fisheye: bool
    R: Sequence[float]
    t: Sequence[float]

class Patch:
    """Disc or rectangle on the robot's plate."""

    disc: bool
    mark: bool
    x: float
    y: float
    half_x: float
    half_y: float
    colour: _Colour

class Grid:
    """Square grid of black and white cells on the plate."""

    cells: int
    x: float
    y: float
    half: float
    margin: float
    white: Sequence[int]

class Block:
    """Box or flat disc on the floor."""

    disc: bool
    x: float
    y: float
    half_x: float
    half_y: float
    theta: float
    top: float
    colour: _Colour

class Bar:
    """Straight bar above the robot."""

    body: bool
    x0: float
    y0: float
    x1: float
    y1: float
    half_width: float
    z: float
    colour: _Colour

class Robot:
    """What the camera sees of the robot."""

    half_length: float
    half_width: float
    bottom: float
    top: float
    wheel_radius: float
    wheel_half_width: float
    half_track: float
    half_base: float
    axle_x: float
    plate: _Colour
    side: _Colour
    tyre: _Colour
    hub: _Colour
    patches: Sequence[Patch]
    tag: Grid

class Scene:
    """Floor, light and sensor."""

    floor: _Colour
    blocks: Sequence[Block]
    bars: Sequence[Bar]
    white_balance: _Colour
    blur: float
    read_noise: float
    dn_per_electron: float
    lamp_x: float
    lamp_y: float
    shade: float
    def set_texture(self, image: NDArray[np.float32], step: float) -> None:
        """Set the floor's reflectance factor, periodic, `step` m per px."""
    def set_light(self, light: NDArray[np.float32], glare: NDArray[np.float32]) -> None:
        """Set DN of a white surface and DN added, per pixel."""

class Renderer:
    """Draws frames of one scene from one view."""

    def __init__(self, view: View, scene: Scene, robot: Robot, seed: int) -> None: ...
    def reseeded(self, seed: int) -> Renderer:
        """Return the same scene with the noise of another seed."""
    def make(self, index: int, poses: Sequence[tuple[float, float, float]]) -> NDArray[np.uint8]:
        """Return frame `index`, (height, width, 3) BGR; no poses: the empty scene."""
    def blank(self) -> NDArray[np.uint8]:
        """Return memory for a frame, nothing drawn in it."""
    def draw(
        self,
        index: int,
        poses: Sequence[tuple[float, float, float]],
        window: tuple[int, int, int, int],
        image: NDArray[np.uint8],
    ) -> None:
        """Draw the pixels of a window (left, top, right, bottom) of that frame into `image`."""

def floor_map(view: View) -> NDArray[np.float64]:
    """Return world (X, Y) on the floor seen by every pixel, (height, width, 2)."""

def project(view: View, x: float, y: float, z: float) -> list[float]:
    """Return the pixel (u, v) of a world point; raises ValueError behind the camera."""

class DrawnRig:
    """The rig with drawn poses or pictures for a camera, as native code of the host drives it."""

    def __init__(
        self,
        rig: Rig,
        drawn: DrawnPoses,
        backlog: LineBacklog,
        quality: float,
        sigma_xy_m: float,
        sigma_theta_rad: float,
        true_d0_m: float,
        poses: int,
    ) -> None:
        """`poses` are those that a picture takes along; with 0 of them frames bring drawn poses."""

    def set_faults(
        self, repeats: Sequence[_Span], stamp_steps: Sequence[tuple[float, _Span]]
    ) -> None:
        """Take when frames repeat the one before, and by how much stamps are off in other times."""

    def take_frame(self) -> tuple[int, float, tuple[float, float, float] | None, str] | None:
        """Return number, stamp, pose (None where the robot was not seen) and why not."""

    def shown(self) -> tuple[int, float, tuple[tuple[float, float, float], ...]] | None:
        """Return number, begin and poses of what the picture of the frame taken last shows.

        Of one that repeats the frame before it is that one's; None before the first, or without pictures.
        """

    def handle(self) -> object:
        """Return what native code takes; it lives as long as this."""
