// The runner's parts: loading either kind of file, making a runner, running the small test network, and the kernels that are not
// oneDNN's at the sizes of width 0.25 at 320x256. Whole networks are timed against each other by posectl model bench.
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "detect/attention_block.h"
#include "detect/kernels/tensor_kernels.h"
#include "detect/network_file.h"
#include "detect/network_loader.h"
#include "detect/network_runner.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

constexpr TensorShape kStride4{32, 64, 80};

void BM_LoadOnnx(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(load_network({test::small_onnx_path()}).value());
  }
}
BENCHMARK(BM_LoadOnnx)->Unit(benchmark::kMicrosecond);

void BM_LoadPosednet(benchmark::State& state) {
  const TemporaryFolder folder;
  const std::string path = folder / "small.posednet";
  if (!write_network(test::small_network(), static_cast<WeightFormat>(state.range(0)), path)) {
    state.SkipWithError("cannot write");
    return;
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(load_network({path}).value());
  }
}
BENCHMARK(BM_LoadPosednet)->ArgName("format")->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

std::unique_ptr<NetworkRunner> small_runner(Precision precision) {
  const Network network = precision == Precision::Int8 ? test::calibrated_small_network() : test::small_network();
  auto runner = NetworkRunner::create(network, precision).value();
  test::fill_test_input(runner->input());
  return runner;
}

void BM_RunSmallNetwork(benchmark::State& state) {
  const auto runner = small_runner(static_cast<Precision>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(runner->run({}).value());
  }
}
BENCHMARK(BM_RunSmallNetwork)->ArgName("int8")->DenseRange(0, 1)->Unit(benchmark::kMicrosecond);

/// What the clock between the steps costs: the same run with nothing to do, as its deadline has passed.
void BM_AbandonAtOnce(benchmark::State& state) {
  const auto runner = small_runner(Precision::Float32);
  const Deadline passed{&SystemClock::instance(), 0};
  for (auto _ : state) {
    benchmark::DoNotOptimize(runner->run(passed).value());
  }
}
BENCHMARK(BM_AbandonAtOnce);

void BM_Attention(benchmark::State& state) {
  constexpr int kHidden = 2;
  const auto values = [](int count) { return std::vector<float>(static_cast<std::size_t>(count), 0.1F); };
  const Cbam cbam{kHidden,
                  values(kHidden * kStride4.channels),
                  values(kHidden),
                  values(kHidden * kStride4.channels),
                  values(kStride4.channels),
                  7,
                  values(98),
                  0.1F};
  const AttentionBlock block(cbam, kStride4);
  const std::vector<float> in(kStride4.size(), 0.5F);
  std::vector<float> out(kStride4.size());
  std::vector<float> scratch(block.scratch_floats());
  for (auto _ : state) {
    block.run(in.data(), out.data(), scratch.data());
    benchmark::DoNotOptimize(out.data());
  }
}
BENCHMARK(BM_Attention)->Unit(benchmark::kMicrosecond);

void BM_SpaceToDepth(benchmark::State& state) {
  const std::vector<float> planes(3 * 256 * 320, 0.5F);
  std::vector<float> floats(planes.size());
  std::vector<std::uint8_t> bytes(planes.size());
  for (auto _ : state) {
    if (state.range(0) == 0) {
      tensor_kernels().interleave(planes.data(), 3, 256, 320, 2, floats.data());
    } else {
      tensor_kernels().interleave_u8(planes.data(), 3, 256, 320, 2, {1.0F / 255, 0}, bytes.data());
    }
    benchmark::ClobberMemory();
  }
}
BENCHMARK(BM_SpaceToDepth)->ArgName("int8")->DenseRange(0, 1)->Unit(benchmark::kMicrosecond);

void BM_Concat(benchmark::State& state) {
  const auto bytes = static_cast<std::size_t>(state.range(0));
  const std::size_t pixels = static_cast<std::size_t>(kStride4.height) * static_cast<std::size_t>(kStride4.width);
  const std::vector<std::uint8_t> part(pixels * bytes);
  std::vector<std::uint8_t> out(2 * part.size());
  const ConcatPart parts[] = {{part.data(), bytes}, {part.data(), bytes}};
  for (auto _ : state) {
    tensor_kernels().concat(parts, 2, pixels, out.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(BM_Concat)->ArgName("bytes")->Arg(8)->Arg(16)->Arg(64)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace posed
