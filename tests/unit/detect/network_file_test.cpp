#include "detect/network_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/crc32c.h"
#include "detect/half.h"
#include "detect/network_loader.h"
#include "detect/network_passes.h"
#include "detect/network_runner.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/detect/engine_outputs.h"
#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<float> outputs_of(const Network& network, Precision precision) {
  const auto runner = NetworkRunner::create(network, precision).value();
  test::fill_test_input(runner->input());
  EXPECT_TRUE(runner->run({}));
  return test::all_outputs(*runner);
}

Network round_trip(const Network& network, WeightFormat format) {
  const TemporaryFolder folder;
  const std::string path = folder / "n.posednet";
  const Status written = write_network(network, format, path);
  EXPECT_TRUE(written) << written.error().message;
  return read_network(path).value();
}

/// Bytes of a file of the small network, and their checksum mended after a change.
std::vector<std::uint8_t> small_file() {
  const TemporaryFolder folder;
  EXPECT_TRUE(write_network(test::calibrated_small_network(CalibrationMethod::MinMax), WeightFormat::Int8, folder / "n.posednet"));
  return test::file_bytes(folder / "n.posednet");
}

void mend_checksum(std::vector<std::uint8_t>& bytes) {
  const std::uint32_t checksum = crc32c(std::span(bytes).first(bytes.size() - 4));
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[bytes.size() - 4 + i] = static_cast<std::uint8_t>(checksum >> (8 * i));
  }
}

TEST(NetworkFile, FloatsComeBackAsTheyWere) {
  const Network network = test::calibrated_small_network();
  const Network again = round_trip(network, WeightFormat::Float32);
  EXPECT_EQ(outputs_of(again, Precision::Float32), outputs_of(network, Precision::Float32));
  EXPECT_EQ(outputs_of(again, Precision::Int8), outputs_of(network, Precision::Int8));
  EXPECT_EQ(again.metadata().name, network.metadata().name);
  EXPECT_EQ(again.metadata().classes, network.metadata().classes);
  EXPECT_EQ(again.metadata().strides, network.metadata().strides);
  ASSERT_EQ(again.metadata().anchors.size(), 2U);
  EXPECT_EQ(again.metadata().anchors[1][2].height, network.metadata().anchors[1][2].height);
  ASSERT_EQ(again.ranges().size(), network.ranges().size());
  EXPECT_EQ(again.ranges()[5].high, network.ranges()[5].high);
}

TEST(NetworkFile, SimplifiesWhatItWrites) {
  const Network again = round_trip(test::small_network(), WeightFormat::Float32);
  EXPECT_EQ(again.nodes().size(), simplify(test::small_network())->nodes().size());
  EXPECT_TRUE(again.ranges().empty());
}

TEST(NetworkFile, EightBitWeightsMakeTheSameEightBitNetwork) {
  const Network network = test::calibrated_small_network();
  const Network again = round_trip(network, WeightFormat::Int8);
  // Attention blocks are stored in 16 bits.
  EXPECT_LT(test::difference(outputs_of(again, Precision::Int8), outputs_of(network, Precision::Int8)).relative, 0.02);
  // Written again, nothing more is lost.
  EXPECT_EQ(outputs_of(round_trip(again, WeightFormat::Int8), Precision::Int8), outputs_of(again, Precision::Int8));
}

TEST(NetworkFile, SixteenBitWeightsLoseLittle) {
  const Network network = test::small_network();
  const test::Difference difference = test::difference(outputs_of(round_trip(network, WeightFormat::Float16), Precision::Float32),
                                                       outputs_of(network, Precision::Float32));
  EXPECT_LT(difference.relative, 2e-3);
  EXPECT_GT(difference.relative, 0);
}

TEST(NetworkFile, RefusesWeightsThatSixteenBitsCannotHold) {
  Convolution convolution;
  convolution.out_channels = 1;
  convolution.weights = {1e6F};
  convolution.bias = {0};
  const Network network = Network::create("f", {1, 2, 2}, {{"c", convolution, {0}}}, {1}, {}).value();
  const TemporaryFolder folder;
  const Status written = write_network(network, WeightFormat::Float16, folder / "n.posednet");
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("too large for 16 bits"));
  EXPECT_FALSE(read_network(folder / "n.posednet")) << "nothing is left behind";
}

