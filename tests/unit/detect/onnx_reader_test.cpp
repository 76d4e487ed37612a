#include "detect/onnx_reader.h"

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <onnx/onnx_pb.h>

#include "tests/support/temporary_folder.h"
#include "tests/unit/detect/small_network.h"

namespace posed {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

onnx::ModelProto small_model() {
  onnx::ModelProto model;
  const std::vector<std::uint8_t> bytes = test::file_bytes(test::small_onnx_path());
  EXPECT_TRUE(model.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return model;
}

/// The message with which a changed model is refused.
std::string refusal(const std::function<void(onnx::ModelProto&)>& change) {
  onnx::ModelProto model = small_model();
  change(model);
  const std::string bytes = model.SerializeAsString();
  const Result<Network> network = parse_onnx({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "m.onnx");
  return network ? "not refused" : network.error().message;
}

onnx::NodeProto& node_of_type(onnx::ModelProto& model, const std::string& type) {
  for (onnx::NodeProto& node : *model.mutable_graph()->mutable_node()) {
    if (node.op_type() == type) {
      return node;
    }
  }
  throw std::logic_error("no node of type " + type);
}

onnx::AttributeProto& attribute(onnx::NodeProto& node, const std::string& name) {
  for (onnx::AttributeProto& found : *node.mutable_attribute()) {
    if (found.name() == name) {
      return found;
    }
  }
  onnx::AttributeProto& added = *node.add_attribute();
  added.set_name(name);
  return added;
}

TEST(OnnxReader, ReadsGraphAndMetadata) {
  const Network network = test::small_network();
  EXPECT_EQ(network.input(), (TensorShape{3, 64, 96}));
  ASSERT_EQ(network.outputs().size(), 2U);
  EXPECT_EQ(network.shapes()[static_cast<std::size_t>(network.outputs()[0])], (TensorShape{18, 16, 24}));
  EXPECT_EQ(network.shapes()[static_cast<std::size_t>(network.outputs()[1])], (TensorShape{18, 8, 12}));
  const NetworkMetadata& metadata = network.metadata();
  EXPECT_EQ(metadata.name, "small test network");
  EXPECT_EQ(metadata.classes, std::vector<std::string>{"person"});
  EXPECT_EQ(metadata.strides, (std::vector<int>{4, 8}));
  ASSERT_EQ(metadata.anchors.size(), 2U);
  EXPECT_EQ(metadata.anchors[1][0].width, 20);
  EXPECT_EQ(metadata.anchors[1][0].height, 44);
  EXPECT_EQ(metadata.boxes_per_anchor, 1) << "where nothing is said";
  EXPECT_EQ(read_onnx_input(test::small_onnx_path()).value(), network.input());
}

TEST(OnnxReader, ReadsWithoutMetadata) {
  onnx::ModelProto model = small_model();
  model.clear_metadata_props();
  const std::string bytes = model.SerializeAsString();
  const Result<Network> network = parse_onnx({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "m.onnx");
  ASSERT_TRUE(network) << network.error().message;
  EXPECT_TRUE(network->metadata().strides.empty());
}

TEST(OnnxReader, TakesAConstantByAnotherName) {
  // Exporters write equal constants once and give the others their names by Identity.
  const auto with_alias = [](const char* aliased) {
    return refusal([&](onnx::ModelProto& model) {
      onnx::NodeProto& convolution = node_of_type(model, "Conv");
      onnx::NodeProto identity;
      identity.set_op_type("Identity");
      identity.add_input(aliased == nullptr ? convolution.input(1) : aliased);
      identity.add_output("alias");
      convolution.set_input(1, "alias");
      model.mutable_graph()->mutable_node()->Add()->CopyFrom(identity);
      for (int i = model.graph().node_size() - 1; i > 0; --i) {
        model.mutable_graph()->mutable_node()->SwapElements(i, i - 1);
      }
    });
  };
  EXPECT_EQ(with_alias(nullptr), "not refused");
  EXPECT_THAT(with_alias("nowhere"), HasSubstr("(Identity): input 'nowhere' is computed by no node"));
}

TEST(OnnxReader, TakesWeightsOf16Bits) {
  // Files that are half as large: weights of 16 bits, each with a Cast.
  const auto with_cast = [](onnx::ModelProto& model, bool of_a_constant, int to) {
    onnx::NodeProto& convolution = node_of_type(model, "Conv");
    for (onnx::TensorProto& constant : *model.mutable_graph()->mutable_initializer()) {
      if (of_a_constant && constant.name() == convolution.input(1)) {
        const std::size_t count = constant.raw_data().size() / sizeof(float);
        constant.set_data_type(onnx::TensorProto::FLOAT16);
        constant.clear_raw_data();
        for (std::size_t i = 0; i < count; ++i) {
          constant.add_int32_data(i % 2 == 0 ? 0x3c00 : 0xb800);  // 1 and -0.5
        }
      }
    }
    onnx::NodeProto cast;
    cast.set_op_type("Cast");
    cast.add_input(convolution.input(of_a_constant ? 1 : 0));
    cast.add_output("floats");
    onnx::AttributeProto& type = attribute(cast, "to");
    type.set_type(onnx::AttributeProto::INT);
    type.set_i(to);
    convolution.set_input(of_a_constant ? 1 : 0, "floats");
    model.mutable_graph()->mutable_node()->Add()->CopyFrom(cast);
    for (int i = model.graph().node_size() - 1; i > 0; --i) {
      model.mutable_graph()->mutable_node()->SwapElements(i, i - 1);
    }
  };
  onnx::ModelProto model = small_model();
  with_cast(model, true, onnx::TensorProto::FLOAT);
  const std::string bytes = model.SerializeAsString();
  const Result<Network> network = parse_onnx({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "m.onnx");
  ASSERT_TRUE(network) << network.error().message;
  const std::vector<float>* weights = nullptr;
  for (const Node& node : network->nodes()) {
    if (const auto* convolution = std::get_if<Convolution>(&node.operation); convolution != nullptr && weights == nullptr) {
      weights = &convolution->weights;
    }
  }
  ASSERT_NE(weights, nullptr);
  ASSERT_GE(weights->size(), 2U);
  EXPECT_EQ(weights->at(0), 1.0F);
  EXPECT_EQ(weights->at(1), -0.5F);
  EXPECT_THAT(refusal([&](auto& m) { with_cast(m, true, onnx::TensorProto::DOUBLE); }),
              HasSubstr("(Cast): only constants of 16 bits"));
  EXPECT_THAT(refusal([&](auto& m) { with_cast(m, false, onnx::TensorProto::FLOAT); }),
              HasSubstr("(Cast): input 0 must be a constant"));
}

TEST(OnnxReader, NamesWhatIsNotSupported) {
  EXPECT_THAT(refusal([](auto& model) { node_of_type(model, "Conv").set_op_type("ConvTranspose"); }),
              AllOf(StartsWith("m.onnx: node '"), HasSubstr("(ConvTranspose): this operator is not supported")));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "Conv"), "dilations").set_ints(0, 2); }),
              HasSubstr("dilations"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "Conv"), "pads").set_ints(0, 3); }),
              HasSubstr("pads = [3, 1, 1, 1]"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "MaxPool"), "ceil_mode").set_i(1); }),
              HasSubstr("ceil_mode"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "Concat"), "axis").set_i(2); }), HasSubstr("axis = 2"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "ReduceMean"), "axes").set_ints(0, 3); }),
              HasSubstr("axes = [3]"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "ReduceMean"), "keepdims").set_i(0); }),
              HasSubstr("keepdims"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "Resize"), "mode").set_s("linear"); }), HasSubstr("linear"));
  EXPECT_THAT(refusal([](auto& model) { attribute(node_of_type(model, "Resize"), "nearest_mode").set_s("ceil"); }),
              HasSubstr("ceil"));
  EXPECT_THAT(refusal([](auto& model) { node_of_type(model, "Conv").set_domain("com.example"); }),
              HasSubstr("domain 'com.example'"));
  EXPECT_THAT(refusal([](auto& model) { model.mutable_opset_import(0)->set_version(18); }), HasSubstr("operator set 18; 11 to 17"));
  EXPECT_THAT(
      refusal([](auto& model) { model.mutable_graph()->mutable_initializer(0)->set_data_location(onnx::TensorProto::EXTERNAL); }),
      HasSubstr("is kept in another file"));
  EXPECT_THAT(refusal([](auto& model) { *model.mutable_graph()->add_input() = model.graph().output(0); }),
              HasSubstr("a second input"));
  const auto dimension = [](onnx::ModelProto& model, int index) {
    return model.mutable_graph()->mutable_input(0)->mutable_type()->mutable_tensor_type()->mutable_shape()->mutable_dim(index);
  };
  EXPECT_THAT(refusal([&](auto& model) { dimension(model, 2)->set_dim_param("height"); }), HasSubstr("has no fixed size"));
  EXPECT_THAT(refusal([&](auto& model) { dimension(model, 0)->set_dim_value(8); }), HasSubstr("is for 8 images"));
}

