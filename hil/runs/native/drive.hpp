// The controlled part of a run, tick by tick, without a step back into Python: for laws and references that
// have a native form (hil/control/translated.py). hil/runs/session.py does the same for any law.
#pragma once

#include <cstdint>
#include <vector>

#include "outer_laws.hpp"
#include "pump.hpp"

namespace runs {

struct Plan {
  double t0_s, period_s;  // of the first tick on the host's clock; between two
  std::int64_t ticks;
};

struct BoardLimits {
  std::int64_t top_counts;
  double most_counts, stall_counts;
};

class Drive {
 public:
  // kAsked: the host has to stop the robot; who asks again is told why.
  // Of a part alone: kAway, its rig has to be moved on; kLaw, others have to answer for its law.
  enum Stop { kDone, kHeard, kTaken, kPaused, kAsked, kAway, kLaw };
  using Keys = std::vector<int>;  // places in a law's trace, -1 for what it does not have

  Drive(Pump& pump, Watch& watch, outer::OuterLaw& law, outer::Reference& reference,
        const outer::BelievedGeometry& geometry, const Plan& plan, Keys common, Keys own)
      : pump_(pump), watch_(watch), law_(law), reference_(reference), geometry_(geometry), plan_(plan),
        common_(std::move(common)), own_(std::move(own)) {}

  // Goes on until Python is needed; `busy` is that of Pump, `refused` that the board refused a set-point.
  Stop run(bool busy, bool refused, const BoardLimits& board) { return go(busy, refused, board, false); }
  // The same up to what several runs have done for them side by side (together.hpp).
  Stop part(bool busy, bool refused, const BoardLimits& board) { return go(busy, refused, board, true); }
  Pump& pump() { return pump_; }

  double reached_s() const { return reached_s_; }  // time of the last arrival that was waited for
  std::vector<double> rows;                        // of ticks, not yet taken

 private:
  static constexpr int kPause = 256;  // ticks after which Python may see to signals and threads

  double due_s() const { return plan_.t0_s + static_cast<double>(tick_) * plan_.period_s; }
  Stop go(bool busy, bool refused, const BoardLimits& board, bool apart);
  bool begin_tick(bool refused, const BoardLimits& board);
  bool ask();
  outer::Estimate look(double now_s, const BoardLimits& board);
  void act();
  void put_terms(const Keys& keys, const outer::Trace& trace);

  Pump& pump_;
  Watch& watch_;
  outer::OuterLaw& law_;
  outer::Reference& reference_;
  outer::BelievedGeometry geometry_;
  Plan plan_;
  Keys common_, own_;
  std::int64_t tick_ = 0;
  bool under_way_ = false;  // the wait for the next tick
  bool begun_ = false;      // the tick: the law is to be asked
  bool reset_ = false;      // the law was
  double now_s_ = 0.0;      // of the tick
  outer::Estimate estimate_;
  outer::ReferenceState wanted_;
  outer::OuterCommand command_{};
  double reached_s_ = -kInfinite;
};

}  // namespace runs
