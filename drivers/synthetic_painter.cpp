#include "drivers/synthetic_painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "drivers/synthetic_hash.h"

namespace posed {

namespace {

int round_up_to_granularity(float texels) {
  const int count = std::max(1, static_cast<int>(std::ceil(texels)));
  return (count + MipTexture::kGranularity - 1) / MipTexture::kGranularity * MipTexture::kGranularity;
}

float channel(PackedBgr c, int shift) {
  return static_cast<float>((c >> shift) & 255U);
}

PackedBgr pack(float b, float g, float r) {
  const auto quantise = [](float value) { return static_cast<PackedBgr>(std::clamp(value + 0.5F, 0.0F, 255.0F)); };
  return quantise(b) | quantise(g) << 8 | quantise(r) << 16;
}

float smooth_step(float x) {
  return x * x * (3.0F - 2.0F * x);
}

float lattice(std::uint32_t seed, int x, int y) {
  return static_cast<float>(hash32(seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)) >> 8) * 0x1p-23F - 1.0F;
}

Eigen::Vector2f rotated_bounds(Eigen::Vector2f half, float angle) {
  const float c = std::abs(std::cos(angle));
  const float s = std::abs(std::sin(angle));
  return {c * half.x() + s * half.y(), s * half.x() + c * half.y()};
}

}  // namespace

TexturePainter::TexturePainter(float width_m, float height_m, float texel_m)
    : width_m_(width_m),
      height_m_(height_m),
      width_(round_up_to_granularity(width_m / texel_m)),
      height_(round_up_to_granularity(height_m / texel_m)),
      texel_m_(width_m / static_cast<float>(width_), height_m / static_cast<float>(height_)),
      texels_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

template <typename Coverage>
void TexturePainter::blend(Eigen::Vector2f low_m, Eigen::Vector2f high_m, Colour colour, Coverage coverage) {
  const int x_begin = std::clamp(static_cast<int>(low_m.x() / texel_m_.x()) - 1, 0, width_);
  const int x_end = std::clamp(static_cast<int>(high_m.x() / texel_m_.x()) + 2, 0, width_);
  const int y_begin = std::clamp(static_cast<int>(low_m.y() / texel_m_.y()) - 1, 0, height_);
  const int y_end = std::clamp(static_cast<int>(high_m.y() / texel_m_.y()) + 2, 0, height_);
  for (int y = y_begin; y < y_end; ++y) {
    PackedBgr* row = texels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = x_begin; x < x_end; ++x) {
      const float alpha = coverage((static_cast<float>(x) + 0.5F) * texel_m_.x(), (static_cast<float>(y) + 0.5F) * texel_m_.y());
      if (alpha > 0) {
        const PackedBgr old = row[x];
        row[x] =
            pack(channel(old, 0) + alpha * (colour.b - channel(old, 0)), channel(old, 8) + alpha * (colour.g - channel(old, 8)),
                 channel(old, 16) + alpha * (colour.r - channel(old, 16)));
      }
    }
  }
}

template <typename Brightness>
void TexturePainter::scale_all(Brightness brightness) {
  for (int y = 0; y < height_; ++y) {
    PackedBgr* row = texels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = 0; x < width_; ++x) {
      const float k = brightness(x, y);
      row[x] = pack(channel(row[x], 0) * k, channel(row[x], 8) * k, channel(row[x], 16) * k);
    }
  }
}

void TexturePainter::fill(Colour colour) {
  std::fill(texels_.begin(), texels_.end(), pack(colour.b, colour.g, colour.r));
}

void TexturePainter::gradient_to(Colour bottom) {
  blend({0, 0}, {width_m_, height_m_}, bottom, [this](float, float y) { return y / height_m_; });
}

void TexturePainter::mottle(std::uint32_t seed, float cell_u_m, float cell_v_m, float amplitude, int octaves) {
  // The lattice's columns are the same for every row: computed once an octave.
  struct Column {
    int cell;
    float weight;
  };
  std::vector<float> noise(texels_.size(), 0.0F);
  std::vector<Column> columns(static_cast<std::size_t>(width_));
  float strength = amplitude;
  float total = 0;
  for (int octave = 0; octave < octaves; ++octave) {
    const std::uint32_t octave_seed = hash32(seed, static_cast<std::uint32_t>(octave));
    const float scale = std::ldexp(1.0F, octave);
    for (int x = 0; x < width_; ++x) {
      const float u = static_cast<float>(x) * texel_m_.x() / cell_u_m * scale;
      columns[static_cast<std::size_t>(x)] = {static_cast<int>(u), smooth_step(u - std::floor(u))};
    }
    std::vector<float> top(static_cast<std::size_t>(columns.back().cell) + 2);
    std::vector<float> bottom(top.size());
    int lattice_row = -1;
    for (int y = 0; y < height_; ++y) {
      const float v = static_cast<float>(y) * texel_m_.y() / cell_v_m * scale;
      const int cell_y = static_cast<int>(v);
      if (cell_y != lattice_row) {
        lattice_row = cell_y;
        for (std::size_t i = 0; i < top.size(); ++i) {
          top[i] = lattice(octave_seed, static_cast<int>(i), cell_y);
          bottom[i] = lattice(octave_seed, static_cast<int>(i), cell_y + 1);
        }
      }
      const float weight_v = smooth_step(v - std::floor(v));
      float* out = noise.data() + static_cast<std::ptrdiff_t>(y) * width_;
      for (std::size_t x = 0; x < columns.size(); ++x) {
        const auto cell = static_cast<std::size_t>(columns[x].cell);
        const float upper = top[cell] + (top[cell + 1] - top[cell]) * columns[x].weight;
        const float lower = bottom[cell] + (bottom[cell + 1] - bottom[cell]) * columns[x].weight;
        out[x] += strength * (upper + (lower - upper) * weight_v);
      }
    }
    total += strength;
    strength *= 0.6F;
  }
  const float normalise = amplitude / total;
  scale_all([&](int x, int y) { return 1.0F + normalise * noise[static_cast<std::size_t>(y * width_ + x)]; });
}

