#include "detect/box_decoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace posed {

namespace {

constexpr int kBoxValues = 5;  // x, y, width, height, objectness
/// How far from the cell's middle the centre of an anchor's first and second box may be [cells].
constexpr std::array<float, kMaxBoxesPerAnchor> kCentreReach{1.0F, 2.0F};
constexpr std::array<int, 3> kYoloxStrides{8, 16, 32};
constexpr std::size_t kMaxCandidates = 1000;  // that are compared with each other

float sigmoid(float x) {
  return 1.0F / (1.0F + std::exp(-x));
}

/// The raw value whose sigmoid is `probability`.
float logit(float probability) {
  return std::log(probability / (1.0F - probability));
}

BoundingBox centred_box(float x, float y, float width, float height) {
  return {x - 0.5F * width, y - 0.5F * height, x + 0.5F * width, y + 0.5F * height};
}

bool is_finite(const BoundingBox& box) {
  return std::isfinite(box.x_min) && std::isfinite(box.y_min) && std::isfinite(box.x_max) && std::isfinite(box.y_max);
}

}  // namespace

Result<BoxDecoder> BoxDecoder::create(HeadKind kind, TensorShape input, std::span<const InferenceOutput> outputs,
                                      const NetworkMetadata& metadata, int wanted) {
  BoxDecoder decoder;
  decoder.kind_ = kind;
  decoder.input_ = input;
  decoder.wanted_ = wanted;
  const Status checked = kind == HeadKind::Anchors ? decoder.check_anchors(outputs, metadata) : decoder.check_rows(outputs);
  if (!checked) {
    return tl::unexpected<Error>(checked.error());
  }
  if (wanted < 0 || wanted >= decoder.classes_) {
    return make_error(ErrorCode::BadData,
                      fmt::format("class {} is asked for; the network knows 0 to {}", wanted, decoder.classes_ - 1));
  }
  return decoder;
}

Status BoxDecoder::check_anchors(std::span<const InferenceOutput> outputs, const NetworkMetadata& metadata) {
  if (outputs.empty() || metadata.anchors.size() != outputs.size() || metadata.strides.size() != outputs.size()) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{} outputs, but anchors for {} and strides for {}: the file must have both for each",
                                  outputs.size(), metadata.anchors.size(), metadata.strides.size()));
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::vector<int>& d = outputs[i].dimensions;
    const int stride = metadata.strides[i];
    const int anchors = static_cast<int>(metadata.anchors[i].size());
    const int boxes = anchors * metadata.boxes_per_anchor;
    if (boxes <= 0 || stride <= 0 || d.size() != 4 || d[0] != 1 || d[1] % boxes != 0 || d[1] / boxes <= kBoxValues ||
        d[2] != input_.height / stride || d[3] != input_.width / stride || (i > 0 && d[1] / boxes != classes_ + kBoxValues)) {
      return make_error(
          ErrorCode::BadData,
          fmt::format("output {} has the shape {}, which {} anchors of {} boxes and stride {} of an input {} x {} "
                      "do not explain",
                      i, fmt::join(d, " x "), anchors, metadata.boxes_per_anchor, stride, input_.width, input_.height));
    }
    classes_ = d[1] / boxes - kBoxValues;
  }
  if (metadata.boxes_per_anchor > kMaxBoxesPerAnchor) {
    return make_error(ErrorCode::BadData,
                      fmt::format("{} boxes an anchor; there may be 1 or {}", metadata.boxes_per_anchor, kMaxBoxesPerAnchor));
  }
  boxes_per_anchor_ = metadata.boxes_per_anchor;
  strides_ = metadata.strides;
  anchors_ = metadata.anchors;
  return {};
}

Status BoxDecoder::check_rows(std::span<const InferenceOutput> outputs) {
  if (outputs.empty() || outputs[0].dimensions.size() != 3 || outputs[0].dimensions[0] != 1 ||
      outputs[0].dimensions[2] <= kBoxValues) {
    return make_error(ErrorCode::BadData,
                      fmt::format("the first output has the shape {}; needed is 1 x boxes x (5 + classes)",
                                  outputs.empty() ? "of nothing" : fmt::format("{}", fmt::join(outputs[0].dimensions, " x "))));
  }
  classes_ = outputs[0].dimensions[2] - kBoxValues;
  if (kind_ == HeadKind::Yolox) {
    int cells = 0;
    for (const int stride : kYoloxStrides) {
      cells += (input_.width / stride) * (input_.height / stride);
    }
    if (cells != outputs[0].dimensions[1]) {
      return make_error(ErrorCode::BadData, fmt::format("the output has {} boxes; YOLOX of an input {} x {} has {}",
                                                        outputs[0].dimensions[1], input_.width, input_.height, cells));
    }
  }
  return {};
}

