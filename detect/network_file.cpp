#include "detect/network_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/crc32c.h"
#include "core/file_io.h"
#include "detect/half.h"
#include "detect/network_passes.h"
#include "detect/quantization_plan.h"

namespace posed {
namespace {

constexpr std::string_view kMagic = "POSEDNET";
constexpr std::uint32_t kVersionWithBoxesPerAnchor = 2;
constexpr std::size_t kHeadBytes = 20;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::uint32_t kMaxListLength = 1 << 16;

/// Why a file is not taken; caught where the file's name is known.
struct Refusal {
  std::string what;
};

class ByteWriter {
 public:
  template <typename T>
  void number(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
  }
  void real(float value) { number(std::bit_cast<std::uint32_t>(value)); }
  void integer(int value) { number(static_cast<std::uint32_t>(value)); }
  void size(std::size_t value) { number(static_cast<std::uint32_t>(value)); }
  void text(std::string_view value) {
    size(value.size());
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  }
  template <typename List, typename Write>
  void list(const List& values, Write write) {
    size(values.size());
    for (const auto& value : values) {
      write(value);
    }
  }
  void reals(const std::vector<float>& values, WeightFormat format);

  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

void ByteWriter::reals(const std::vector<float>& values, WeightFormat format) {
  number(static_cast<std::uint8_t>(format));
  list(values, [&](float value) {
    if (format == WeightFormat::Float16) {
      const std::uint16_t half = float_to_half(value);
      if (!std::isfinite(half_to_float(half))) {
        throw Refusal{fmt::format("a weight of {} is too large for 16 bits; store 32", value)};
      }
      number(half);
    } else {
      real(value);
    }
  });
}

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  template <typename T>
  T number() {
    std::uint64_t value = 0;
    const std::span<const std::uint8_t> bytes = take(sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
    }
    return static_cast<T>(value);
  }
  float real() { return std::bit_cast<float>(number<std::uint32_t>()); }
  int integer() { return std::bit_cast<std::int32_t>(number<std::uint32_t>()); }
  std::string text() {
    const std::span<const std::uint8_t> bytes = take(number<std::uint32_t>());
    return {bytes.begin(), bytes.end()};
  }
  template <typename Read>
  auto list(Read read) {
    const auto size = number<std::uint32_t>();
    if (size > kMaxListLength) {
      throw Refusal{fmt::format("a list claims {} entries", size)};
    }
    std::vector<decltype(read())> values;
    for (std::uint32_t i = 0; i < size; ++i) {
      values.push_back(read());
    }
    return values;
  }
  WeightFormat format() {
    const auto format = number<std::uint8_t>();
    if (format > static_cast<std::uint8_t>(WeightFormat::Int8)) {
      throw Refusal{fmt::format("weights of the unknown format {}", format)};
    }
    return static_cast<WeightFormat>(format);
  }
  std::vector<float> reals() { return reals(format()); }
  std::vector<float> reals(WeightFormat format);
  bool at_end() const { return rest_.empty(); }

  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > rest_.size()) {
      throw Refusal{"something is missing at its end"};
    }
    const std::span<const std::uint8_t> taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

std::vector<float> ByteReader::reals(WeightFormat format) {
  const auto size = number<std::uint32_t>();
  ByteReader values(take(std::size_t{size} * (format == WeightFormat::Float16 ? 2 : 4)));
  std::vector<float> result(size);
  std::generate(result.begin(), result.end(),
                [&] { return format == WeightFormat::Float16 ? half_to_float(values.number<std::uint16_t>()) : values.real(); });
  return result;
}

/// Writes what follows the number of the operation's kind, which is its place in `Operation`.
struct OperationWriter {
  ByteWriter& out;
  WeightFormat format;

  void operator()(const Convolution& op) const {
    for (const int value : {op.out_channels, op.groups, op.kernel, op.stride, op.padding}) {
      out.integer(value);
    }
    out.number(static_cast<std::uint8_t>(op.activation));
    if (format == WeightFormat::Int8) {
      const QuantizedWeights quantized = quantize_weights(op);
      out.number(static_cast<std::uint8_t>(format));
      out.reals(quantized.scales, WeightFormat::Float32);
      out.list(quantized.values, [this](std::int8_t value) { out.number(value); });
    } else {
      out.reals(op.weights, format);
    }
    out.reals(op.bias, WeightFormat::Float32);
  }
  void operator()(const ChannelAffine& op) const {
    out.reals(op.scale, WeightFormat::Float32);
    out.reals(op.shift, WeightFormat::Float32);
  }
  void operator()(const Activate& op) const { out.number(static_cast<std::uint8_t>(op.activation)); }
  void operator()(const Add& /*op*/) const {}
  void operator()(const Multiply& /*op*/) const {}
  void operator()(const Concat& /*op*/) const {}
  void operator()(const Upsample2x& /*op*/) const {}
  void operator()(const MaxPool& op) const {
    out.integer(op.kernel);
    out.integer(op.stride);
    out.integer(op.padding);
  }
  void operator()(const GlobalPool& op) const { out.number(static_cast<std::uint8_t>(op.reduction)); }
  void operator()(const ChannelPool& op) const { out.number(static_cast<std::uint8_t>(op.reduction)); }
  void operator()(const Subsample2x& op) const {
    out.integer(op.first_row);
    out.integer(op.first_column);
  }
  void operator()(const SpaceToDepth& /*op*/) const {}
  void operator()(const Cbam& op) const {
    // Small, and a sigmoid follows them: not worth 8 bits.
    const WeightFormat floats = format == WeightFormat::Float32 ? WeightFormat::Float32 : WeightFormat::Float16;
    out.integer(op.hidden);
    out.integer(op.kernel);
    for (const std::vector<float>* values : {&op.weights1, &op.bias1, &op.weights2, &op.bias2, &op.spatial_weights}) {
      out.reals(*values, floats);
    }
    out.real(op.spatial_bias);
  }
};

/// Reads what `OperationWriter` wrote, into an operation of the right kind.
struct OperationReader {
  ByteReader& in;