TEST(OnnxReader, NamesWhatIsBroken) {
  EXPECT_THAT(refusal([](auto& model) { node_of_type(model, "Add").set_input(0, "nowhere"); }),
              HasSubstr("input 'nowhere' is computed by no node"));
  EXPECT_THAT(refusal([](auto& model) { model.mutable_graph()->mutable_output(0)->set_name("nowhere"); }),
              HasSubstr("output 'nowhere'"));
  EXPECT_THAT(refusal([](auto& model) { model.mutable_graph()->mutable_initializer(0)->mutable_raw_data()->pop_back(); }),
              HasSubstr("bytes for"));
  EXPECT_THAT(refusal([](auto& model) { model.mutable_graph()->mutable_initializer(0)->set_dims(0, -1); }),
              HasSubstr("impossible size"));
  EXPECT_THAT(refusal([](auto& model) { node_of_type(model, "MaxPool").clear_input(); }), HasSubstr("input 0 is missing"));
  EXPECT_THAT(refusal([](auto& model) { node_of_type(model, "Sigmoid").clear_output(); }), HasSubstr("has no output"));
  EXPECT_THAT(refusal([](auto& model) { model.mutable_graph()->clear_input(); }), HasSubstr("the graph has no input"));
}

TEST(OnnxReader, NamesWrongMetadata) {
  const auto with = [](const std::string& key, const std::string& value) {
    return refusal([&](onnx::ModelProto& model) {
      for (onnx::StringStringEntryProto& entry : *model.mutable_metadata_props()) {
        if (entry.key() == key) {
          entry.set_value(value);
        }
      }
    });
  };
  EXPECT_THAT(with("posed.strides", "[4, "), HasSubstr("property posed.strides = '[4, ' is not the JSON"));
  EXPECT_THAT(with("posed.classes", "3"), HasSubstr("property posed.classes"));
  EXPECT_THAT(with("posed.anchors", "[[[1, 2, 3]]]"), HasSubstr("an anchor is [width, height]"));
  EXPECT_THAT(with("posed.strides", "[4, 16]"), HasSubstr("the metadata do not fit the network"));
  EXPECT_THAT(with("posed.input", "[3, 64, 64]"), HasSubstr("posed.input is [3, 64, 64], the graph's input is [3, 64, 96]"));
}

