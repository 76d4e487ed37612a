#include "drivers/synthetic_primitives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace posed {

namespace {

constexpr float kNear_m = 0.05F;
/// Neighbouring faces overlap by this, so that rounding leaves no slit between them.
constexpr float kSeam_m = 1e-4F;
/// Samples along the longer axis of a pixel's footprint on a plane seen at a slant, and the ratio of the axes from which they are
/// taken.
constexpr float kMaxProbes = 2;
constexpr float kProbesFrom = 1.4F;

/// Image bounds of a convex polygon in the camera frame; false where it lies behind the camera.
bool project_bounds(const std::array<Eigen::Vector3f, 4>& corners, const CameraView& camera, PixelBox& bounds) {
  bounds = {1e9F, 1e9F, -1e9F, -1e9F};
  const auto add = [&](const Eigen::Vector3f& p) {
    const float x = camera.fx * p.x() / p.z() + camera.cx;
    const float y = camera.fy * p.y() / p.z() + camera.cy;
    bounds = {std::min(bounds.min_x, x), std::min(bounds.min_y, y), std::max(bounds.max_x, x), std::max(bounds.max_y, y)};
  };
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3f& p = corners[i];
    const Eigen::Vector3f& q = corners[(i + 1) % corners.size()];
    if (p.z() >= kNear_m) {
      add(p);
    }
    if ((p.z() >= kNear_m) != (q.z() >= kNear_m)) {
      add(p + (q - p) * ((kNear_m - p.z()) / (q.z() - p.z())));
    }
  }
  return bounds.max_x >= bounds.min_x;
}

/// The function n . d(x, y) of the ray's direction d.
AffineFunction along_ray(const Eigen::Vector3f& n, const CameraView& camera) {
  const float a = n.x() / camera.fx;
  const float b = n.y() / camera.fy;
  return {a, b, n.z() - a * camera.cx - b * camera.cy};
}

/// Smallest root of |o + t d|^2 = r^2; infinity where there is none ahead.
float meet_sphere(const Eigen::Vector3f& o, const Eigen::Vector3f& d, float dd, float r) {
  const float b = o.dot(d);
  const float discriminant = b * b - dd * (o.squaredNorm() - r * r);
  if (discriminant <= 0) {
    return INFINITY;
  }
  const float t = (-b - std::sqrt(discriminant)) / dd;
  return t > 0 ? t : INFINITY;
}

/// atan2 to 0.005 rad, by a polynomial: a texture needs no more, and the machine's library has no say.
float coarse_atan2(float y, float x) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float ratio = std::min(ax, ay) / std::max({ax, ay, 1e-12F});
  const float square = ratio * ratio;
  float angle = ratio * (0.9953579F + square * (-0.2886790F + square * 0.0793387F));
  if (ay > ax) {
    angle = std::numbers::pi_v<float> / 2 - angle;
  }
  if (x < 0) {
    angle = std::numbers::pi_v<float> - angle;
  }
  return y < 0 ? -angle : angle;
}

/// Bounds of a sphere in the image; the whole image where it reaches the camera's plane.
PixelBox sphere_bounds(const Eigen::Vector3f& c, float r, const CameraView& camera, const PixelBox& image) {
  const float z_near = c.z() - r;
  const float z_far = c.z() + r;
  if (z_near < kNear_m) {
    return image;
  }
  const auto low = [&](float v) { return v - r > 0 ? (v - r) / z_far : (v - r) / z_near; };
  const auto high = [&](float v) { return v + r > 0 ? (v + r) / z_near : (v + r) / z_far; };
  return {camera.fx * low(c.x()) + camera.cx, camera.fy * low(c.y()) + camera.cy, camera.fx * high(c.x()) + camera.cx,
          camera.fy * high(c.y()) + camera.cy};
}

}  // namespace

