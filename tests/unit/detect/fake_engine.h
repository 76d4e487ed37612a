#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "detect/inference_engine.h"
#include "tests/support/manual_clock.h"

namespace posed::test {

/// Boxes of images of 64x32 (HeadKind::Boxes). Says what a test wants it to say, and takes as long.
class FakeEngine final : public InferenceEngine {
 public:
  explicit FakeEngine(ManualClock& clock) : clock_(clock) { outputs_.push_back({"boxes", {1, 4, 6}, values}); }

  std::string_view name() const override { return "fake"; }
  TensorShape input_shape() const override { return shape; }
  std::span<float> input() override { return input_; }
  Result<RunOutcome> run(const Deadline& deadline) override {
    RunOutcome outcome;
    for (int step = 0; step < 3; ++step) {
      if (deadline.clock->now_ns() >= deadline.at_ns) {
        return outcome;
      }
      clock_.advance(step_ns);
      ++outcome.steps_run;
      outcome.longest_step_ns = step_ns;
    }
    outcome.finished = true;
    return outcome;
  }
  std::span<const InferenceOutput> outputs() const override { return outputs_; }

  TensorShape shape{3, 32, 64};
  std::vector<float> values = std::vector<float>(24, 0.0F);
  TimeNs step_ns = kNsPerMs;

 private:
  ManualClock& clock_;
  std::vector<float> input_ = std::vector<float>(3 * 32 * 64);
  std::vector<InferenceOutput> outputs_;
};

}  // namespace posed::test