TEST(OnnxReader, RefusesForeignAndMissingFiles) {
  const TemporaryFolder folder;
  const Result<Network> foreign = read_onnx(folder.write("foreign.onnx", "this is no network at all"));
  ASSERT_FALSE(foreign);
  EXPECT_THAT(foreign.error().message, HasSubstr("foreign.onnx: is no ONNX file, or a truncated one"));
  EXPECT_FALSE(read_onnx(folder.write("empty.onnx", "")));
  const Result<Network> missing = read_onnx(folder / "missing.onnx");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_FALSE(read_onnx_input(folder / "foreign.onnx"));
}

TEST(OnnxReader, SurvivesTruncation) {
  const std::vector<std::uint8_t> bytes = test::file_bytes(test::small_onnx_path());
  for (std::size_t length = 0; length < bytes.size(); length += 397) {
    const Result<Network> network = parse_onnx(std::span(bytes).first(length), "m.onnx");
    ASSERT_FALSE(network) << length;
    EXPECT_THAT(network.error().message, StartsWith("m.onnx: "));
  }
}

TEST(OnnxReader, SurvivesFlippedBytes) {
  const std::vector<std::uint8_t> good = test::file_bytes(test::small_onnx_path());
  std::mt19937 random(1);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::uint8_t> bytes = good;
    for (int flip = 0; flip < 8; ++flip) {
      bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U + random() % 255);
    }
    // Most of the file is weights, whose values nothing can check, so some trials are accepted.
    const Result<Network> network = parse_onnx(bytes, "m.onnx");
    refused += network ? 0 : 1;
    if (!network) {
      EXPECT_THAT(network.error().message, StartsWith("m.onnx: "));
    }
  }
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace posed
