#include "together.hpp"

#include <typeinfo>

namespace runs {

std::size_t Together::add(Drive& drive) {
  members_.push_back({&drive});
  return members_.size() - 1;
}

void Together::go_on(std::size_t place, bool busy, bool refused, const BoardLimits& board) {
  Member& member = members_.at(place);
  member.state = kReady;
  member.busy = busy;
  member.refused = refused;
  member.board = board;
}

const std::vector<std::pair<std::size_t, int>>& Together::run() {
  stops_.clear();
  waiting_.clear();
  for (int round = 0; round < kPause; ++round) {
    moving_.clear();
    for (std::size_t place = 0; place < members_.size(); ++place) {
      if (members_[place].state == kReady) part(place);
      if (members_[place].state == kMoving) moving_.push_back(place);
    }
    if (!stops_.empty() || are_waiting()) return stops_;
    if (moving_.empty()) break;
    move();
    if (!stops_.empty()) return stops_;
  }
  return stops_;
}

// Whether so many wait for their laws' answers that it is time: where all others waited for the last, few rigs
// would be left to be moved together.
bool Together::are_waiting() {
  std::size_t asking = 0;
  for (std::size_t place = 0; place < members_.size(); ++place) {
    const Member& member = members_[place];
    if (member.state != kOut && member.asks) ++asking;
    if (member.state == kAsking) waiting_.push_back(place);
  }
  if (waiting_.empty() || moving_.empty() || kShare * waiting_.size() >= asking) return !waiting_.empty();
  waiting_.clear();
  return false;
}

// Lets a run go on up to what it cannot do by itself.
void Together::part(std::size_t place) {
  Member& member = members_[place];
  try {
    int stop = Drive::kPaused;
    while (stop == Drive::kPaused) stop = member.drive->part(member.busy, member.refused, member.board);
    member.state = stop == Drive::kAway ? kMoving : stop == Drive::kLaw ? kAsking : kOut;
    if (member.state == kAsking) member.asks = true;
    if (member.state == kOut) stops_.emplace_back(place, stop);
  } catch (...) {
    fail(place, std::current_exception());
  }
}

void Together::fail(std::size_t place, std::exception_ptr failed) {
  members_[place].failed = std::move(failed);
  members_[place].state = kOut;
  stops_.emplace_back(place, kFailed);
}

// Moves the rigs of those in moving_ towards their next arrivals, those of a kind in one go.
void Together::move() {
  waits_.clear();
  for (const std::size_t place : moving_) {
    Pump& pump = members_[place].drive->pump();
    waits_.push_back({&pump.rig(), pump.away_until_s(), nullptr});
  }
  for (std::size_t begin = 0, end; begin < waits_.size(); begin = end) {
    const std::type_info& kind = typeid(*waits_[begin].rig);
    for (end = begin + 1; end < waits_.size() && typeid(*waits_[end].rig) == kind;) ++end;
    waits_[begin].rig->move_together(&waits_[begin], end - begin);
  }
  for (std::size_t i = 0; i < waits_.size(); ++i) {
    if (waits_[i].failed) {
      fail(moving_[i], waits_[i].failed);
    } else if (waits_[i].rig->arrived(waits_[i].until_s)) {
      members_[moving_[i]].state = kReady;
    }
  }
}

void Together::rethrow(std::size_t place) {
  std::exception_ptr failed;
  failed.swap(members_.at(place).failed);
  std::rethrow_exception(failed);
}

}  // namespace runs
