#include "detect/network_passes.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace posed {
namespace {

/// The nodes while they are rewritten. A rewrite replaces a node where it stands, or makes its readers read another tensor; nodes
/// that nothing reads any more stay until the end, so that tensors keep their numbers meanwhile.
class Rewriter {
 public:
  explicit Rewriter(const Network& network) : nodes_(network.nodes()), outputs_(network.outputs()) {}

  void fold_channel_factors();
  void recognise_silu();
  void fuse_activations();
  void recognise_space_to_depth();
  void recognise_attention();
  void remove_unread();

  std::vector<Node>& nodes() { return nodes_; }
  std::vector<int>& outputs() { return outputs_; }

 private:
  /// The operation that makes a tensor, if it is of this kind.
  template <typename T>
  T* maker(int tensor) {
    return tensor == 0 ? nullptr : std::get_if<T>(&node(tensor).operation);
  }
  Node& node(int tensor) { return nodes_[static_cast<std::size_t>(tensor) - 1]; }
  int input(int tensor, std::size_t index = 0) { return node(tensor).inputs[index]; }
  int readers(int tensor) const;
  void redirect(int from, int to);

  bool is_activation(int tensor, Activation activation);
  Convolution* pointwise(int tensor, Activation activation);
  /// The tensor that a perceptron reads whose last layer makes `tensor`.
  std::optional<int> perceptron_input(int tensor);
  std::optional<Cbam> channel_attention(int gated, int& x);
  bool spatial_attention(int tensor, int& gated, Cbam& cbam);

