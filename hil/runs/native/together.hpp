// The controlled parts of several runs, advanced side by side: each goes on by itself until its rig has to be
// moved, and the rigs are then moved together. A run is to the bit what it is alone.
#pragma once

#include <cstddef>
#include <exception>
#include <utility>
#include <vector>

#include "drive.hpp"

namespace runs {

class Together {
 public:
  enum Stop { kFailed = -1 };  // besides those of Drive

  // Takes a run in, which begins once it is told to go on; returns its place.
  std::size_t add(Drive& drive);
  // A run that stopped goes on; what the arguments are: Drive::run.
  void go_on(std::size_t place, bool busy, bool refused, const BoardLimits& board);
  // The law of a run has been answered.
  void answered(std::size_t place) { members_.at(place).state = kReady; }

  // A run has ended.
  void end(std::size_t place) { members_.at(place).state = kOut; }

  // Advances all until one or more need somebody: their places, and why. None: those in `waiting` wait for their
  // laws' answers; if it is empty too there may be signals to see to.
  const std::vector<std::pair<std::size_t, int>>& run();
  const std::vector<std::size_t>& waiting() const { return waiting_; }
  // Throws what the run at `place` threw.
  [[noreturn]] void rethrow(std::size_t place);

 private:
  static constexpr int kPause = 1024;       // rounds after which Python may see to signals and threads
  static constexpr std::size_t kShare = 2;  // of those whose laws others answer one in so many waits

  enum State { kReady, kMoving, kAsking, kOut };
  struct Member {
    Drive* drive;
    State state = kOut;
    bool busy = false, refused = false, asks = false;
    BoardLimits board{};
    std::exception_ptr failed;
  };

  void part(std::size_t place);
  bool are_waiting();
  void fail(std::size_t place, std::exception_ptr failed);
  void move();

  std::vector<Member> members_;
  std::vector<std::pair<std::size_t, int>> stops_;
  std::vector<std::size_t> waiting_, moving_;
  std::vector<core::SimulatedRig::Wait> waits_;
};

}  // namespace runs