void TexturePainter::rectangle(Eigen::Vector2f centre_m, Eigen::Vector2f half_m, float angle_rad, Colour colour, float opacity) {
  const float c = std::cos(angle_rad);
  const float s = std::sin(angle_rad);
  const float per_texel = 1.0F / texel_m_.x();
  const Eigen::Vector2f bounds = rotated_bounds(half_m, angle_rad);
  blend(centre_m - bounds, centre_m + bounds, colour, [=](float x, float y) {
    const float dx = x - centre_m.x();
    const float dy = y - centre_m.y();
    const float inside_u = std::clamp((half_m.x() - std::abs(c * dx + s * dy)) * per_texel + 0.5F, 0.0F, 1.0F);
    const float inside_v = std::clamp((half_m.y() - std::abs(c * dy - s * dx)) * per_texel + 0.5F, 0.0F, 1.0F);
    return opacity * inside_u * inside_v;
  });
}

void TexturePainter::ellipse(Eigen::Vector2f centre_m, Eigen::Vector2f radii_m, float angle_rad, Colour colour, float opacity) {
  const float c = std::cos(angle_rad);
  const float s = std::sin(angle_rad);
  const float per_texel = radii_m.minCoeff() / texel_m_.x();
  const Eigen::Vector2f bounds = rotated_bounds(radii_m, angle_rad);
  blend(centre_m - bounds, centre_m + bounds, colour, [=](float x, float y) {
    const float dx = x - centre_m.x();
    const float dy = y - centre_m.y();
    const float u = (c * dx + s * dy) / radii_m.x();
    const float v = (c * dy - s * dx) / radii_m.y();
    return opacity * std::clamp((1.0F - std::sqrt(u * u + v * v)) * per_texel + 0.5F, 0.0F, 1.0F);
  });
}

void TexturePainter::triangle(Eigen::Vector2f a_m, Eigen::Vector2f b_m, Eigen::Vector2f c_m, Colour colour, float opacity) {
  const std::array<Eigen::Vector2f, 3> corners{a_m, b_m, c_m};
  std::array<Eigen::Vector3f, 3> edges;  // signed distance to an edge, positive inside: n . p + d
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2f from = corners[i];
    const Eigen::Vector2f along = corners[(i + 1) % 3] - from;
    Eigen::Vector2f normal = Eigen::Vector2f(-along.y(), along.x()) / std::max(along.norm(), 1e-6F);
    if (normal.dot(corners[(i + 2) % 3] - from) < 0) {
      normal = -normal;
    }
    edges[i] = {normal.x(), normal.y(), -normal.dot(from)};
  }
  const float per_texel = 1.0F / texel_m_.x();
  blend(a_m.cwiseMin(b_m).cwiseMin(c_m), a_m.cwiseMax(b_m).cwiseMax(c_m), colour, [=](float x, float y) {
    float alpha = opacity;
    for (const Eigen::Vector3f& edge : edges) {
      alpha *= std::clamp((edge.x() * x + edge.y() * y + edge.z()) * per_texel + 0.5F, 0.0F, 1.0F);
    }
    return alpha;
  });
}

void TexturePainter::shadow(Eigen::Vector2f centre_m, Eigen::Vector2f half_m, float angle_rad, float fade_m, float strength) {
  const float c = std::cos(angle_rad);
  const float s = std::sin(angle_rad);
  const Eigen::Vector2f bounds = rotated_bounds(half_m, angle_rad) + Eigen::Vector2f(2 * fade_m, 2 * fade_m);
  blend(centre_m - bounds, centre_m + bounds, Colour{}, [=](float x, float y) {
    const float dx = x - centre_m.x();
    const float dy = y - centre_m.y();
    const float beyond_u = std::max(std::abs(c * dx + s * dy) - half_m.x(), 0.0F);
    const float beyond_v = std::max(std::abs(c * dy - s * dx) - half_m.y(), 0.0F);
    const float distance = std::sqrt(beyond_u * beyond_u + beyond_v * beyond_v);
    return strength * smooth_step(std::clamp(1.0F - distance / fade_m, 0.0F, 1.0F));
  });
}

void TexturePainter::darken_border(float fade_m, float strength) {
  scale_all([&](int x, int y) {
    const float to_side = std::min(static_cast<float>(x), static_cast<float>(width_ - x)) * texel_m_.x();
    const float to_top = std::min(static_cast<float>(y), static_cast<float>(height_ - y)) * texel_m_.y();
    const float u = std::clamp(1.0F - to_side / fade_m, 0.0F, 1.0F);
    const float v = std::clamp(1.0F - to_top / fade_m, 0.0F, 1.0F);
    return (1.0F - strength * u * u) * (1.0F - strength * v * v);
  });
}

MipTexture TexturePainter::finish() && {
  return {width_m_, height_m_, width_, height_, std::move(texels_)};
}

}  // namespace posed
