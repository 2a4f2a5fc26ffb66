// The boundary below which simulated targets differ (hil/core/rig.py), as native code meets it: bytes to and
// from the board, poses of a camera that gives them itself or its pictures, a clock. Times are host times in s.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>

namespace core {

// What the localiser says of one frame; `reason` says why the robot was not seen.
struct PoseFrame {
  std::int64_t index = 0;
  double t_cam_s = 0.0;  // middle of the exposure on the camera's clock
  bool seen = false;
  double x_m = 0.0, y_m = 0.0, theta_rad = 0.0;
  double quality = 0.0;
  double sigma_xy_m = 0.001, sigma_theta_rad = 0.005;
  const char* reason = "";
  // A frame that brings a picture instead: somebody has to find the pose in it. What equal pictures have equal.
  bool pictured = false;
  std::string picture;
};

struct Truth {  // z1 is the flat output with the robot's true d0
  double x_m, y_m, theta_rad, eta1_m_s, theta_dot_rad_s, z1_x_m, z1_y_m;
};

class SimulatedRig {
 public:
  virtual ~SimulatedRig() = default;
  virtual double now_s() const = 0;
  // Returns at until_s, or as soon as bytes or a frame have arrived.
  virtual void wait(double until_s) = 0;
  // The same in halves, so that several rigs can be moved on side by side: `move` goes towards the next arrival,
  // `arrived` tells whether the wait is over; where it is not, move again.
  virtual void move(double until_s) = 0;
  virtual bool arrived(double until_s) = 0;
  // A wait of one rig of several; `failed` is what its move threw.
  struct Wait {
    SimulatedRig* rig;
    double until_s;
    std::exception_ptr failed;
  };
  // Moves several rigs of this one's kind, as `move` does one by one.
  virtual void move_together(Wait* waits, std::size_t count) = 0;
  // Every byte that has arrived by now.
  virtual std::string read() = 0;
  // Sends the bytes towards the board; throws RigFault when the port is full.
  virtual void write(const std::string& data) = 0;
  // The oldest frame that has arrived and was not yet taken; false when there is none.
  virtual bool take_frame(PoseFrame& frame) = 0;
  virtual Truth truth() const = 0;
};

constexpr char kSimulatedRig[] = "core::SimulatedRig";  // name of the capsule that hands one about

}  // namespace core
