#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "core/result.h"
#include "detect/inference_engine.h"

namespace posed {

/// The second engine: OpenCV's DNN module on one thread, for a user's own ONNX file whose operations `NetworkRunner` does not know.
/// It takes a static input size and at most opset 12 to be safe (OpenCV 4.6). OpenCV computes the whole network in one call, which
/// nothing can interrupt: a run is abandoned only where its deadline has passed before it begins, so one that begins in time may
/// overrun its deadline by all that it takes. Each run allocates. Thread-bound; note that OpenCV's number of threads is one
/// setting for the whole process, which `create` sets to one.
class OpenCvNetwork final : public InferenceEngine {
 public:
  /// Errors: NotFound; Io; BadData, where the file is no ONNX network of one image (N = 1) or OpenCV does not know an operation.
  static Result<std::unique_ptr<OpenCvNetwork>> create(const std::filesystem::path& path);
  ~OpenCvNetwork() override;

  std::string_view name() const override;
  TensorShape input_shape() const override;
  std::span<float> input() override;
  Result<RunOutcome> run(const Deadline& deadline) override;
  std::span<const InferenceOutput> outputs() const override;

 private:
  struct State;
  explicit OpenCvNetwork(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace posed
