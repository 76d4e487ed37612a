#include "detect/opencv_network.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>

#include "detect/onnx_reader.h"

namespace posed {

struct OpenCvNetwork::State {
  std::string source;
  cv::dnn::Net network;
  TensorShape input_shape;
  cv::Mat input;
  std::vector<std::string> output_names;
  std::vector<cv::Mat> results;
  std::vector<std::vector<float>> values;
  std::vector<InferenceOutput> outputs;

  void forward();
  void keep_results();
};

void OpenCvNetwork::State::forward() {
  network.setInput(input);
  network.forward(results, output_names);
}

void OpenCvNetwork::State::keep_results() {
  for (std::size_t i = 0; i < results.size(); ++i) {
    const cv::Mat& result = results[i];
    CV_Assert(result.isContinuous() && result.type() == CV_32F && result.total() == values[i].size());
    std::copy(result.ptr<float>(), result.ptr<float>() + result.total(), values[i].begin());
  }
}

OpenCvNetwork::OpenCvNetwork(std::unique_ptr<State> state) : state_(std::move(state)) {}

OpenCvNetwork::~OpenCvNetwork() = default;

Result<std::unique_ptr<OpenCvNetwork>> OpenCvNetwork::create(const std::filesystem::path& path) {
  const Result<TensorShape> input_shape = read_onnx_input(path);
  if (!input_shape) {
    return tl::unexpected<Error>(input_shape.error());
  }
  try {
    cv::setNumThreads(1);
    auto state = std::make_unique<State>();
    state->source = path.string();
    state->input_shape = *input_shape;
    state->network = cv::dnn::readNetFromONNX(path.string());
    state->network.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    state->network.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    state->output_names = state->network.getUnconnectedOutLayersNames();
    state->input.create(std::vector<int>{1, input_shape->channels, input_shape->height, input_shape->width}, CV_32F);
    state->input.setTo(0);
    // The first run makes OpenCV allocate and tells the outputs' sizes.
    state->forward();
    for (const cv::Mat& result : state->results) {
      state->values.emplace_back(result.total());
    }
    for (std::size_t i = 0; i < state->results.size(); ++i) {
      const cv::Mat& result = state->results[i];
      state->outputs.push_back({state->output_names[i], {result.size.p, result.size.p + result.dims}, state->values[i]});
    }
    state->keep_results();
    return std::unique_ptr<OpenCvNetwork>(new OpenCvNetwork(std::move(state)));
  } catch (const std::exception& error) {
    return make_error(ErrorCode::BadData, fmt::format("{}: OpenCV cannot run this network: {}", path.string(), error.what()));
  }
}

std::string_view OpenCvNetwork::name() const {
  return "OpenCV DNN";
}

TensorShape OpenCvNetwork::input_shape() const {
  return state_->input_shape;
}

std::span<float> OpenCvNetwork::input() {
  return {state_->input.ptr<float>(), state_->input.total()};
}

Result<RunOutcome> OpenCvNetwork::run(const Deadline& deadline) {
  RunOutcome outcome;
  const TimeNs start_ns = deadline.clock->now_ns();
  if (start_ns >= deadline.at_ns) {
    return outcome;
  }
  try {
    state_->forward();
    state_->keep_results();
  } catch (const std::exception& error) {
    return make_error(ErrorCode::Unavailable, fmt::format("{}: OpenCV failed: {}", state_->source, error.what()));
  }
  outcome.elapsed_ns = deadline.clock->now_ns() - start_ns;
  outcome.finished = true;
  outcome.steps_run = 1;
  outcome.longest_step_ns = outcome.elapsed_ns;
  return outcome;
}

std::span<const InferenceOutput> OpenCvNetwork::outputs() const {
  return state_->outputs;
}

}  // namespace posed
