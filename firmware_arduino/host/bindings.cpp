// The board's core for Python: tests, replay and the estimator drive the very code the board runs.
#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/board.h"
#include "core/quadrature.h"
#include "core/report.h"
#include "signing_facts.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

struct Parameter {
  std::string name;
  float initial, minimum, maximum;
  std::string unit, doc;
  bool live;
};

std::vector<Parameter> parameter_table() {
  using hil::LAST_WHEEL_LAW;
  return {
#define PARAM(name, field, value, low, high, unit, doc) {name, value, low, high, unit, doc, false},
#define LIVE_PARAM(name, field, value, low, high, unit, doc) {name, value, low, high, unit, doc, true},
#include "core/params.def"
#undef LIVE_PARAM
#undef PARAM
  };
}

struct WheelLawName {
  std::string name, doc;
  float value;  // of the parameter LAW
};

std::vector<WheelLawName> wheel_laws() {
  return {
#define WHEEL_LAW(ID, files, name, doc) {name, doc, static_cast<float>(hil::Law::ID)},
#include "core/laws.def"
#undef WHEEL_LAW
  };
}

using Values = std::map<std::string, float>;

std::string name_of(const hil::ParamSpec& spec) {
  return std::string(spec.name, strnlen(spec.name, hil::PARAM_NAME_LENGTH));
}

hil::Params params_of(const Values& values) {
  hil::Params params;
  hil::params_defaults(params);
  for (const auto& [name, value] : values) {
    const hil::ParamResult result = hil::param_set(params, hil::param_find(name.c_str()), value, false);
    if (result == hil::ParamResult::UNKNOWN) throw nb::key_error(("unknown parameter " + name).c_str());
    if (result != hil::ParamResult::SET) throw nb::value_error((name + " is out of its range").c_str());
  }
  return params;
}

Values values_of(const hil::Params& params) {
  Values values;
  for (uint8_t i = 0; i < hil::PARAM_COUNT; ++i) {
    values[name_of(hil::param_spec(i))] = hil::param_get(params, i);
  }
  return values;
}

// The differentiator on any signal, with a step that may vary: cameras drop frames.
class SuperTwisting {
 public:
  SuperTwisting(float l, float l0, float l1, hil::Scheme scheme, float cell, std::optional<float> l_min,
                float rho_1_s, float alpha)
      : l_(l), l0_(l0), l1_(l1), cell_(cell), scheme_(scheme), l_min_(l_min), rho_1_s_(rho_1_s),
        alpha_(alpha) {
    if (!(l > 0.0f && l0 > 0.0f && l1 > 0.0f && cell >= 0.0f)) {
      throw nb::value_error("l, l0 and l1 must be above 0, cell at least 0");
    }
  }

  std::pair<double, double> step(double x, double dt_s) {
    if (!started_) {
      started_ = true;
      x_ = x;
      hil::super_twisting_reset(state_, gains(1.0f));
    } else if (dt_s > 0.0) {
      hil::super_twisting_step(state_, gains(static_cast<float>(dt_s)), static_cast<float>(x - x_));
      x_ = x;
    }
    return {x_ + static_cast<double>(state_.error), static_cast<double>(state_.x2)};
  }

  float l() const { return l_min_ ? state_.l : l_; }

 private:
  const hil::SuperTwistingGains& gains(float dt_s) {
    if (dt_s == gains_.dt_s) return gains_;
    gains_ = hil::super_twisting_gains(scheme_, l_, l0_, l1_, cell_, dt_s);
    if (l_min_) hil::super_twisting_vary(gains_, *l_min_, rho_1_s_, alpha_);
    return gains_;
  }

  float l_, l0_, l1_, cell_;
  hil::Scheme scheme_;
  std::optional<float> l_min_;
  float rho_1_s_, alpha_;
  hil::SuperTwistingGains gains_{};
  hil::SuperTwisting state_{};
  double x_ = 0.0;
  bool started_ = false;
};

// One wheel loop by itself.
class WheelLoop {
 public:
  explicit WheelLoop(const Values& values) : tuning_(hil::wheel_tuning(params_of(values))) {
    hil::wheel_init(wheel_, tuning_, 0);
  }

