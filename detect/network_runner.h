#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "core/result.h"
#include "detect/inference_engine.h"
#include "detect/network.h"

namespace posed {

struct RunnerProgram;

enum class Precision : std::uint8_t {
  Float32,
  Int8,  ///< activations of 8 bits with a scale and a zero point each, weights of 8 bits with a scale each output channel
};
std::string_view to_string(Precision precision);

/// Runs a `Network` as a flat list of steps: oneDNN's convolutions and max pools, hand-written kernels for the rest (what
/// oneDNN 2.6 leaves to its reference code). Everything is chosen, laid out and allocated by `create`: a run allocates nothing
/// itself (oneDNN keeps small books of its own for each primitive). It looks at the clock between steps. Thread-bound; instances
/// are independent.
///
/// It computes on the calling thread alone: oneDNN uses OpenMP, which `create` and `run` hold to one thread for that thread.
class NetworkRunner final : public InferenceEngine {
 public:
  /// Errors: Unsupported, where an operation is none of the shipped networks' or the precision is Int8 and the network is not
  /// calibrated; Unavailable, where oneDNN has no way to compute a node on this machine.
  static Result<std::unique_ptr<NetworkRunner>> create(const Network& network, Precision precision);
  ~NetworkRunner() override;

  std::string_view name() const override;
  TensorShape input_shape() const override;
  std::span<float> input() override;
  Result<RunOutcome> run(const Deadline& deadline) override;
  /// The network's outputs, each {1, channels, height, width}.
  std::span<const InferenceOutput> outputs() const override;

  std::size_t step_count() const;
  /// What a step computes and by which implementation, for the person who measures.
  std::string_view step_name(std::size_t step) const;
  /// What the step took in the last run that reached it.
  TimeNs step_duration_ns(std::size_t step) const;
  /// The longest step of all runs so far.
  TimeNs longest_step_ns() const;
  /// Bytes of the activations' memory, shared by tensors that are not needed at the same time.
  std::size_t arena_bytes() const;

  /// Called with the number of a tensor of the simplified network (detect/network_passes.h) and its values, rows before columns
  /// before channels.
  using TensorObserver = std::function<void(int tensor, std::span<const float> values)>;
  /// A run to its end that shows every tensor, for calibration. Only for Float32; otherwise InvalidArgument.
  Status run_observed(const TensorObserver& observer);

 private:
  explicit NetworkRunner(std::unique_ptr<RunnerProgram> program);

  std::unique_ptr<RunnerProgram> program_;
};

}  // namespace posed