bool ViewedQuad::view(const TexturedQuad& quad, const MipTexture& texture, const CameraView& camera, const PixelBox& image,
                      ViewedQuad& out) {
  const Eigen::Vector3f corner = camera.to_camera(quad.corner);
  const Eigen::Vector3f normal = camera.R_camera_world * quad.normal();
  const float distance = -normal.dot(corner);
  if (distance < 1e-4F) {
    return false;  // turned away
  }
  const Eigen::Vector3f u = camera.R_camera_world * quad.axis_u;
  const Eigen::Vector3f v = camera.R_camera_world * quad.axis_v;
  const Eigen::Vector3f across = u * quad.length_u_m;
  const Eigen::Vector3f down = v * quad.length_v_m;
  if (!project_bounds({corner, corner + across, corner + across + down, corner + down}, camera, out.bounds) ||
      !out.bounds.overlaps(image)) {
    return false;
  }
  const AffineFunction n = along_ray(normal, camera);
  out.inverse_z = {-n.a / distance, -n.b / distance, -n.c / distance};
  const float scale_u = texture.texels_per_m_u();
  const float scale_v = texture.texels_per_m_v();
  out.u_by_z = along_ray(u * scale_u, camera).minus(out.inverse_z, scale_u * (u.dot(corner) - quad.window_m.x()));
  out.v_by_z = along_ray(v * scale_v, camera).minus(out.inverse_z, scale_v * (v.dot(corner) - quad.window_m.y()));
  out.u_min = scale_u * (quad.window_m.x() - kSeam_m);
  out.u_max = scale_u * (quad.window_m.x() + quad.length_u_m + kSeam_m);
  out.v_min = scale_v * (quad.window_m.y() - kSeam_m);
  out.v_max = scale_v * (quad.window_m.y() + quad.length_v_m + kSeam_m);
  out.texture = &texture;
  out.brightness_q8 = static_cast<std::uint32_t>(quad.brightness * 256.0F);
  return true;
}

ViewedQuad::Overlap ViewedQuad::overlap(const PixelBox& tile) const {
  if (!bounds.overlaps(tile) || inverse_z.max_over(tile) <= 0) {
    return Overlap::None;
  }
  bool full = inverse_z.min_over(tile) > 0;
  for (const AffineFunction& inside : {u_by_z.minus(inverse_z, u_min), v_by_z.minus(inverse_z, v_min)}) {
    if (inside.max_over(tile) < 0) {
      return Overlap::None;
    }
    full = full && inside.min_over(tile) > 0;
  }
  for (const AffineFunction& outside : {u_by_z.minus(inverse_z, u_max), v_by_z.minus(inverse_z, v_max)}) {
    if (outside.min_over(tile) > 0) {
      return Overlap::None;
    }
    full = full && outside.max_over(tile) < 0;
  }
  return full ? Overlap::Full : Overlap::Partial;
}

PackedBgr ViewedQuad::colour(float x, float y, float pixel) const {
  const float z = 1.0F / inverse_z(x, y);
  const float u = u_by_z(x, y) * z;
  const float v = v_by_z(x, y) * z;
  // The pixel's footprint on the texture: the images of one step in x and of one in y (Heckbert, "Survey of texture mapping",
  // 1986).
  const float scale = z * pixel;
  const float ux = (u_by_z.a - u * inverse_z.a) * scale;
  const float vx = (v_by_z.a - v * inverse_z.a) * scale;
  const float uy = (u_by_z.b - u * inverse_z.b) * scale;
  const float vy = (v_by_z.b - v * inverse_z.b) * scale;
  const float x_square = ux * ux + vx * vx;
  const float y_square = uy * uy + vy * vy;
  const float length = std::sqrt(std::max({x_square, y_square, 1e-12F}));
  const float width = std::abs(ux * vy - uy * vx) / length;
  if (length < kProbesFrom * width || pixel < 1.0F) {
    const float footprint = std::max(width, length / kMaxProbes);
    return scaled(texture->sample(std::clamp(u, u_min, u_max), std::clamp(v, v_min, v_max), footprint), brightness_q8);
  }
  // Seen at a slant: two samples along the longer axis, each as wide as half of it.
  const float du = 0.25F * (x_square > y_square ? ux : uy);
  const float dv = 0.25F * (x_square > y_square ? vx : vy);
  const float footprint = std::max(width, length / kMaxProbes);
  const PackedBgr one = texture->sample(std::clamp(u - du, u_min, u_max), std::clamp(v - dv, v_min, v_max), footprint);
  const PackedBgr two = texture->sample(std::clamp(u + du, u_min, u_max), std::clamp(v + dv, v_min, v_max), footprint);
  const PackedBgr mean = ((one & 0x00fefefeU) >> 1) + ((two & 0x00fefefeU) >> 1) + (one & two & 0x00010101U);
  return scaled(mean, brightness_q8);
}

