"""Control laws, differentiators and filters, each once for every vehicle (compiled, pure).

A law acts on a pair (p, q) with dp/dt = q in up to six dimensions and returns w, the wanted dq/dt.
"""

from hil.control._laws import (
    AsgIsm,
    Law,
    LowPass,
    SlidingMode,
    SmoothCommand,
    StateFeedback,
    SuperTwisting,
    UtkinIsm,
    VariableGain,
)

__all__ = [
    "AsgIsm",
    "Law",
    "LowPass",
    "SlidingMode",
    "SmoothCommand",
    "StateFeedback",
    "SuperTwisting",
    "UtkinIsm",
    "VariableGain",
]
