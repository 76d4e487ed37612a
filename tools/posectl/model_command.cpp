#include <filesystem>
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "core/clock.h"
#include "detect/calibration.h"
#include "detect/network_file.h"
#include "detect/network_loader.h"
#include "detect/network_passes.h"
#include "tools/posectl/commands.h"
#include "tools/posectl/exit_code.h"
#include "tools/posectl/model_bench.h"
#include "tools/posectl/model_images.h"
#include "tools/posectl/progress.h"
#include "tools/posectl/report_error.h"
#include "tools/posectl/whole_file.h"

namespace posed {
namespace {

constexpr const char* kNetworkHelp = "Network (.onnx or .posednet), with @WIDTHxHEIGHT for another input than the file's";

struct ConvertOptions {
  std::string from;
  std::filesystem::path to;
  WeightFormat weights = WeightFormat::Float32;
  std::vector<std::filesystem::path> images;
  CalibrationMethod method = CalibrationMethod::MeanSquaredError;
  bool quiet = false;
};

struct BenchOptions {
  ModelBenchRequest request;
  std::string precision = "all";
};

void print_outputs(const Network& network, std::ostream& out) {
  const NetworkMetadata& metadata = network.metadata();
  for (std::size_t i = 0; i < network.outputs().size(); ++i) {
    const TensorShape& shape = network.shapes()[static_cast<std::size_t>(network.outputs()[i])];
    fmt::print(out, "  output {}: {}x{}x{}", i, shape.channels, shape.height, shape.width);
    if (!metadata.strides.empty()) {
      fmt::print(out, ", stride {}, anchors", metadata.strides[i]);
      for (const Anchor& anchor : metadata.anchors[i]) {
        fmt::print(out, " {:.4g}x{:.4g}", anchor.width, anchor.height);
      }
      fmt::print(out, "{}", metadata.boxes_per_anchor == 1 ? "" : fmt::format(", {} boxes each", metadata.boxes_per_anchor));
    }
    fmt::print(out, "\n");
  }
}

int run_info(const std::string& name, const Console& console) {
  const Result<Network> network = load_network(parse_model_name(name));
  const Result<Network> simple = network ? simplify(*network) : network;
  if (!simple) {
    return report_error(console.err, simple.error());
  }
  const NetworkMetadata& metadata = network->metadata();
  const TensorShape& input = network->input();
  fmt::print(console.out, "{}: {}\n", name, metadata.name.empty() ? "a network without a name" : metadata.name);
  fmt::print(console.out, "  input: {}x{}x{}\n", input.channels, input.height, input.width);
  fmt::print(console.out, "  classes: {}\n",
             metadata.classes.empty() ? "not said" : fmt::format("{}", fmt::join(metadata.classes, ", ")));
  print_outputs(*network, console.out);
  fmt::print(console.out, "  {} nodes, {} when simplified; {} parameters; {:.1f} million multiply-accumulates\n",
             network->nodes().size(), simple->nodes().size(), simple->parameter_count(),
             static_cast<double>(simple->multiply_accumulates()) * 1e-6);
  fmt::print(console.out, "  calibrated for 8 bits: {}\n", simple->ranges().empty() ? "no" : "yes");
  return kExitOk;
}

/// The network with value ranges of the images given, where there are any; else as it is.
Result<Network> calibrated(const Network& network, const ConvertOptions& options, const Console& console) {
  if (options.images.empty()) {
    return network;
  }
  ModelImages images(options.images, network.input());
  const Clock& clock = SystemClock::instance();
  const std::size_t total = 2 * images.count();  // each image is looked at twice
  ProgressReporter progress(console.err, progress_style(console.err_is_terminal, options.quiet), "calibrate", total,
                            clock.now_ns());
  std::uint64_t done = 0;
  Result<Network> result = calibrate(
      network, images.count(),
      [&](std::size_t index, std::span<float> input) {
        progress.update(done++, clock.now_ns());
        return images.fill(index, input);
      },
      options.method);
  progress.finish(done, clock.now_ns());
  return result;
}

int run_convert(const ConvertOptions& options, const Console& console) {
  if (const Status writable = check_writable(options.to); !writable) {
    return report_error(console.err, writable.error());
  }
  const Result<Network> network = load_network(parse_model_name(options.from));
  if (!network) {
    return report_error(console.err, network.error());
  }
  const Result<Network> ready = calibrated(*network, options, console);
  if (!ready) {
    return report_error(console.err, ready.error());
  }
  if (const Status written = write_network(*ready, options.weights, options.to); !written) {
    return report_error(console.err, written.error());
  }
  fmt::print(console.out, "{}: {} bytes, {}\n", options.to.string(), std::filesystem::file_size(options.to),
             ready->ranges().empty() ? "not calibrated" : "calibrated for 8 bits");
  return kExitOk;
}

int run_bench(const BenchOptions& options, const Console& console) {
  ModelBenchRequest request = options.request;
  request.float32 = options.precision != "int8";
  request.int8 = options.precision != "f32";
  if (const Status done = bench_models(request, console.out); !done) {
    return report_error(console.err, done.error());
  }
  return kExitOk;
}

void add_info(CLI::App& parent, const Console& console, int& exit_code) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = parent.add_subcommand("info", "Print what a network file holds");
  command->add_option("file", *name, kNetworkHelp)->required();
  command->callback([name, &console, &exit_code] { exit_code = run_info(*name, console); });
}

void add_convert(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* command =
      parent.add_subcommand("convert", "Write a network as the detector's own file, calibrated if images are given");
  command->add_option("from", options->from, kNetworkHelp)->required();
  command->add_option("to", options->to, "File to write (.posednet)")->required();
  const std::map<std::string, WeightFormat> formats{
      {"f32", WeightFormat::Float32}, {"f16", WeightFormat::Float16}, {"int8", WeightFormat::Int8}};
  command->add_option("--weights", options->weights, "How weights are stored: f32, f16 or int8; f32 unless given")
      ->transform(CLI::CheckedTransformer(formats));
  command->add_option("--calibrate", options->images, "Images (PNG, JPEG) of what the camera will see, for running in 8 bits");
  const std::map<std::string, CalibrationMethod> methods{{"mse", CalibrationMethod::MeanSquaredError},
                                                         {"minmax", CalibrationMethod::MinMax}};
  command
      ->add_option("--method", options->method,
                   "Value ranges of least squared error (mse) or of all values (minmax); mse unless given")
      ->transform(CLI::CheckedTransformer(methods));
  command->add_flag("--quiet", options->quiet, "No progress");
  command->callback([options, &console, &exit_code] { exit_code = run_convert(*options, console); });
}

void add_bench(CLI::App& parent, const Console& console, int& exit_code) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* command = parent.add_subcommand("bench", "Time networks against each other on one thread, taking turns");
  command->add_option("files", options->request.networks, kNetworkHelp)->required();
  command->add_option("--precision", options->precision, "f32, int8, or all: f32, and int8 of calibrated networks")
      ->check(CLI::IsMember({"f32", "int8", "all"}))
      ->capture_default_str();
  command->add_flag("--against-opencv", options->request.against_opencv,
                    "Also time OpenCV's DNN module on the ONNX files named without a size");
  command->add_option("--runs", options->request.runs, "How many runs of each")->check(CLI::PositiveNumber)->capture_default_str();
  command->add_flag("--steps", options->request.steps, "Also print what each step took");
  command->callback([options, &console, &exit_code] { exit_code = run_bench(*options, console); });
}

}  // namespace

void add_model_command(CLI::App& parent, const Console& console, int& exit_code) {
  CLI::App* command = parent.add_subcommand("model", "Inspect, convert and time the person detector's networks");
  command->require_subcommand(1);
  add_info(*command, console, exit_code);
  add_convert(*command, console, exit_code);
  add_bench(*command, console, exit_code);
}

}  // namespace posed
