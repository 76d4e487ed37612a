#include "tools/posectl/model_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>

#include <fmt/ostream.h>

#include "detect/network_loader.h"
#include "detect/network_runner.h"
#include "detect/opencv_network.h"

namespace posed {
namespace {

constexpr std::size_t kWarmUpRuns = 3;

struct BenchEngine {
  std::unique_ptr<InferenceEngine> engine;
  const NetworkRunner* runner = nullptr;  // the engine, where it is one
  ModelTiming timing;
  std::vector<std::vector<TimeNs>> steps_ns = {};  // of each step, of each run
};

/// Values from 0 to 1 in no order, so that no shortcut for constant images helps anybody.
void fill_with_noise(std::span<float> input) {
  std::uint32_t state = 1;
  for (float& value : input) {
    state = state * 1664525U + 1013904223U;
    value = static_cast<float>(state >> 24) / 255.0F;
  }
}

template <typename Engine>
Status add_engine(Result<std::unique_ptr<Engine>> made, const ModelName& name, std::vector<BenchEngine>& engines) {
  if (!made) {
    return tl::unexpected<Error>(made.error());
  }
  BenchEngine bench;
  if constexpr (std::is_same_v<Engine, NetworkRunner>) {
    bench.runner = made->get();
    bench.steps_ns.resize((*made)->step_count());
  }
  bench.timing.label = fmt::format("{}, {}", std::filesystem::path(to_string(name)).filename().string(), (*made)->name());
  bench.engine = std::move(*made);
  fill_with_noise(bench.engine->input());
  engines.push_back(std::move(bench));
  return {};
}

Status add_engines(const ModelBenchRequest& request, const ModelName& name, std::vector<BenchEngine>& engines) {
  // OpenCV takes a network at the size of its file.
  const bool by_opencv = request.against_opencv && name.sizes.empty() && std::filesystem::path(name.file).extension() == ".onnx";
  const Result<Network> network = load_network(name);
  if (!network && network.error().code == ErrorCode::Unsupported && by_opencv) {
    return add_engine(OpenCvNetwork::create(name.file), name, engines);  // one of another kind, to compare with
  }
  if (!network) {
    return tl::unexpected<Error>(network.error());
  }
  Status added;
  if (request.float32) {
    added = add_engine(NetworkRunner::create(*network, Precision::Float32), name, engines);
  }
  // Asked for alone, eight bits of a network that has none are an error; with the other precision they are left out.
  if (added && request.int8 && (!network->ranges().empty() || !request.float32)) {
    added = add_engine(NetworkRunner::create(*network, Precision::Int8), name, engines);
  }
  if (added && by_opencv) {
    added = add_engine(OpenCvNetwork::create(name.file), name, engines);
  }
  return added;
}

Status run_once(BenchEngine& bench, bool keep) {
  const Result<RunOutcome> outcome = bench.engine->run(Deadline{});
  if (!outcome) {
    return tl::unexpected<Error>(outcome.error());
  }
  if (keep) {
    bench.timing.durations_ns.push_back(outcome->elapsed_ns);
    for (std::size_t step = 0; step < bench.steps_ns.size(); ++step) {
      bench.steps_ns[step].push_back(bench.runner->step_duration_ns(step));
    }
  }
  return {};
}

void print_table(const std::vector<BenchEngine>& engines, std::ostream& out) {
  std::size_t width = 0;
  for (const BenchEngine& bench : engines) {
    width = std::max(width, bench.timing.label.size());
  }
  const double first = to_ms(quantile_ns(engines.front().timing.durations_ns, 0.5));
  fmt::print(out, "{:<{}} {:>8} {:>8} {:>8} {:>6}\n", "engine", width, "min ms", "p50 ms", "p99 ms", "ratio");
  for (const BenchEngine& bench : engines) {
    const std::vector<TimeNs>& durations = bench.timing.durations_ns;
    const double median = to_ms(quantile_ns(durations, 0.5));
    fmt::print(out, "{:<{}} {:>8.2f} {:>8.2f} {:>8.2f} {:>6.2f}\n", bench.timing.label, width, to_ms(quantile_ns(durations, 0)),
               median, to_ms(quantile_ns(durations, 0.99)), median / first);
  }
}

void print_steps(const BenchEngine& bench, std::ostream& out) {
  fmt::print(out, "\n{}: {} steps, {:.1f} MB of activations\n{:>8} {:>8}  step\n", bench.timing.label, bench.steps_ns.size(),
             static_cast<double>(bench.runner->arena_bytes()) * 1e-6, "p50 ms", "p99 ms");
  for (std::size_t step = 0; step < bench.steps_ns.size(); ++step) {
    fmt::print(out, "{:>8.3f} {:>8.3f}  {}\n", to_ms(quantile_ns(bench.steps_ns[step], 0.5)),
               to_ms(quantile_ns(bench.steps_ns[step], 0.99)), bench.runner->step_name(step));
  }
}

}  // namespace

TimeNs quantile_ns(std::vector<TimeNs> durations_ns, double p) {
  const auto place = static_cast<std::ptrdiff_t>(std::llround(p * static_cast<double>(durations_ns.size() - 1)));
  std::nth_element(durations_ns.begin(), durations_ns.begin() + place, durations_ns.end());
  return durations_ns[static_cast<std::size_t>(place)];
}

Status bench_models(const ModelBenchRequest& request, std::ostream& out) {
  std::vector<BenchEngine> engines;
  for (const std::string& network : request.networks) {
    if (const Status added = add_engines(request, parse_model_name(network), engines); !added) {
      return added;
    }
  }
  if (engines.empty()) {
    return make_error(ErrorCode::InvalidArgument, "nothing to time");
  }
  for (std::size_t run = 0; run < kWarmUpRuns + request.runs; ++run) {
    for (BenchEngine& bench : engines) {
      if (const Status ran = run_once(bench, run >= kWarmUpRuns); !ran) {
        return ran;
      }
    }
  }
  print_table(engines, out);
  for (const BenchEngine& bench : engines) {
    if (request.steps && bench.runner != nullptr) {
      print_steps(bench, out);
    }
  }
  return {};
}

}  // namespace posed