  template <typename Enum>
  Enum enumerator(Enum last) const {
    const auto value = in.number<std::uint8_t>();
    if (value > static_cast<std::uint8_t>(last)) {
      throw Refusal{fmt::format("an operation has the unknown kind {}", value)};
    }
    return static_cast<Enum>(value);
  }
  void operator()(Convolution& op) const;
  void operator()(ChannelAffine& op) const {
    op.scale = in.reals();
    op.shift = in.reals();
  }
  void operator()(Activate& op) const { op.activation = enumerator(Activation::Sigmoid); }
  void operator()(Add& /*op*/) const {}
  void operator()(Multiply& /*op*/) const {}
  void operator()(Concat& /*op*/) const {}
  void operator()(Upsample2x& /*op*/) const {}
  void operator()(MaxPool& op) const {
    op.kernel = in.integer();
    op.stride = in.integer();
    op.padding = in.integer();
  }
  void operator()(GlobalPool& op) const { op.reduction = enumerator(Reduction::Max); }
  void operator()(ChannelPool& op) const { op.reduction = enumerator(Reduction::Max); }
  void operator()(Subsample2x& op) const {
    op.first_row = in.integer();
    op.first_column = in.integer();
  }
  void operator()(SpaceToDepth& /*op*/) const {}
  void operator()(Cbam& op) const {
    op.hidden = in.integer();
    op.kernel = in.integer();
    for (std::vector<float>* values : {&op.weights1, &op.bias1, &op.weights2, &op.bias2, &op.spatial_weights}) {
      *values = in.reals();
    }
    op.spatial_bias = in.real();
  }
};

void OperationReader::operator()(Convolution& op) const {
  for (int* value : {&op.out_channels, &op.groups, &op.kernel, &op.stride, &op.padding}) {
    *value = in.integer();
  }
  op.activation = enumerator(Activation::Sigmoid);
  const WeightFormat format = in.format();
  if (format == WeightFormat::Int8) {
    const std::vector<float> scales = in.reals();
    const std::span<const std::uint8_t> values = in.take(in.number<std::uint32_t>());
    if (scales.empty() || values.size() % scales.size() != 0) {
      throw Refusal{fmt::format("{} weights have {} scales", values.size(), scales.size())};
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      op.weights.push_back(scales[i / (values.size() / scales.size())] * static_cast<float>(std::bit_cast<std::int8_t>(values[i])));
    }
  } else {
    op.weights = in.reals(format);
  }
  op.bias = in.reals();
}

template <std::size_t kKind = 0>
Operation operation_of_kind(std::size_t kind) {
  if constexpr (kKind < std::variant_size_v<Operation>) {
    return kind == kKind ? Operation(std::in_place_index<kKind>) : operation_of_kind<kKind + 1>(kind);
  } else {
    throw Refusal{fmt::format("a node has the unknown operation {}", kind)};
  }
}

/// The oldest version that can hold the network: what needs nothing new can be read by an older posed.
std::uint32_t version_for(const Network& network) {
  return network.metadata().boxes_per_anchor == 1 ? kOldestNetworkFormatVersion : kVersionWithBoxesPerAnchor;
}

void write_body(const Network& network, WeightFormat format, ByteWriter& out) {
  const NetworkMetadata& metadata = network.metadata();
  const auto write_integer = [&](int value) { out.integer(value); };
  out.text(metadata.name);
  out.list(metadata.classes, [&](const std::string& name) { out.text(name); });
  out.list(metadata.strides, write_integer);
  out.list(metadata.anchors, [&](const std::vector<Anchor>& anchors) {
    out.list(anchors, [&](const Anchor& anchor) {
      out.real(anchor.width);
      out.real(anchor.height);
    });
  });
  if (version_for(network) >= kVersionWithBoxesPerAnchor) {
    out.integer(metadata.boxes_per_anchor);
  }
  for (const int value : {network.input().channels, network.input().height, network.input().width}) {
    out.integer(value);
  }
  out.list(network.nodes(), [&](const Node& node) {
    out.text(node.name);
    out.list(node.inputs, write_integer);
    out.number(static_cast<std::uint8_t>(node.operation.index()));
    std::visit(OperationWriter{out, format}, node.operation);
  });
  out.list(network.outputs(), write_integer);
  out.list(network.ranges(), [&](const ValueRange& range) {
    out.real(range.low);
    out.real(range.high);
  });
}

Result<Network> read_body(ByteReader& in, std::uint32_t version, const std::string& source) {
  const auto read_integer = [&] { return in.integer(); };
  NetworkMetadata metadata;
  metadata.name = in.text();
  metadata.classes = in.list([&] { return in.text(); });
  metadata.strides = in.list(read_integer);
  metadata.anchors = in.list([&] {
    return in.list([&] {
      const float width = in.real();
      return Anchor{width, in.real()};
    });
  });
  if (version >= kVersionWithBoxesPerAnchor) {
    metadata.boxes_per_anchor = in.integer();
  }
  TensorShape input;
  input.channels = in.integer();
  input.height = in.integer();
  input.width = in.integer();
  std::vector<Node> nodes = in.list([&] {
    Node node;
    node.name = in.text();
    node.inputs = in.list(read_integer);
    node.operation = operation_of_kind(in.number<std::uint8_t>());
    std::visit(OperationReader{in}, node.operation);
    return node;
  });
  std::vector<int> outputs = in.list(read_integer);
  std::vector<ValueRange> ranges = in.list([&] {
    const float low = in.real();
    return ValueRange{low, in.real()};
  });
  if (!in.at_end()) {
    throw Refusal{"something follows its end"};
  }
  Result<Network> network = Network::create(source, input, std::move(nodes), std::move(outputs), std::move(metadata));
  if (network && !ranges.empty()) {
    if (const Status set = network->set_ranges(std::move(ranges)); !set) {
      return tl::unexpected<Error>(set.error());
    }
  }
  return network;
}

struct Body {
  std::uint32_t version = 0;
  std::span<const std::uint8_t> bytes;
};

/// The body of a file whose head, length and checksum are right.
Result<Body> checked_body(std::span<const std::uint8_t> bytes, const std::string& source) {
  const auto damaged = [&](std::string_view what) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{}: is a damaged network file: {}. Restore a copy of it or convert it again", source, what));
  };
  if (bytes.size() < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{}: is no network file of posed: it does not begin with '{}'", source, kMagic));
  }
  if (bytes.size() < kHeadBytes + kChecksumBytes) {
    return damaged("it ends early");
  }
  ByteReader head(bytes.subspan(kMagic.size()));
  const auto version = head.number<std::uint32_t>();
  if (version < kOldestNetworkFormatVersion || version > kNetworkFormatVersion) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: is of format version {}, which this posed cannot read; it reads versions {} to {}. "
                                  "Convert the network again with this posed",
                                  source, version, kOldestNetworkFormatVersion, kNetworkFormatVersion));
  }
  const auto body_bytes = head.number<std::uint64_t>();
  if (body_bytes != bytes.size() - kHeadBytes - kChecksumBytes) {
    return damaged(fmt::format("{} bytes were written, {} are here", body_bytes, bytes.size() - kHeadBytes - kChecksumBytes));
  }
  if (ByteReader(bytes.last(kChecksumBytes)).number<std::uint32_t>() != crc32c(bytes.first(bytes.size() - kChecksumBytes))) {
    return damaged("its checksum is wrong");
  }
  return Body{version, bytes.subspan(kHeadBytes, body_bytes)};
}

}  // namespace

