#include "detect/network_runner.h"

#include <algorithm>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "detect/network_passes.h"
#include "detect/one_openmp_thread.h"
#include "detect/runner_program.h"

namespace posed {

std::string_view to_string(Precision precision) {
  return precision == Precision::Int8 ? "int8" : "f32";
}

NetworkRunner::NetworkRunner(std::unique_ptr<RunnerProgram> program) : program_(std::move(program)) {}

NetworkRunner::~NetworkRunner() = default;

Result<std::unique_ptr<NetworkRunner>> NetworkRunner::create(const Network& network, Precision precision) {
  Result<Network> simple = simplify(network);
  if (!simple) {
    return tl::unexpected<Error>(simple.error());
  }
  const OneOpenMpThread one_thread;  // oneDNN divides the work when a primitive is made
  try {
    auto program = std::make_unique<RunnerProgram>(std::move(*simple), precision);
    if (const Status built = RunnerProgramBuilder(*program).build(); !built) {
      return tl::unexpected<Error>(built.error());
    }
    return std::unique_ptr<NetworkRunner>(new NetworkRunner(std::move(program)));
  } catch (const std::exception& error) {
    return make_error(ErrorCode::Unavailable,
                      fmt::format("{}: oneDNN cannot run this network here: {}", network.source(), error.what()));
  }
}

std::string_view NetworkRunner::name() const {
  return program_->precision == Precision::Int8 ? "posed int8" : "posed f32";
}

TensorShape NetworkRunner::input_shape() const {
  return program_->network.input();
}

std::span<float> NetworkRunner::input() {
  return program_->input;
}

std::span<const InferenceOutput> NetworkRunner::outputs() const {
  return program_->outputs;
}

Result<RunOutcome> NetworkRunner::run(const Deadline& deadline) {
  const OneOpenMpThread one_thread;
  const TimeNs start_ns = deadline.clock->now_ns();
  TimeNs now_ns = start_ns;
  RunOutcome outcome;
  for (RunnerStep& step : program_->steps) {
    if (now_ns >= deadline.at_ns) {
      break;
    }
    if (!step.run()) {
      return make_error(ErrorCode::Unavailable,
                        fmt::format("{}: oneDNN failed in step '{}'", program_->network.source(), step.name));
    }
    const TimeNs before_ns = std::exchange(now_ns, deadline.clock->now_ns());
    step.duration_ns = now_ns - before_ns;
    outcome.longest_step_ns = std::max(outcome.longest_step_ns, step.duration_ns);
    ++outcome.steps_run;
  }
  outcome.finished = outcome.steps_run == program_->steps.size();
  outcome.elapsed_ns = now_ns - start_ns;
  program_->longest_step_ns = std::max(program_->longest_step_ns, outcome.longest_step_ns);
  return outcome;
}

std::size_t NetworkRunner::step_count() const {
  return program_->steps.size();
}

std::string_view NetworkRunner::step_name(std::size_t step) const {
  return program_->steps[step].name;
}

TimeNs NetworkRunner::step_duration_ns(std::size_t step) const {
  return program_->steps[step].duration_ns;
}

TimeNs NetworkRunner::longest_step_ns() const {
  return program_->longest_step_ns;
}

std::size_t NetworkRunner::arena_bytes() const {
  return program_->arena.size();
}

Status NetworkRunner::run_observed(const TensorObserver& observer) {
  if (program_->precision != Precision::Float32) {
    return make_error(ErrorCode::InvalidArgument, "only a runner in floats can show its tensors");
  }
  const OneOpenMpThread one_thread;
  observer(0, program_->input);
  for (const RunnerStep& step : program_->steps) {
    if (!step.run()) {
      return make_error(ErrorCode::Unavailable,
                        fmt::format("{}: oneDNN failed in step '{}'", program_->network.source(), step.name));
    }
    if (step.tensor > 0) {
      const TensorView& view = program_->tensors[static_cast<std::size_t>(step.tensor)];
      observer(step.tensor, {static_cast<const float*>(view.data), view.shape.size()});
    }
  }
  return {};
}

}  // namespace posed