  void retune(const Values& values) {
    tuning_ = hil::wheel_tuning(params_of(values));
    hil::wheel_retuned(wheel_);
  }

  float estimate(int32_t counts) {
    hil::wheel_estimate(wheel_, tuning_, counts);
    return wheel_.omega_rad_s;
  }

  // A tick on the encoder.
  int16_t step(int32_t counts, float setpoint_rad_s, float faster_rad_s) {
    estimate(counts);
    return control(setpoint_rad_s, faster_rad_s);
  }

  // A tick with the speed given instead of measured.
  int16_t step_at_speed(float omega_rad_s, float setpoint_rad_s, float faster_rad_s) {
    wheel_.omega_rad_s = omega_rad_s;
    return control(setpoint_rad_s, faster_rad_s);
  }

  void off() { hil::wheel_off(wheel_); }
  hil::Wheel& state() { return wheel_; }

 private:
  int16_t control(float setpoint_rad_s, float faster_rad_s) {
    hil::wheel_control(wheel_, tuning_, setpoint_rad_s, hil::wheel_turn_duty(tuning_, faster_rad_s));
    hil::wheel_limit(wheel_, tuning_);
    return wheel_.pwm;
  }

  hil::WheelTuning tuning_;
  hil::Wheel wheel_{};
};

class Board {
 public:
  explicit Board(const nb::bytes& eeprom) {
    hil::board_init(board_);
    eeprom_.fill(0xFF);
    std::copy_n(data_of(eeprom), std::min<std::size_t>(eeprom.size(), eeprom_.size()), eeprom_.begin());
    result_ = hil::board_load(board_, read, this);
  }

  void receive(const nb::bytes& data, uint32_t t_us) {
    // In pieces: the length is 16 bits on the board.
    const std::uint8_t* at = data_of(data);
    for (std::size_t left = data.size(); left > 0;) {
      const auto most = static_cast<uint16_t>(std::min<std::size_t>(left, 0xFFFF));
      const uint16_t n = hil::board_receive(board_, at, most, t_us);
      at += n;
      left -= n;
      hash_all();
    }
  }

  std::pair<int16_t, int16_t> tick(uint32_t t_us, int32_t counts_left, int32_t counts_right,
                                   uint16_t encoder_faults, uint16_t battery_mv) {
    hil::BoardOutputs out{};
    hil::board_tick(board_, {t_us, counts_left, counts_right, encoder_faults, battery_mv}, out);
    write_byte();
    hil::board_slack(board_);
    hash_all();
    return {out.pwm_left, out.pwm_right};
  }

  nb::bytes transmit(uint16_t limit) {
    std::vector<uint8_t> out(std::min<std::size_t>(limit, 256));
    const uint16_t n = hil::board_transmit(board_, out.data(), static_cast<uint16_t>(out.size()));
    return nb::bytes(reinterpret_cast<const char*>(out.data()), n);
  }

  hil::ImageResult loaded() const { return result_; }
  nb::bytes eeprom() const {
    return nb::bytes(reinterpret_cast<const char*>(eeprom_.data()), eeprom_.size());
  }

  const hil::Board& state() const { return board_; }
  void set_wired(bool wired) { board_.wired = wired; }
  const hil::Wheel& wheel(uint8_t side) const {
    if (side >= hil::SIDES) throw nb::index_error("side is 0 (left) or 1 (right)");
    return board_.wheel[side];
  }

 private:
  static void read(void* self, uint16_t address, uint8_t* out, uint16_t n) {
    std::copy_n(static_cast<Board*>(self)->eeprom_.begin() + address, n, out);
  }

  void write_byte() {
    hil::StoredByte byte{};
    if (hil::board_store(board_, byte)) eeprom_[byte.address] = byte.value;
  }

  void hash_all() {
    while (hil::board_idle(board_)) {
    }
  }

  hil::Board board_;
  std::array<uint8_t, hil::BOARD_STORAGE_SIZE> eeprom_;
  hil::ImageResult result_;
};

