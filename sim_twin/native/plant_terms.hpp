// What a step of the plant reckons with, by robot: its parameters, and quotients, squares and differences of
// them that do not change, because a division costs as much as ten products.
#pragma once

namespace twin {

struct PlantParams;

// clang-format off
#define TWIN_TERMS(X)                                                                                  \
  X(mass_kg) X(inertia_kg_m2) X(wheel_radius_m) X(half_track_m) X(front_axle_m) X(rear_axle_m) X(d0_m) \
  X(front_arm_m) X(rear_arm_m)     /* of the axles, from the point without lateral speed */            \
  X(mass_arm_kg_m)                 /* m d0 */                                                          \
  X(motor_per_side) X(bridge_drop_v)                                                                   \
  X(resistance_ohm)                /* a motor's, and the bridge's for all of the side */               \
  X(bridge_smoothing2_a2)          /* of the current of one motor */                                   \
  X(emf_v_s_m) X(drive_n_a)        /* V of a motor per m/s, N of the side's per A, at the rim */       \
  X(loss_n_a)                      /* what the gears take of it */                                     \
  X(coulomb_n) X(viscous_n_s_m)    /* friction of the side's motors at the rim */                      \
  X(stribeck_n_m2_s2)              /* (stiction - Coulomb) times the square of the Stribeck speed */   \
  X(stribeck2_m2_s2)               /* that square */                                                   \
  X(battery_empty_v) X(battery_resistance_ohm) X(battery_idle_a)                                       \
  X(battery_span_v)                /* full - empty */                                                  \
  X(floor_smoothing_m_s) X(floor_slip_smoothing_m_s) X(floor_smoothing2_m2_s2)                         \
  X(per_radius) X(per_inductance) X(per_charge)                                                        \
  X(side_inertia_kg_m2)            /* wheels and reflected rotors of one side */                       \
  X(roll_n)                        /* rolling resistance of one side */                                \
  X(slide_front_n) X(slide_rear_n) /* sliding friction of the wheels in front, in the rear */          \
  X(castor_n)                      /* friction of the castor */                                        \
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
