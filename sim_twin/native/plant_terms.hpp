// What a step of the plant reckons with, by robot: its parameters, and quotients, squares and differences of
// them that do not change, because a division costs as much as ten products.
#pragma once

namespace twin {

struct PlantParams;

// clang-format off
#define TWIN_TERMS(X)                                                                                  \
  X(mass_kg) X(inertia_kg_m2) X(wheel_radius_m) X(half_track_m) X(front_axle_m) X(rear_axle_m) X(d0_m) \
  X(motor_per_side) X(motor_resistance_ohm) X(motor_coulomb_n_m) X(motor_viscous_n_m_s_rad)            \
  X(bridge_drop_v) X(bridge_resistance_ohm) X(battery_empty_v) X(battery_resistance_ohm)               \
  X(battery_idle_a) X(floor_smoothing_m_s) X(floor_slip_smoothing_m_s)                                 \
  X(bridge_smoothing2_a2) X(floor_smoothing2_m2_s2)                                                    \
  X(battery_span_v) /* full - empty */                                                                 \
  X(stribeck_n_m)   /* stiction - Coulomb */                                                           \
  X(gear_loss_ratio)                                                                                   \
  X(per_radius) X(per_inductance) X(per_stribeck) X(per_charge)                                        \
  X(side_inertia_kg_m2)              /* wheels and reflected rotors of one side */                     \
  X(emf_v_s) X(gear_n_m_a)           /* V per rad/s and N m per A at the wheel */                      \
  X(roll_n)                          /* rolling resistance of one side */                              \
  X(slide_front_n) X(slide_rear_n)   /* sliding friction of the wheels in front, in the rear */        \
  X(castor_n)                        /* friction of the castor */                                      \
  X(per_mass_rim) X(per_inertia_rim) /* 1 / (m + rims), 1 / (I + m d0^2 + rims): (S'MS)^-1 */
// clang-format on

template <class N>
struct Terms {
#define X(name) N name;
  TWIN_TERMS(X)
#undef X
};

Terms<double> derive(const PlantParams& params);

}  // namespace twin
