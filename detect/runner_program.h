#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "detect/dnnl_primitive.h"
#include "detect/inference_engine.h"
#include "detect/network.h"
#include "detect/network_runner.h"

namespace posed {

/// One step of a run. False where a library failed.
using StepFunction = std::function<bool()>;

struct RunnerStep {
  std::string name;
  StepFunction run;
  int tensor = -1;  ///< that it makes; -1 where it delivers an output
  TimeNs duration_ns = 0;
};

/// What `NetworkRunner` runs: everything that its `create` decides and allocates. The steps point into the members, so it never
/// moves.
struct RunnerProgram {
  Network network;  ///< simplified
  Precision precision;
  DnnlFactory factory;
  std::deque<DnnlPrimitive> primitives;
  std::vector<float> input;                       ///< planar
  std::vector<std::byte> arena;                   ///< tensors and the steps' own scratch
  std::vector<std::byte> scratchpad;              ///< of oneDNN's primitives
  std::vector<TensorView> tensors;                ///< of each tensor, interleaved
  std::vector<std::vector<float>> output_values;  ///< planar
  std::vector<InferenceOutput> outputs;
  std::vector<RunnerStep> steps;
  TimeNs longest_step_ns = 0;

  RunnerProgram(Network simplified, Precision with) : network(std::move(simplified)), precision(with) {}
  RunnerProgram(const RunnerProgram&) = delete;
  RunnerProgram& operator=(const RunnerProgram&) = delete;
};

/// Fills a program. Thread-bound. oneDNN's exceptions pass (dnnl::error).
class RunnerProgramBuilder {
 public:
  explicit RunnerProgramBuilder(RunnerProgram& program) : program_(program) {}

  /// Error: Unsupported.
  Status build();

 private:
  Status check_supported() const;
  /// Whether a node reads the input other than by SpaceToDepth, which reads it as it comes.
  bool reads_interleaved_input() const;
  bool is_read(int tensor) const;
  std::size_t scratch_bytes(std::size_t node) const;
  void choose_quantization();
  void place_tensors();
  void add_node_step(std::size_t node);
  void make_outputs();
  void add_output_step(std::size_t output);
  void place_scratchpad();

  StepFunction function_of(std::size_t node, std::string& implementation);
  StepFunction primitive_step(DnnlPrimitive primitive, std::string& implementation);
  StepFunction interleave_step(const TensorView& out, int step) const;
  StepFunction add_step(const TensorView& a, const TensorView& b, const TensorView& out) const;
  StepFunction concat_step(const Node& node, const TensorView& out) const;
  StepFunction upsample_step(const TensorView& in, const TensorView& out) const;
  StepFunction attention_step(const Cbam& cbam, const TensorView& in, const TensorView& out, std::byte* scratch) const;

  const TensorView& view(int tensor) const { return program_.tensors[static_cast<std::size_t>(tensor)]; }

  RunnerProgram& program_;
  std::vector<std::byte*> scratch_;  // of each node, then of each output
};

}  // namespace posed
