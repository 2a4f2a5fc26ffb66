#include "fast.h"

#include "super_twisting.h"

#include <math.h>

#include "flt.h"

namespace hil {

namespace {

// What a step takes off x1 (`root`, includes the sign term where x2 is advanced first) and how much of
// the sign term acts on x2 (`sign`, within [-1, 1]).
struct Correction {
  float root;
  float sign;
};

// Distance of x to the cell [-cell, cell], signed.
float outside(float x, float cell) {
  const float size = fabsf(x);
  return size > cell ? copysignf(size - cell, x) : 0.0f;
}

// Root and sign at the old error, as forward Euler reads.
Correction explicit_euler(float error, const SuperTwistingSteps& st) {
  return {with_sign(st.root * sqrtf(fabsf(error)), error), with_sign(1.0f, error)};
}

// Root of the predicted error, but never past zero; the sign fades in proportion over the same zone.
Correction semi_implicit(float predicted, const SuperTwistingSteps& st) {
  const float size = fabsf(predicted);
  if (size <= st.root_sq) return {predicted, predicted / st.root_sq};
  return {copysignf(st.root * sqrtf(size), predicted), copysignf(1.0f, predicted)};
}

// Backward Euler: solves e + root |e|^(1/2) sgn e + sign sgn e = predicted, with sgn set-valued at 0.
Correction implicit_euler(float predicted, const SuperTwistingSteps& st) {
  const float size = fabsf(predicted);
  if (size <= st.sign) return {predicted, predicted / st.sign};
  const float y = sqrtf(st.quarter_root_sq + (size - st.sign)) - st.half_root;
  return {copysignf(size - y * y, predicted), copysignf(1.0f, predicted)};
}

SuperTwistingSteps steps_for(const SuperTwistingGains& g, float l) {
  const float root = g.dt_s * g.l1 * sqrtf(l);
  const float slope = g.dt_s * g.l0 * l;
  const float half = 0.5f * root;
  return {root, root * root, half, half * half, g.dt_s * slope, slope};
}

// (3.15): L grows while the equivalent sign shows that it barely suffices, and shrinks otherwise.
void vary_gain(SuperTwisting& st, const SuperTwistingGains& g, float sign) {
  st.sign_eq += g.grow * (sign - st.sign_eq);
  const float change = g.grow * st.l;
  st.l += fabsf(st.sign_eq) > g.alpha ? change : -change;
  if (st.l > g.l_max) st.l = g.l_max;
  if (st.l < g.l_min) st.l = g.l_min;
}

}  // namespace

SuperTwistingGains super_twisting_gains(Scheme scheme, float l, float l0, float l1, float cell, float dt_s) {
  SuperTwistingGains g;
  g.scheme = scheme;
  g.variable = false;
  g.dt_s = dt_s;
  g.l0 = l0;
  g.l1 = l1;
  g.cell = cell;
  g.l_max = g.l_min = l;
  g.grow = 0.0f;
  g.alpha = 0.0f;
  g.steps = steps_for(g, l);
  return g;
}

void super_twisting_vary(SuperTwistingGains& gains, float l_min, float rho_1_s, float alpha) {
  gains.variable = true;
  gains.l_min = l_min < gains.l_max ? l_min : gains.l_max;
  gains.grow = gains.dt_s * rho_1_s;
  gains.alpha = alpha;
}

void super_twisting_reset(SuperTwisting& st, const SuperTwistingGains& gains) {
  st = {0.0f, 0.0f, 0.0f, gains.l_max};
}

float super_twisting_step(SuperTwisting& st, const SuperTwistingGains& g, float dx) {
  const SuperTwistingSteps varied = g.variable ? steps_for(g, st.l) : SuperTwistingSteps{};
  const SuperTwistingSteps& steps = g.variable ? varied : g.steps;
  const float predicted = st.error + g.dt_s * st.x2 - dx;
  Correction c;
  if (g.scheme == Scheme::EXPLICIT) {
    c = explicit_euler(outside(st.error, g.cell), steps);
  } else if (g.scheme == Scheme::SEMI_IMPLICIT) {
    c = semi_implicit(outside(predicted, g.cell), steps);
  } else {
    c = implicit_euler(outside(predicted, g.cell), steps);
  }
  st.error = predicted - c.root;
  st.x2 -= steps.slope * c.sign;
  if (g.variable) vary_gain(st, g, c.sign);
  return st.x2;
}

}  // namespace hil