void bind_differentiator(nb::module_& m) {
  nb::enum_<hil::Scheme>(m, "Scheme")
      .value("EXPLICIT", hil::Scheme::EXPLICIT)
      .value("SEMI_IMPLICIT", hil::Scheme::SEMI_IMPLICIT)
      .value("IMPLICIT", hil::Scheme::IMPLICIT);
  nb::class_<SuperTwisting>(m, "SuperTwisting")
      .def(nb::init<float, float, float, hil::Scheme, float, std::optional<float>, float, float>(), "l"_a,
           "l0"_a = 1.1f, "l1"_a = 1.5f, "scheme"_a = hil::Scheme::SEMI_IMPLICIT, "cell"_a = 0.0f,
           "l_min"_a = nb::none(), "rho_1_s"_a = 30.0f, "alpha"_a = 0.6f)
      .def("step", &SuperTwisting::step, "x"_a, "dt_s"_a)
      .def_prop_ro("l", &SuperTwisting::l);
}

void bind_encoder(nb::module_& m) {
  nb::class_<hil::Quadrature>(m, "Quadrature")
      .def(
          "__init__", [](hil::Quadrature* q, uint8_t ab) { new (q) hil::Quadrature{ab, 0, 0}; }, "ab"_a = 0)
      .def(
          "update", [](hil::Quadrature& q, uint8_t ab) { hil::quadrature_update(q, ab); }, "ab"_a)
      .def_ro("counts", &hil::Quadrature::counts)
      .def_ro("illegal", &hil::Quadrature::illegal);
}

void bind_wheel(nb::module_& m) {
  nb::class_<hil::Wheel>(m, "Wheel")
      .def_ro("omega_rad_s", &hil::Wheel::omega_rad_s)
      .def_prop_ro("setpoint_rad_s", [](const hil::Wheel& w) { return w.demand.setpoint_rad_s; })
      .def_ro("error_rad_s", &hil::Wheel::error_rad_s)
      .def_ro("error_rate_rad_s2", &hil::Wheel::error_rate_rad_s2)
      .def_ro("duty", &hil::Wheel::duty)
      .def_ro("feedback_duty", &hil::Wheel::feedback_duty)
      .def_ro("bump_duty", &hil::Wheel::bump_duty)
      .def_ro("saturation", &hil::Wheel::saturation)
      .def_ro("holding", &hil::Wheel::holding)
      .def_ro("pwm", &hil::Wheel::pwm)
      .def_prop_ro("pid_integral_rad", [](const hil::Wheel& w) { return w.pid.integral_rad; })
      .def_prop_ro("s", [](const hil::Wheel& w) { return w.asg_ism.s; })
      .def_prop_ro("eps", [](const hil::Wheel& w) { return w.asg_ism.eps; })
      .def_prop_ro("gain", [](const hil::Wheel& w) { return w.asg_ism.gain; })
      .def_prop_ro("integral", [](const hil::Wheel& w) { return w.asg_ism.integral; })
      .def_prop_ro("average", [](const hil::Wheel& w) { return w.asg_ism.average; })
      .def_prop_ro("eta", [](const hil::Wheel& w) { return w.asg_ism.eta; })
      .def_prop_ro("t_mu0_s", [](const hil::Wheel& w) { return w.asg_ism.t_mu0_s; });
  nb::class_<WheelLoop>(m, "WheelLoop")
      .def(nb::init<const Values&>(), "parameters"_a = Values{})
      .def("retune", &WheelLoop::retune, "parameters"_a)
      .def("estimate", &WheelLoop::estimate, "counts"_a)
      .def("step", &WheelLoop::step, "counts"_a, "setpoint_rad_s"_a, "faster_rad_s"_a = 0.0f)
      .def("step_at_speed", &WheelLoop::step_at_speed, "omega_rad_s"_a, "setpoint_rad_s"_a,
           "faster_rad_s"_a = 0.0f)
      .def("off", &WheelLoop::off)
      .def_prop_ro("state", &WheelLoop::state, nb::rv_policy::reference_internal);
}

