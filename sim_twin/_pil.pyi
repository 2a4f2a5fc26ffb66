"""The firmware's ELF on a simulated ATmega2560 (native/pil); times are true microseconds."""

from typing import TypedDict

class Usage(TypedDict):
    """Processor cycles since power-up; an interrupt is (count, sum, worst) by vector number."""

    cycles: int
    asleep: int
    watchdog_resets: int
    wrong_sleeps: int
    interrupts: dict[int, tuple[int, int, int]]

class Board:
    """One board. `uart` is "0" (USB) or "1" (Bluetooth): the one whose line is connected.

    A rig hands it to the twin's kernel, which then drives it; a test may drive it alone: power up,
    then edges, bytes and advances in the order of their times. `ab` is (A << 1) | B; sides are 0
    left and 1 right.
    """

    def __init__(self, elf_path: str, uart: str, clock_ppm: float, eeprom: bytes) -> None: ...
    def handle(self) -> object:
        """Return what `sim_twin._native.Kernel` takes as its board."""
    def power_up(self, left_ab: int = 0, right_ab: int = 0) -> None:
        """Switch on at time 0 with these levels on the encoder lines."""
    def edge(self, t_us: float, side: int, ab: int) -> None:
        """Let an encoder's lines change between the last advance and the next."""
    def receive(self, t_us: int, data: bytes) -> None:
        """Let bytes come in on the line, the last one complete at `t_us`."""
    def advance_to(self, t_us: int, battery_v: float) -> None:
        """Run to `t_us`; RuntimeError when the processor has stopped for good."""
    def take_sent(self) -> list[tuple[int, bytes]]:
        """Return what has left the UART since last asked: (time the last byte left, bytes)."""
    def duty(self, side: int) -> float:
        """Return the share of the battery voltage on a motor as the pins stand, -1 to 1."""
    def jump(self, address: int) -> None:
        """Set the program counter, in bytes: how a test lets the program go astray."""
    def memory(self, address: int, size: int) -> bytes:
        """Return a piece of the data space (registers, I/O, RAM)."""
    def watch(self, trigger: int, address: int, size: int) -> None:
        """Keep a copy of a piece of RAM one step after each in which the byte at `trigger` changed."""
    def take_watched(self) -> list[bytes]:
        """Return the copies kept since last asked."""
    def eeprom(self, size: int) -> bytes:
        """Return the first bytes of the EEPROM."""
    def set_eeprom(self, data: bytes) -> None:
        """Overwrite the first bytes of the EEPROM."""
    def start_profile(self, part_of_word: bytes) -> None:
        """Count cycles by part from now on: one part number for each 16-bit word of flash."""
    def stop_profile(self) -> None:
        """Run at full speed again; the counts stay until the next start."""
    def profile(self) -> tuple[list[int], int, int]:
        """Return (cycles by part, longest stretch with interrupts off, where it ended)."""
    def usage(self) -> Usage:
        """Return what the run has cost."""
    @property
    def byte_cycles(self) -> int:
        """Cycles of one byte on the connected UART as the firmware has set it up."""
    @property
    def stack_used(self) -> int:
        """Deepest stack since power-up in bytes, from the paint it has worn off the RAM."""
    @property
    def complaints(self) -> list[str]:
        """What simavr has warned of since power-up."""