bool ViewedPart::view(const BodyPart& part, const MipTexture& texture, const CameraView& camera, const PixelBox& image,
                      ViewedPart& out) {
  const float reach = part.bounding_radius_m();
  const Eigen::Vector3f base = camera.to_camera(part.base);
  const Eigen::Vector3f tip = camera.to_camera(part.tip());
  if (std::max(base.z(), tip.z()) + reach < kNear_m) {
    return false;
  }
  const PixelBox a = sphere_bounds(base, reach, camera, image);
  const PixelBox b = sphere_bounds(tip, reach, camera, image);
  out.bounds = {std::min(a.min_x, b.min_x), std::min(a.min_y, b.min_y), std::max(a.max_x, b.max_x), std::max(a.max_y, b.max_y)};
  if (!out.bounds.overlaps(image)) {
    return false;
  }
  out.nearest_z = std::max(std::min(base.z(), tip.z()) - reach, kNear_m);
  const Eigen::Vector3f unsqueeze(1 / part.squeeze.x(), 1 / part.squeeze.y(), 1);
  const Eigen::Matrix3f to_local = unsqueeze.asDiagonal() * (camera.R_camera_world * part.R_world_part).transpose();
  out.origin = -(to_local * base);
  out.direction_x = to_local.col(0) / camera.fx;
  out.direction_y = to_local.col(1) / camera.fy;
  out.direction_c = to_local.col(2) - out.direction_x * camera.cx - out.direction_y * camera.cy;
  out.length = part.length_m;
  out.base_radius = part.base_radius_m;
  out.tip_radius = part.tip_radius_m;
  out.slope_sin = (part.base_radius_m - part.tip_radius_m) / part.length_m;
  out.slope_cos = std::sqrt(1 - out.slope_sin * out.slope_sin);
  out.R_world_part = part.R_world_part;
  out.squeeze = part.squeeze;
  out.texels_per_pixel = texture.texels_per_m_u() / camera.fx;
  out.texture = &texture;
  return true;
}

float ViewedPart::meet(float x, float y) const {
  const Eigen::Vector3f d = direction(x, y);
  const float dd = d.squaredNorm();
  // The side is where rho * cos = base_radius - along * sin, rho being the distance to the axis: a quadric in the ray's parameter.
  const float cos_square = slope_cos * slope_cos;
  const float side_o = base_radius - origin.z() * slope_sin;
  const float side_d = d.z() * slope_sin;
  const float a = (d.x() * d.x() + d.y() * d.y()) * cos_square - side_d * side_d;
  const float b = (origin.x() * d.x() + origin.y() * d.y()) * cos_square + side_o * side_d;
  const float c = (origin.x() * origin.x() + origin.y() * origin.y()) * cos_square - side_o * side_o;
  float nearest = INFINITY;
  const float discriminant = b * b - a * c;
  if (discriminant > 0 && std::abs(a) > 1e-9F) {
    const float t = (-b - std::sqrt(discriminant)) / a;
    const Eigen::Vector3f p = origin + t * d;
    // The side ends where the spheres' tangent circles are.
    const float rho_cos = base_radius - p.z() * slope_sin;
    const float along_side = p.z() * slope_cos - rho_cos / slope_cos * slope_sin;
    if (t > 0 && rho_cos > 0 && along_side >= 0 && along_side <= length * slope_cos) {
      nearest = t;
    }
  }
  nearest = std::min(nearest, meet_sphere(origin, d, dd, base_radius));
  nearest = std::min(nearest, meet_sphere(origin - Eigen::Vector3f(0, 0, length), d, dd, tip_radius));
  return nearest < INFINITY ? nearest : 0.0F;
}

PackedBgr ViewedPart::colour(float x, float y, float z, float pixel) const {
  const Eigen::Vector3f d = direction(x, y);
  const Eigen::Vector3f p = origin + z * d;
  const float rho = std::max(std::sqrt(p.x() * p.x() + p.y() * p.y()), 1e-6F);
  const float along_side = p.z() * slope_cos - rho * slope_sin;
  Eigen::Vector3f normal;  // where the squeeze is undone
  if (along_side < 0) {
    normal = p / base_radius;
  } else if (along_side > length * slope_cos) {
    normal = (p - Eigen::Vector3f(0, 0, length)) / tip_radius;
  } else {
    normal = {p.x() / rho * slope_cos, p.y() / rho * slope_cos, slope_sin};
  }
  const Eigen::Vector3f unsqueezed = Eigen::Vector3f(normal.x() / squeeze.x(), normal.y() / squeeze.y(), normal.z()).normalized();
  const float facing = std::max(std::abs(normal.dot(d)) / d.norm(), 0.25F);
  const float u_m = texture->width_m() / 2 + coarse_atan2(p.y(), p.x()) * 0.5F * (base_radius + tip_radius);
  const float v_m = length + tip_radius - p.z();
  const float u = std::clamp(u_m, 0.0F, texture->width_m()) * texture->texels_per_m_u();
  const float v = std::clamp(v_m, 0.0F, texture->height_m()) * texture->texels_per_m_v();
  const float brightness = diffuse_brightness(R_world_part * unsqueezed);
  return scaled(texture->sample(u, v, texels_per_pixel * pixel * z / facing), static_cast<std::uint32_t>(brightness * 256.0F));
}

}  // namespace posed