void BoxDecoder::decode(std::span<const InferenceOutput> outputs, float score, std::vector<Candidate>& found) const {
  found.clear();
  if (kind_ == HeadKind::Anchors) {
    std::size_t first_place = 0;
    for (std::size_t head = 0; head < outputs.size(); ++head) {
      decode_anchors(outputs[head], head, first_place, score, found);
      first_place += outputs[head].values.size();  // more than it has places
    }
  } else {
    decode_rows(outputs[0], score, found);
  }
  std::erase_if(found, [](const Candidate& c) { return !is_finite(c.detection.box) || c.detection.box.area() <= 0; });
}

void BoxDecoder::decode_anchors(const InferenceOutput& output, std::size_t head, std::size_t first_place, float score,
                                std::vector<Candidate>& found) const {
  const auto width = static_cast<std::size_t>(output.dimensions[3]);
  const std::size_t plane = width * static_cast<std::size_t>(output.dimensions[2]);
  const auto stride = static_cast<float>(strides_[head]);
  const auto per_anchor = static_cast<std::size_t>(boxes_per_anchor_);
  const float raw_score = logit(score);  // the score is at most the objectness: most cells need no sigmoid
  for (std::size_t box = 0; box < anchors_[head].size() * per_anchor; ++box) {
    const Anchor& anchor = anchors_[head][box / per_anchor];
    const float reach = kCentreReach[box % per_anchor];
    const float* const base = output.values.data() + box * static_cast<std::size_t>(kBoxValues + classes_) * plane;
    for (std::size_t cell = 0; cell < plane; ++cell) {
      const auto value = [&](int k) { return base[static_cast<std::size_t>(k) * plane + cell]; };
      if (!(value(4) >= raw_score)) {
        continue;
      }
      const float confidence = sigmoid(value(4)) * (classes_ == 1 ? 1.0F : sigmoid(value(kBoxValues + wanted_)));
      if (confidence < score) {
        continue;
      }
      const float x = reach * (2.0F * sigmoid(value(0)) - 1.0F) + 0.5F + static_cast<float>(cell % width);
      const float y = reach * (2.0F * sigmoid(value(1)) - 1.0F) + 0.5F + static_cast<float>(cell / width);
      const float w = 2.0F * sigmoid(value(2));
      const float h = 2.0F * sigmoid(value(3));
      found.push_back({{centred_box(x * stride, y * stride, w * w * anchor.width, h * h * anchor.height), confidence},
                       first_place + (box / per_anchor) * plane + cell});
    }
  }
}

void BoxDecoder::decode_rows(const InferenceOutput& output, float score, std::vector<Candidate>& found) const {
  const auto boxes = static_cast<std::size_t>(output.dimensions[1]);
  const auto row_size = static_cast<std::size_t>(output.dimensions[2]);
  std::size_t level = 0;
  std::size_t level_begin = 0;
  for (std::size_t i = 0; i < boxes; ++i) {
    const float* const v = output.values.data() + i * row_size;
    if (kind_ == HeadKind::Boxes) {
      const float confidence = v[4] * (classes_ == 1 ? 1.0F : v[kBoxValues + wanted_]);
      if (confidence >= score) {
        found.push_back({{centred_box(v[0], v[1], v[2], v[3]), confidence}, i});
      }
      continue;
    }
    const auto cells = [&] {
      return static_cast<std::size_t>(input_.width / kYoloxStrides[level]) *
             static_cast<std::size_t>(input_.height / kYoloxStrides[level]);
    };
    if (i - level_begin >= cells()) {
      level_begin += cells();
      ++level;
    }
    const float confidence = v[4] * v[kBoxValues + wanted_];
    if (confidence >= score) {
      const auto stride = static_cast<float>(kYoloxStrides[level]);
      const auto width = static_cast<std::size_t>(input_.width / kYoloxStrides[level]);
      const auto column = static_cast<float>((i - level_begin) % width);
      const auto row = static_cast<float>((i - level_begin) / width);
      found.push_back(
          {{centred_box((v[0] + column) * stride, (v[1] + row) * stride, std::exp(v[2]) * stride, std::exp(v[3]) * stride),
            confidence},
           i});
    }
  }
}

void suppress_overlaps(std::vector<Candidate>& found, float iou, std::size_t limit) {
  const auto order = [](const Candidate& c) {
    const BoundingBox& box = c.detection.box;
    return std::make_tuple(-c.detection.score, box.x_min, box.y_min, box.x_max, box.y_max, c.place);
  };
  std::sort(found.begin(), found.end(), [&](const Candidate& a, const Candidate& b) { return order(a) < order(b); });
  found.resize(std::min(found.size(), kMaxCandidates));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size() && kept < limit; ++i) {
    const Candidate candidate = found[i];
    const auto goes_for = [&](const Candidate& c) {
      return c.place != candidate.place && intersection_over_union(c.detection.box, candidate.detection.box) > iou;
    };
    if (std::none_of(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), goes_for)) {
      found[kept++] = candidate;
    }
  }
  found.resize(kept);
}

}  // namespace posed
