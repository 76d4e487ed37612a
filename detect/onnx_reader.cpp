#include "detect/onnx_reader.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>
#include <nlohmann/json.hpp>
#include <onnx/onnx_pb.h>

#include "core/file_io.h"
#include "detect/onnx_graph.h"

namespace posed {
namespace {

constexpr std::int64_t kOldestOperators = 11;
constexpr std::int64_t kNewestOperators = 17;

[[noreturn]] void refuse(std::string what, ErrorCode code = ErrorCode::BadData) {
  throw OnnxRefusal{code, std::move(what)};
}

onnx::ModelProto parse_model(std::span<const std::uint8_t> bytes) {
  onnx::ModelProto model;
  // Protobuf prints what it refuses to standard error; the caller gets it as an error instead.
  const google::protobuf::LogSilencer silencer;
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      !model.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) || !model.has_ir_version() || !model.has_graph()) {
    refuse("is no ONNX file, or a truncated one");
  }
  return model;
}

void check_operator_set(const onnx::ModelProto& model) {
  const auto standard =
      std::find_if(model.opset_import().begin(), model.opset_import().end(),
                   [](const onnx::OperatorSetIdProto& set) { return set.domain().empty() || set.domain() == "ai.onnx"; });
  const std::int64_t operators = standard == model.opset_import().end() ? 0 : standard->version();
  if (operators < kOldestOperators || operators > kNewestOperators) {
    refuse(fmt::format("is of ONNX operator set {}; {} to {} are supported: export with opset_version=12", operators,
                       kOldestOperators, kNewestOperators),
           ErrorCode::Unsupported);
  }
}

/// A JSON value converted to `T`; `fallback` where the model has no such property.
template <typename T>
T property(const onnx::ModelProto& model, std::string_view key, T fallback) {
  for (const onnx::StringStringEntryProto& entry : model.metadata_props()) {
    if (entry.key() == key) {
      try {
        return nlohmann::json::parse(entry.value()).get<T>();
      } catch (const nlohmann::json::exception&) {
        refuse(fmt::format("property {} = '{}' is not the JSON that is expected there", key, entry.value().substr(0, 100)));
      }
    }
  }
  return fallback;
}

NetworkMetadata read_metadata(const onnx::ModelProto& model, const TensorShape& input) {
  NetworkMetadata metadata;
  metadata.name = property<std::string>(model, "posed.name", model.graph().name());
  metadata.classes = property<std::vector<std::string>>(model, "posed.classes", {});
  metadata.strides = property<std::vector<int>>(model, "posed.strides", {});
  for (const auto& list : property<std::vector<std::vector<std::vector<float>>>>(model, "posed.anchors", {})) {
    std::vector<Anchor>& anchors = metadata.anchors.emplace_back();
    for (const std::vector<float>& anchor : list) {
      if (anchor.size() != 2) {
        refuse("property posed.anchors: an anchor is [width, height]");
      }
      anchors.push_back({anchor[0], anchor[1]});
    }
  }
  metadata.boxes_per_anchor = property<int>(model, "posed.boxes_per_anchor", 1);
  const std::vector<int> declared = property<std::vector<int>>(model, "posed.input", {});
  if (!declared.empty() && declared != std::vector<int>{input.channels, input.height, input.width}) {
    refuse(fmt::format("property posed.input is [{}], the graph's input is [{}, {}, {}]", fmt::join(declared, ", "), input.channels,
                       input.height, input.width));
  }
  return metadata;
}

/// Runs a reader of the model; what it throws becomes an error that begins with the file's name.
template <typename Read>
auto without_exceptions(std::span<const std::uint8_t> bytes, const std::string& source, Read read)
    -> decltype(read(onnx::ModelProto())) {
  try {
    return read(parse_model(bytes));
  } catch (const OnnxRefusal& refusal) {
    return make_error(refusal.code, fmt::format("{}: {}", source, refusal.what));
  } catch (const std::exception& error) {
    return make_error(ErrorCode::BadData, fmt::format("{}: {}", source, error.what()));
  }
}

}  // namespace

Result<Network> parse_onnx(std::span<const std::uint8_t> bytes, const std::string& source) {
  return without_exceptions(bytes, source, [&](const onnx::ModelProto& model) {
    check_operator_set(model);
    OnnxGraphBuilder builder(model.graph());
    NetworkMetadata metadata = read_metadata(model, builder.input());
    return Network::create(source, builder.input(), std::move(builder.nodes()), std::move(builder.outputs()), std::move(metadata));
  });
}

Result<TensorShape> read_onnx_input(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  if (const Status read = read_file(path, bytes); !read) {
    return tl::unexpected<Error>(read.error());
  }
  return without_exceptions(bytes, path.string(),
                            [](const onnx::ModelProto& model) { return Result<TensorShape>(onnx_input_shape(model.graph())); });
}

Result<Network> read_onnx(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  if (const Status read = read_file(path, bytes); !read) {
    return tl::unexpected<Error>(read.error());
  }
  return parse_onnx(bytes, path.string());
}

}  // namespace posed
