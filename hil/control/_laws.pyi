"""Laws, differentiators and filters, compiled from hil/control/native.

A law acts on a pair (p, q) with dp/dt = q and returns w, the wanted dq/dt: with p in m, q is in
m/s, w in m/s^2, and a gain or layer has the unit that makes its term one of these. Up to six
dimensions; a gain given as a list of one counts for every axis. A wrong length raises ValueError.
"""

from collections.abc import Sequence

Vector = tuple[float, ...]

class Law:
    """What every law has; one tick is output, rate where it is needed, then advance."""

    @property
    def dim(self) -> int:
        """Number of dimensions n."""
    @property
    def s_norm(self) -> float:
        """||s|| of the latest output, 0 for a law without a sliding variable."""
    def reset(self, p: Sequence[float], q: Sequence[float]) -> None:
        """Start anew from (p, q)."""
    def output(self, t_s: float, p: Sequence[float], q: Sequence[float], dt_s: float) -> Vector:
        """Return w for the interval of dt_s that begins at t_s."""
    def rate(self, q_dot: Sequence[float]) -> Vector:
        """Return dw/dt of the latest output for a known dq/dt, sgn and eps held."""
    def advance(self, dt_s: float) -> None:
        """Integrate what the law keeps; leave it out while an output is limited."""

class AsgIsm(Law):
    """Averaged sub-gradient integral sliding mode (4.12)-(4.16), (4.20), (4.24).

    `mu_min` and `implicit` are extensions, off by default: mu stops falling at mu_min; the sliding
    term is the projection of s on the ball of radius k dt_s, which needs no layer. `dominating` is
    the gain law (4.14) as printed: no -kappa in w, k + 2 (||kappa|| + |d eps/dt|) outweighs it.
    `radial` takes H = sigma ||p||, which no turn of the axes changes.

    `without_kappa` leaves kappa out of the terms; `without_gamma` starts with eta of p(0) = q(0) = 0, so that
    s(0) is not 0. Both are off, and are there to see what a part is worth.
    """

    without_kappa: bool
    without_gamma: bool

    def __init__(
        self,
        *,
        k: Sequence[float],
        eps_min: Sequence[float],
        mu0_s: float,
        sigma: float,
        kd: Sequence[float] = ...,
        eps0: float = ...,
        beta: float = ...,
        mu_min: float = ...,
        componentwise: bool = ...,
        implicit: bool = ...,
        dominating: bool = ...,
        radial: bool = ...,
    ) -> None: ...
    def cost(self, p: Sequence[float]) -> float:
        """Return H(p) = sigma sum |p_i| (4.10), sigma ||p|| where `radial`."""
    def terms(
        self, t_s: float, p: Sequence[float], q: Sequence[float]
    ) -> tuple[Vector, Vector, Vector, Vector, Vector]:
        """Return s, kappa, Psi, the sub-gradient of H, and the layer eps; advance goes on from here."""
    @property
    def eta(self) -> Vector:
        """Eta = -p(0) - mu0 q(0) (4.24): s(0) = 0."""
    @property
    def averaged(self) -> Vector:
        """Integral of the sub-gradient."""

class StateFeedback(Law):
    """w = -kp p - kd q - ki * integral of p: PD and PID; P and PI of an error whose integral is p."""

    def __init__(
        self, *, kp: Sequence[float], kd: Sequence[float], ki: Sequence[float] = ...
    ) -> None: ...

class SlidingMode(Law):
    """Classical sliding mode (3.2): s = q + c p, w = -c q - k s/(||s|| + eps)."""

    def __init__(
        self,
        *,
        c: Sequence[float],
        k: Sequence[float],
        eps: Sequence[float],
        componentwise: bool = ...,
    ) -> None: ...

class UtkinIsm(Law):
    """Utkin's integral sliding mode (3.9)-(3.14) around the nominal w0 = -kp p - kd q."""

    def __init__(
        self,
        *,
        kp: Sequence[float],
        kd: Sequence[float],
        k: Sequence[float],
        eps: Sequence[float],
        componentwise: bool = ...,
    ) -> None: ...

class SuperTwisting:
    """Differentiator (6.15)-(6.16) of one signal whose second derivative stays within `bound`."""

    def __init__(
        self, *, bound: float, l1: float = ..., l0: float = ..., implicit: bool = ...
    ) -> None: ...
    def reset(self, x: float, rate: float = ...) -> None:
        """Start at the value x and rate."""
    def set_bound(self, bound: float) -> None:
        """Change the bound, for example by VariableGain."""
    @property
    def error(self) -> float:
        """Estimate minus signal at the latest step."""
    def step(self, x: float, dt_s: float) -> float:
        """Take the sample x, return the estimated rate, and move on by dt_s."""

class VariableGain:
    """The gain of (3.15): grows by `rate` (1/s) while the error keeps its sign, falls while not.

    The average of the sign over `average_s` is compared with `threshold` in (0, 1).
    """

    def __init__(
        self, *, low: float, high: float, rate: float, threshold: float, average_s: float
    ) -> None: ...
    def step(self, error: float, dt_s: float) -> float:
        """Return the gain after dt_s of this error."""

class LowPass:
    """First-order filter of time constant tau_s."""

    def __init__(self, tau_s: float) -> None: ...
    def reset(self, x: float) -> None:
        """Start at x."""
    @property
    def value(self) -> float:
        """The filtered signal."""
    def step(self, x: float, dt_s: float) -> float:
        """Return the filtered signal's rate and move on by dt_s."""

class SmoothCommand:
    """Critically damped second-order filter with its rate and acceleration."""

    def __init__(self, rate_rad_s: float) -> None: ...
    def reset(self, x: float) -> None:
        """Start at rest at x."""
    @property
    def value(self) -> float:
        """The smooth command."""
    @property
    def rate(self) -> float:
        """Its rate."""
    def acceleration(self, x: float) -> float:
        """Return its acceleration for the input x."""
    def step(self, x: float, dt_s: float) -> None:
        """Move on by dt_s under the input x."""
