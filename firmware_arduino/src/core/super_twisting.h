// Super-twisting differentiator of docs/wheel-loop.md, Levant form of (3.15), (6.15)-(6.16).
#ifndef HIL_CORE_SUPER_TWISTING_H
#define HIL_CORE_SUPER_TWISTING_H

#include <stdint.h>

namespace hil {

enum class Scheme : uint8_t { EXPLICIT = 0, SEMI_IMPLICIT = 1, IMPLICIT = 2 };

// What one step may take off x1 and x2 for a given L, worked out off the tick.
struct SuperTwistingSteps {
  float root;     // dt l1 sqrt(L): weight of |e|^(1/2) in x1
  float root_sq;  // its square
  float half_root, quarter_root_sq;
  float sign;   // dt^2 l0 L: what the sign term does to x1 through x2 in one step
  float slope;  // dt l0 L: what the sign term takes off x2
};

struct SuperTwistingGains {
  Scheme scheme;
  bool variable;  // L follows (3.15) between l_min and l_max, otherwise stays l_max
  float dt_s;
  float l0, l1;
  float cell;   // half width of the measurement's quantisation cell, units of x
  float l_max;  // units of x per s^2
  float l_min;
  float grow;                // dt rho_k
  float alpha;               // equivalent sign above which L grows
  SuperTwistingSteps steps;  // for l_max
};

SuperTwistingGains super_twisting_gains(Scheme scheme, float l, float l0, float l1, float cell, float dt_s);
// Lets L move between l_min and the l given above at the rate rho (3.15).
void super_twisting_vary(SuperTwistingGains& gains, float l_min, float rho_1_s, float alpha);

// The state holds the error instead of x1_hat itself: an unwrapped encoder angle outgrows the 24 bits
// of a float, the error never does.
struct SuperTwisting {
  float error;    // x1_hat - x
  float x2;       // estimate of dx/dt
  float sign_eq;  // low-passed sign term, the equivalent control of (3.15); variable gain only
  float l;        // L in force; variable gain only
};

// Starts at rest on the present measurement.
void super_twisting_reset(SuperTwisting& st, const SuperTwistingGains& gains);

// Takes the change of x over one step; returns the new x2. An error inside the quantisation cell counts
// as none: between two counts of an encoder there is nothing to correct.
// Float operations, sqrt as four: explicit 13, semi-implicit 15, implicit 16; variable gain +16.
float super_twisting_step(SuperTwisting& st, const SuperTwistingGains& gains, float dx);

}  // namespace hil

#endif