  std::vector<Node> nodes_;
  std::vector<int> outputs_;
};

int Rewriter::readers(int tensor) const {
  auto count = std::count(outputs_.begin(), outputs_.end(), tensor);
  for (const Node& reader : nodes_) {
    count += std::count(reader.inputs.begin(), reader.inputs.end(), tensor);
  }
  return static_cast<int>(count);
}

void Rewriter::redirect(int from, int to) {
  for (Node& reader : nodes_) {
    std::replace(reader.inputs.begin(), reader.inputs.end(), from, to);
  }
  std::replace(outputs_.begin(), outputs_.end(), from, to);
}

void Rewriter::fold_channel_factors() {
  for (int tensor = 1; tensor <= static_cast<int>(nodes_.size()); ++tensor) {
    const ChannelAffine* affine = maker<ChannelAffine>(tensor);
    Convolution* convolution = affine == nullptr ? nullptr : maker<Convolution>(input(tensor));
    if (convolution == nullptr || convolution->activation != Activation::None || readers(input(tensor)) != 1) {
      continue;
    }
    const std::size_t each = convolution->weights.size() / convolution->bias.size();
    for (std::size_t channel = 0; channel < convolution->bias.size(); ++channel) {
      const float scale = affine->scale[channel];
      convolution->bias[channel] = convolution->bias[channel] * scale + affine->shift[channel];
      const auto begin = convolution->weights.begin() + static_cast<std::ptrdiff_t>(channel * each);
      std::for_each(begin, begin + static_cast<std::ptrdiff_t>(each), [scale](float& weight) { weight *= scale; });
    }
    redirect(tensor, input(tensor));
  }
}

bool Rewriter::is_activation(int tensor, Activation activation) {
  const Activate* operation = maker<Activate>(tensor);
  return operation != nullptr && operation->activation == activation;
}

void Rewriter::recognise_silu() {
  for (int tensor = 1; tensor <= static_cast<int>(nodes_.size()); ++tensor) {
    if (maker<Multiply>(tensor) == nullptr) {
      continue;
    }
    for (const auto& [x, gate] : {std::pair(input(tensor, 0), input(tensor, 1)), std::pair(input(tensor, 1), input(tensor, 0))}) {
      if (is_activation(gate, Activation::Sigmoid) && input(gate) == x) {
        node(tensor).operation = Activate{Activation::Silu};
        node(tensor).inputs = {x};
        break;
      }
    }
  }
}

void Rewriter::fuse_activations() {
  for (int tensor = 1; tensor <= static_cast<int>(nodes_.size()); ++tensor) {
    const Activate* activate = maker<Activate>(tensor);
    Convolution* convolution = activate == nullptr ? nullptr : maker<Convolution>(input(tensor));
    if (convolution != nullptr && convolution->activation == Activation::None && readers(input(tensor)) == 1) {
      convolution->activation = activate->activation;
      redirect(tensor, input(tensor));
    }
  }
}

void Rewriter::recognise_space_to_depth() {
  constexpr std::array<std::pair<int, int>, 4> kOrder{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
  for (int tensor = 1; tensor <= static_cast<int>(nodes_.size()); ++tensor) {
    if (maker<Concat>(tensor) == nullptr || node(tensor).inputs.size() != kOrder.size()) {
      continue;
    }
    bool matches = true;
    for (std::size_t i = 0; i < kOrder.size() && matches; ++i) {
      const Subsample2x* part = maker<Subsample2x>(input(tensor, i));
      matches = part != nullptr && std::pair(part->first_row, part->first_column) == kOrder[i] &&
                input(input(tensor, i)) == input(input(tensor, 0));
    }
    if (matches) {
      node(tensor).inputs = {input(input(tensor, 0))};
      node(tensor).operation = SpaceToDepth{};
    }
  }
}

/// A 1x1 convolution of this activation, ungrouped.
Convolution* Rewriter::pointwise(int tensor, Activation activation) {
  Convolution* operation = maker<Convolution>(tensor);
  const bool is_one = operation != nullptr && operation->kernel == 1 && operation->groups == 1 && operation->stride == 1 &&
                      operation->padding == 0 && operation->activation == activation;
  return is_one ? operation : nullptr;
}

std::optional<int> Rewriter::perceptron_input(int tensor) {
  if (pointwise(tensor, Activation::None) == nullptr || pointwise(input(tensor), Activation::Relu) == nullptr) {
    return std::nullopt;
  }
  return input(input(tensor));
}

/// Matches `gated` = x * sigmoid(M(mean(x)) + M(max(x))); `x` becomes the tensor that it reads.
std::optional<Cbam> Rewriter::channel_attention(int gated, int& x) {
  if (maker<Multiply>(gated) == nullptr || !is_activation(input(gated, 1), Activation::Sigmoid)) {
    return std::nullopt;
  }
  x = input(gated, 0);
  const int sum = input(input(gated, 1));
  if (maker<Add>(sum) == nullptr) {
    return std::nullopt;
  }
  bool seen[2] = {false, false};
  for (const int branch : {input(sum, 0), input(sum, 1)}) {
    const std::optional<int> pooled = perceptron_input(branch);
    const GlobalPool* pool = pooled ? maker<GlobalPool>(*pooled) : nullptr;
    if (pool == nullptr || input(*pooled) != x) {
      return std::nullopt;
    }
    seen[pool->reduction == Reduction::Max ? 1 : 0] = true;
  }
  const Convolution* second = pointwise(input(sum, 0), Activation::None);
  const Convolution* first = pointwise(input(input(sum, 0)), Activation::Relu);
  const Convolution* other_second = pointwise(input(sum, 1), Activation::None);
  const Convolution* other_first = pointwise(input(input(sum, 1)), Activation::Relu);
  // Both branches share one perceptron.
  if (!seen[0] || !seen[1] || first->weights != other_first->weights || first->bias != other_first->bias ||
      second->weights != other_second->weights || second->bias != other_second->bias) {
    return std::nullopt;
  }
  Cbam cbam;
  cbam.hidden = first->out_channels;
  cbam.weights1 = first->weights;
  cbam.bias1 = first->bias;
  cbam.weights2 = second->weights;
  cbam.bias2 = second->bias;
  return cbam;
}

/// Matches `tensor` = gated * sigmoid(conv([mean(gated), max(gated)])).
bool Rewriter::spatial_attention(int tensor, int& gated, Cbam& cbam) {
  if (maker<Multiply>(tensor) == nullptr) {
    return false;
  }
  gated = input(tensor, 0);
  const int map = input(tensor, 1);
  const Convolution* convolution = maker<Convolution>(map);
  if (convolution == nullptr || convolution->activation != Activation::Sigmoid || convolution->out_channels != 1 ||
      convolution->groups != 1 || convolution->stride != 1 || 2 * convolution->padding + 1 != convolution->kernel ||
      maker<Concat>(input(map)) == nullptr || node(input(map)).inputs.size() != 2) {
    return false;
  }
  const ChannelPool* mean = maker<ChannelPool>(input(input(map), 0));
  const ChannelPool* max = maker<ChannelPool>(input(input(map), 1));
  if (mean == nullptr || max == nullptr || mean->reduction != Reduction::Mean || max->reduction != Reduction::Max ||
      input(input(input(map), 0)) != gated || input(input(input(map), 1)) != gated) {
    return false;
  }
  cbam.kernel = convolution->kernel;
  cbam.spatial_weights = convolution->weights;
  cbam.spatial_bias = convolution->bias[0];
  return true;
}

void Rewriter::recognise_attention() {
  for (int tensor = 1; tensor <= static_cast<int>(nodes_.size()); ++tensor) {
    int gated = 0;
    Cbam spatial;
    if (!spatial_attention(tensor, gated, spatial)) {
      continue;
    }
    int x = 0;
    if (std::optional<Cbam> cbam = channel_attention(gated, x)) {
      cbam->kernel = spatial.kernel;
      cbam->spatial_weights = std::move(spatial.spatial_weights);
      cbam->spatial_bias = spatial.spatial_bias;
      node(tensor).operation = std::move(*cbam);
      node(tensor).inputs = {x};
    }
  }
}

void Rewriter::remove_unread() {
  std::vector<bool> needed(nodes_.size() + 1, false);
  for (const int output : outputs_) {
    needed[static_cast<std::size_t>(output)] = true;
  }
  for (std::size_t tensor = nodes_.size(); tensor > 0; --tensor) {
    for (const int read : nodes_[tensor - 1].inputs) {
      needed[static_cast<std::size_t>(read)] = needed[static_cast<std::size_t>(read)] || needed[tensor];
    }
  }
  std::vector<int> number(nodes_.size() + 1, 0);
  std::vector<Node> kept;
  for (std::size_t tensor = 1; tensor <= nodes_.size(); ++tensor) {
    if (needed[tensor]) {
      Node& node = nodes_[tensor - 1];
      for (int& read : node.inputs) {
        read = number[static_cast<std::size_t>(read)];
      }
      kept.push_back(std::move(node));
      number[tensor] = static_cast<int>(kept.size());
    }
  }
  for (int& output : outputs_) {
    output = number[static_cast<std::size_t>(output)];
  }
  nodes_ = std::move(kept);
}

}  // namespace

Result<Network> simplify(const Network& network) {
  Rewriter rewriter(network);
  // What a pass leaves unread would still count as a reader in the next.
  for (void (Rewriter::*const pass)() : {&Rewriter::fold_channel_factors, &Rewriter::recognise_silu, &Rewriter::fuse_activations,
                                         &Rewriter::recognise_space_to_depth, &Rewriter::recognise_attention}) {
    (rewriter.*pass)();
    rewriter.remove_unread();
  }
  // Each of these leaves fewer nodes wherever it changes something.
  const bool changed = rewriter.nodes().size() != network.nodes().size();
  Result<Network> simple = Network::create(network.source(), network.input(), std::move(rewriter.nodes()),
                                           std::move(rewriter.outputs()), network.metadata());
  if (simple && !changed && !network.ranges().empty()) {
    if (const Status set = simple->set_ranges(network.ranges()); !set) {
      return tl::unexpected<Error>(set.error());
    }
  }
  return simple;
}

}  // namespace posed
