"""Writes the outer laws, what all laws share, and the references as C++, from their Python source.

Run while the extension modules are built (CMakeLists.txt beside it); no other code calls it. The Python
source is the one source: it is what is read, changed, subclassed and stepped one tick at a time. The C++
made of it (hil/core/to_cpp) has the same operations in the same order, so that a run that advances in native
code is the same run to the bit. Hashes of the sources go into it: where one has changed since, a run is made
in Python (hil/control/translated.py).
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[4]))  # the package need not be installed yet

from hil.core.to_cpp.kinds import NotUnderstoodError, Part
from hil.core.to_cpp.modules import Translation

_RETUNE = ("retune", "_retuned")  # gains that change on the way are changed in Python

PARTS = (
    Part("hil/core/types.py", ("Pose", "Estimate", "ReferenceState", "OuterCommand")),
    Part("hil/config/control.py", ("OuterLimits", "CircleReference")),
    Part("hil/control/estimators/geometry.py", ("BelievedGeometry",), leave=("body",)),
    # Native code goes from its geometry straight to the wheels: only as long as this says the same.
    Part("hil/control/vehicles/vehicle.py", ()),
    Part("hil/control/bounds.py", ("disturbance_bound",)),
    Part(
        "hil/control/laws/chain.py",
        (
            "ChainState", "ChainCommand", "clip", "damped_inverse", "Chain", "executed_jerk",
            "restrict", "authority",
        ),
    ),
    Part("hil/control/laws/trace.py", ("make_trace",)),
    Part(
        "hil/control/laws/stages.py",
        (
            "StartGains", "StageGains", "Stage", "Wish", "begin", "power", "backstep", "StagedLaw",
            "projected", "sliding_terms",
        ),
    ),
    Part(
        "hil/control/laws/state_feedback.py",
        ("PidGains", "StateFeedback", "nested_jerk"),
        leave=_RETUNE,
    ),
    Part("hil/control/laws/asg_ism.py", ("AsgIsmGains", "is_norm", "_block", "AsgIsm"), leave=_RETUNE),
    Part(
        "hil/control/laws/asg_ism_implicit.py",
        ("AsgIsmImplicitGains", "AsgIsmImplicit"),
        leave=_RETUNE,
    ),
    Part("hil/control/laws/backstepping.py", ("BacksteppingGains", "Backstepping"), leave=_RETUNE),
    Part("hil/control/laws/dob_pid.py", ("DobPidGains", "Observer", "DobPid"), leave=_RETUNE),
    Part(
        "hil/control/laws/integral_sliding_mode.py",
        ("IntegralSlidingModeGains", "IntegralSlidingMode"),
        leave=_RETUNE,
    ),
    Part("hil/control/laws/sliding_mode.py", ("SlidingModeGains", "SlidingMode"), leave=_RETUNE),
    Part(
        "hil/control/laws/super_twisting.py",
        ("SuperTwistingGains", "SuperTwisting", "twisted"),
        leave=_RETUNE,
    ),
    Part("hil/control/laws/hold.py", ("HoldAtGoal",)),
    Part("hil/control/laws/within.py", ("WithinWheelSpeed",)),
    Part("hil/control/laws/turn_first.py", ("TurnFirst",)),
    Part("hil/control/laws/let_go.py", ("LetGo",)),
    Part("hil/control/laws/parts.py", ("WithoutFeedForward", "_at_rest")),
    Part("hil/control/laws/axes.py", ("TurnedAxes",), pairs="_pairs"),
    Part(
        "hil/control/references.py",
        ("Point", "Circle", "Waypoints", "Stops", "_interval", "_chain_rule"),
        {
            "Point": (("_state", "ReferenceState"),),
            "Waypoints": (
                ("_length", "double"), ("_knots", "std::vector<double>"),
                ("_pieces", "std::vector<Piece>"), ("duration_s", "double"),
            ),
            "Stops": (("_legs", "std::vector<Waypoints>"), ("_begins_s", "std::vector<double>")),
        },
        leave=("_shortest_duration", "_needed_s", "share_of_way"),
    ),
)  # fmt: skip

# Stands behind the values that a law is given and gives.
INTERFACES = """
class OuterLaw {
 public:
  virtual ~OuterLaw() = default;
  virtual void reset(const ReferenceState& reference, const Estimate& estimate) = 0;
  virtual OuterCommand step(const ReferenceState& reference, const Estimate& estimate, double dt_s) = 0;
};

struct AnyLaw {  // the law inside another, which its maker keeps
  OuterLaw* law = nullptr;
  void reset(const ReferenceState& reference, const Estimate& estimate) { law->reset(reference, estimate); }
  OuterCommand step(const ReferenceState& reference, const Estimate& estimate, double dt_s) {
    return law->step(reference, estimate, dt_s);
  }
};

class Reference {
 public:
  virtual ~Reference() = default;
  virtual ReferenceState at(double t_s) = 0;
};

using Piece = std::tuple<double, std::vector<double>, std::vector<double>>;
"""


def main(root: str, out: str) -> None:
    """Write the header for the source tree `root`."""
    text = Translation(Path(root), PARTS, {PARTS[0].path: INTERFACES}).text()
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    Path(out).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except NotUnderstoodError as error:
        sys.exit(f"translate.py: not understood: {error}")