Status write_network(const Network& network, WeightFormat format, const std::filesystem::path& path) {
  const Result<Network> simple = simplify(network);
  if (!simple) {
    return tl::unexpected<Error>(simple.error());
  }
  ByteWriter body;
  try {
    write_body(*simple, format, body);
  } catch (const Refusal& refusal) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("{}: {}", path.string(), refusal.what));
  }
  ByteWriter head;
  for (const char letter : kMagic) {
    head.number(static_cast<std::uint8_t>(letter));
  }
  head.number(version_for(*simple));
  head.number(static_cast<std::uint64_t>(body.bytes().size()));
  ByteWriter checksum;
  checksum.number(crc32c(body.bytes(), crc32c(head.bytes())));

  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) {
    return tl::unexpected<Error>(file.error());
  }
  for (const ByteWriter* part : {&head, &body, &checksum}) {
    if (const Status written = file->write(part->bytes()); !written) {
      return written;
    }
  }
  return file->commit();
}

Result<Network> parse_network(std::span<const std::uint8_t> bytes, const std::string& source) {
  const Result<Body> body = checked_body(bytes, source);
  if (!body) {
    return tl::unexpected<Error>(body.error());
  }
  try {
    ByteReader reader(body->bytes);
    return read_body(reader, body->version, source);
  } catch (const Refusal& refusal) {
    return make_error(ErrorCode::BadData, fmt::format("{}: is a damaged network file: {}", source, refusal.what));
  }
}

Result<Network> read_network(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  if (const Status read = read_file(path, bytes); !read) {
    return tl::unexpected<Error>(read.error());
  }
  return parse_network(bytes, path.string());
}

bool is_network_file(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

}  // namespace posed