/// Every operation, also those that a simplified network of ours has not.
TEST(NetworkFile, HoldsEveryOperation) {
  const std::vector<Node> nodes{{"affine", ChannelAffine{{1, 2}, {3, 4}}, {0}},
                                {"activate", Activate{Activation::Relu}, {1}},
                                {"pool", MaxPool{3, 2, 1}, {2}},
                                {"global", GlobalPool{Reduction::Max}, {3}},
                                {"gate", Multiply{}, {3, 4}},
                                {"channel", ChannelPool{Reduction::Mean}, {5}},
                                {"slice", Subsample2x{1, 0}, {6}},
                                {"depth", SpaceToDepth{}, {5}}};
  const Network network = Network::create("f", {2, 8, 8}, nodes, {7, 8}, {}).value();
  const Network again = round_trip(network, WeightFormat::Float32);
  ASSERT_EQ(again.nodes().size(), nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    EXPECT_EQ(again.nodes()[i].name, nodes[i].name);
    EXPECT_EQ(again.nodes()[i].inputs, nodes[i].inputs);
    EXPECT_EQ(again.nodes()[i].operation.index(), nodes[i].operation.index());
  }
  EXPECT_EQ(std::get<ChannelAffine>(again.nodes()[0].operation).shift, (std::vector<float>{3, 4}));
  EXPECT_EQ(std::get<Activate>(again.nodes()[1].operation).activation, Activation::Relu);
  EXPECT_EQ(std::get<MaxPool>(again.nodes()[2].operation).stride, 2);
  EXPECT_EQ(std::get<GlobalPool>(again.nodes()[3].operation).reduction, Reduction::Max);
  EXPECT_EQ(std::get<ChannelPool>(again.nodes()[5].operation).reduction, Reduction::Mean);
  EXPECT_EQ(std::get<Subsample2x>(again.nodes()[6].operation).first_row, 1);
}

TEST(NetworkFile, LoadsEitherKind) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_network(test::small_network(), WeightFormat::Float32, folder / "n"));
  EXPECT_TRUE(load_network({folder / "n", {}}));
  EXPECT_TRUE(load_network({test::small_onnx_path(), {}}));
  EXPECT_EQ(load_network({folder / "missing", {}}).error().code, ErrorCode::NotFound);
  const Result<Network> foreign = read_network(test::small_onnx_path());
  ASSERT_FALSE(foreign);
  EXPECT_THAT(foreign.error().message, HasSubstr("does not begin with 'POSEDNET'"));
}

TEST(NetworkLoader, ReadsAFileOnceForAllSizes) {
  const TemporaryFolder folder;
  const std::string file = folder / "n";
  const Network written = test::small_network();
  ASSERT_TRUE(write_network(written, WeightFormat::Float32, file));
  NetworkLoader networks;
  const ModelName as_written{file, {}};
  const ModelName larger{file, {{2 * written.input().width, written.input().height}}};
  ASSERT_TRUE(networks.load(larger));
  std::filesystem::remove(file);
  EXPECT_EQ(networks.load(as_written).value().input(), written.input());
  EXPECT_EQ(networks.load(larger).value().input().width, larger.sizes[0].width);

  EXPECT_TRUE(networks.load({test::small_onnx_path(), {}}));
  EXPECT_EQ(networks.load(as_written).error().code, ErrorCode::NotFound) << "only the file read last is kept";
}