void bind_board(nb::module_& m) {
  nb::enum_<hil::ImageResult>(m, "ImageResult")
      .value("LOADED", hil::ImageResult::LOADED)
      .value("BLANK", hil::ImageResult::BLANK)
      .value("DAMAGED", hil::ImageResult::DAMAGED);
  nb::class_<Board>(m, "Board")
      .def(nb::init<const nb::bytes&>(), "eeprom"_a = nb::bytes("", 0))
      .def("receive", &Board::receive, "data"_a, "t_us"_a)
      .def("tick", &Board::tick, "t_us"_a, "counts_left"_a, "counts_right"_a, "encoder_faults"_a = 0,
           "battery_mv"_a = 12000)
      .def("transmit", &Board::transmit, "limit"_a = 256)
      .def_prop_ro("loaded", &Board::loaded)
      .def_prop_ro("eeprom", &Board::eeprom)
      .def("wheel", &Board::wheel, "side"_a, nb::rv_policy::reference_internal)
      .def_prop_rw(
          "wired", [](const Board& b) { return b.state().wired; }, &Board::set_wired)
      .def_prop_ro("signs", [](const Board& b) { return b.state().link.signer.mode == hil::Signing::ON; })
      .def_prop_ro("stamp", [](const Board& b) { return b.state().link.signer.now; })
      .def_prop_ro("state", [](const Board& b) { return b.state().safety.state; })
      .def_prop_ro("reason", [](const Board& b) { return b.state().safety.reason; })
      .def_prop_ro("parameters", [](const Board& b) { return values_of(b.state().params); })
      .def_prop_ro("parameter_hash", [](const Board& b) { return b.state().parameter_hash; })
      .def_prop_ro("overruns", [](const Board& b) { return b.state().overruns; })
      .def_prop_ro("refused_setpoints", [](const Board& b) { return b.state().refused; })
      .def_prop_ro("bad_frames", [](const Board& b) { return b.state().link.bad; })
      .def_prop_ro("lost_frames", [](const Board& b) { return b.state().link.lost; })
      .def_prop_ro("received_frames", [](const Board& b) { return b.state().link.received; })
      .def_prop_ro("dropped_frames", [](const Board& b) { return b.state().link.dropped; });
}

void bind_facts(nb::module_& m) {
  m.def("sha256", &sha256, "data"_a);
  m.def("stored_key", &stored_key, "key"_a, "stamp"_a);
  nb::class_<Parameter>(m, "Parameter")
      .def_ro("name", &Parameter::name)
      .def_ro("default", &Parameter::initial)
      .def_ro("minimum", &Parameter::minimum)
      .def_ro("maximum", &Parameter::maximum)
      .def_ro("unit", &Parameter::unit)
      .def_ro("doc", &Parameter::doc)
      .def_ro("live", &Parameter::live);
  m.def("parameter_table", &parameter_table);
  nb::class_<WheelLawName>(m, "WheelLawName")
      .def_ro("name", &WheelLawName::name)
      .def_ro("doc", &WheelLawName::doc)
      .def_ro("value", &WheelLawName::value);
  m.def("wheel_laws", &wheel_laws);
  m.def(
      "parameter_hash", [](const Values& values) { return hil::params_hash(params_of(values)); },
      "parameters"_a = Values{});
  m.def("dialect_hash", &hil::dialect_hash);
  m.def("safety_next", &hil::safety_next, "state"_a, "conditions"_a);
  m.def("safety_reason", &hil::safety_reason, "conditions"_a);
  m.attr("PWM_TOP") = hil::PWM_TOP;
  m.attr("IMAGE_SIZE") = hil::IMAGE_SIZE;
  m.attr("SLOT_SIZE") = hil::SLOT_SIZE;
  m.attr("ENCODER_COUNTS_1_S") = hil::ENCODER_COUNTS_1_S;
  m.attr("TICK_US") = hil::TICK_US;
  m.attr("BUILD_ID") = HIL_BUILD_ID;
  m.attr("WANTS_ARM") = hil::WANTS_ARM;
  m.attr("WANTS_DISARM") = hil::WANTS_DISARM;
  m.attr("ANY_FAULT") = hil::ANY_FAULT;
}

}  // namespace

NB_MODULE(_firmware, m) {
  nb::set_leak_warnings(false);  // values held by a test session at exit are no leak
  bind_differentiator(m);
  bind_encoder(m);
  bind_wheel(m);
  bind_board(m);
  bind_facts(m);
}
