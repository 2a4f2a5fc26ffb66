// A law whose answer is worked out elsewhere, for several runs at once: asked, it throws until the answer is there.
#pragma once

#include <optional>

#include "outer_laws.hpp"

namespace outer {

struct AnswerWanted {};

// What stands around a law changes nothing that lasts before it has the law's answer, so that it can be asked
// again from its beginning. A reset is part of the question: it goes with a step of the same tick.
class AnsweredLaw final : public OuterLaw {
 public:
  struct Question {
    bool reset = false;
    ReferenceState reference;
    Estimate estimate;
    double dt_s = 0.0;
  };

  void reset(const ReferenceState&, const Estimate&) override { question_.reset = true; }
  OuterCommand step(const ReferenceState& reference, const Estimate& estimate, double dt_s) override {
    if (!answer_) {
      question_.reference = reference;
      question_.estimate = estimate;
      question_.dt_s = dt_s;
      throw AnswerWanted{};
    }
    const OuterCommand out = *answer_;
    answer_.reset();
    question_.reset = false;
    return out;
  }

  const Question& question() const { return question_; }
  void answer(const OuterCommand& command) { answer_ = command; }

 private:
  Question question_;
  std::optional<OuterCommand> answer_;
};

}  // namespace outer