TEST(NetworkLoader, ANetworkHasOneSize) {
  const Result<Network> refused = load_network({"n", {{64, 64}, {32, 32}}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("n@64x64+32x32: one size is wanted, not 2"));
}

TEST(NetworkFile, NoticesEveryTruncation) {
  const std::vector<std::uint8_t> bytes = small_file();
  for (std::size_t length = 0; length < bytes.size(); length += length < 100 ? 1 : 97) {
    EXPECT_FALSE(parse_network(std::span(bytes).first(length), "n")) << length;
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(parse_network(longer, "n"));
}

TEST(NetworkFile, NoticesEveryFlippedBit) {
  std::vector<std::uint8_t> bytes = small_file();
  for (std::size_t place = 0; place < bytes.size(); place += place < 64 ? 1 : 61) {
    bytes[place] ^= static_cast<std::uint8_t>(1U << (place % 8));
    EXPECT_FALSE(parse_network(bytes, "n")) << place;
    bytes[place] ^= static_cast<std::uint8_t>(1U << (place % 8));
  }
  EXPECT_TRUE(parse_network(bytes, "n"));
}

TEST(NetworkFile, TellsANewerVersion) {
  std::vector<std::uint8_t> bytes = small_file();
  bytes[8] = 3;
  mend_checksum(bytes);
  const Result<Network> network = parse_network(bytes, "n.posednet");
  ASSERT_FALSE(network);
  EXPECT_EQ(network.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(network.error().message, HasSubstr("format version 3"));
  bytes[8] = 0;
  mend_checksum(bytes);
  EXPECT_FALSE(parse_network(bytes, "n.posednet"));
}

TEST(NetworkFile, IsOfTheOldestVersionThatCanHoldIt) {
  Convolution convolution;
  convolution.out_channels = 12;
  convolution.weights.assign(12, 0.5F);
  convolution.bias.assign(12, 0);
  const TemporaryFolder folder;
  for (const int boxes : {1, 2}) {
    NetworkMetadata metadata{"n", {"person"}, {1}, {std::vector<Anchor>(static_cast<std::size_t>(2 / boxes), Anchor{3, 4})}, boxes};
    const Network network = Network::create("f", {1, 2, 2}, {{"c", convolution, {0}}}, {1}, metadata).value();
    ASSERT_TRUE(write_network(network, WeightFormat::Float32, folder / "n.posednet"));
    EXPECT_EQ(test::file_bytes(folder / "n.posednet")[8], boxes) << "version 1 can be read by an older posed";
    const Result<Network> again = read_network(folder / "n.posednet");
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->metadata().boxes_per_anchor, boxes);
    EXPECT_EQ(again->metadata().anchors[0].size(), metadata.anchors[0].size());
  }
}

TEST(NetworkFile, SurvivesWrongContentsUnderARightChecksum) {
  const std::vector<std::uint8_t> good = small_file();
  std::mt19937 random(1);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::uint8_t> bytes = good;
    for (int change = 0; change < 8; ++change) {
      bytes[20 + random() % (bytes.size() - 24)] = static_cast<std::uint8_t>(random());
    }
    mend_checksum(bytes);
    const Result<Network> network = parse_network(bytes, "n.posednet");
    refused += network ? 0 : 1;
    if (!network) {
      EXPECT_THAT(network.error().message, StartsWith("n.posednet: "));
    }
  }
  EXPECT_GT(refused, 50);
}

TEST(Half, EveryNumberComesBack) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    const float value = half_to_float(static_cast<std::uint16_t>(bits));
    if (!std::isnan(value)) {
      ASSERT_EQ(float_to_half(value), bits) << value;
    }
  }
  EXPECT_TRUE(std::isnan(half_to_float(float_to_half(std::numeric_limits<float>::quiet_NaN()))));
}

TEST(Half, RoundsToTheNearest) {
  EXPECT_EQ(half_to_float(float_to_half(1.0F + 1.0F / 2048)), 1.0F) << "a tie goes to the even one";
  EXPECT_EQ(half_to_float(float_to_half(1.0F + 3.0F / 2048)), 1.0F + 1.0F / 512);
  EXPECT_EQ(half_to_float(float_to_half(1.9999F)), 2.0F) << "into the next power of two";
  EXPECT_EQ(half_to_float(float_to_half(65519.0F)), 65504.0F);
  EXPECT_TRUE(std::isinf(half_to_float(float_to_half(65520.0F))));
  EXPECT_EQ(half_to_float(float_to_half(6.2e-5F)), half_to_float(0x0410));
  EXPECT_EQ(float_to_half(1e-9F), 0);
  EXPECT_EQ(float_to_half(-1e-9F), 0x8000);
}

}  // namespace
}  // namespace posed
