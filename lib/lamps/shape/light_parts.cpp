// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_parts.h"

#include <algorithm>
#include <utility>

#include "geometry/polygon.h"

namespace vlp {
namespace {

bool contains_point(const Light& light, const Eigen::Vector2d& pixel) {
  if (light.is_glow) {
    return (pixel - light.box_min).minCoeff() > 0 && (light.box_max - pixel).minCoeff() > 0;
  }
  if (!is_light_disc_shaped(light)) return polygon_contains(light.inner_polygon, pixel);
  return (light.pixel - pixel).norm() < light.radius_px;
}

/// Returns true if two blobs may be parts of one light.
bool may_belong_together(const PixelBox& a, const PixelBox& b) {
  const int size = std::max({a.width, a.height, b.width, b.height});
  return 2 * compute_box_gap_px(a, b) < size;
}

/// Returns true if a part is not a piece of a light that an occluder splits.
bool is_whole_light(const LightPart& part) {
  return part.light && !is_light_disc_shaped(*part.light);
}

std::size_t count_points(const LightPart& part) {
  return part.light ? part.light->outline.size() : 0;
}

/// Returns true if a light consists of both parts. Two lamps side by side have more of their points
/// on a circle each than on a common one. `points` is the number of all points.
bool consists_of_two_parts(const Light& whole, const LightPart& a, const LightPart& b,
                           std::size_t points) {
  constexpr double min_fraction = 0.6, min_gain = 1.25, min_joined_fraction = 0.8, max_hidden = 1.5;
  const PixelBox box = enclosing_box(a.box, b.box);
  if (2 * whole.radius_px > max_hidden * std::max(box.width, box.height)) return false;
  const auto on_circle = double(whole.outline.size());
  const auto count_a = double(count_points(a)), count_b = double(count_points(b));
  return on_circle >= min_fraction * double(points) &&
         on_circle >= min_joined_fraction * (count_a + count_b) &&
         on_circle >= min_gain * std::max(count_a, count_b);
}

/// Returns the reason for the lack of a fitted outline.
LightReason find_missing_outline_reason(const LightPart& part, const ImageSize& size) {
  const PixelBox& box = part.box;
  const bool inside =
      box.x > 0 && box.y > 0 && box.end_column() < size.width && box.end_row() < size.height;
  if (!inside) return LightReason::incomplete;
  // Some of the points belong to other objects.
  const bool small = part.outline.size() < 2 * kMinOutlinePoints;
  return small ? LightReason::incomplete : LightReason::wrong_shape;
}

bool do_lights_overlap(const Light& a, const Light& b) {
  if (is_light_disc_shaped(a) && is_light_disc_shaped(b)) {
    return (a.pixel - b.pixel).norm() < std::max(a.radius_px, b.radius_px);
  }
  return contains_point(a, b.pixel) || contains_point(b, a.pixel);
}

/// Removes lights that overlap one with more outline points, because they are pieces of it.
std::vector<Light> remove_lights_overlapping_larger_ones(std::vector<Light> found) {
  std::stable_sort(found.begin(), found.end(), [](const Light& a, const Light& b) {
    return a.outline.size() > b.outline.size();
  });
  std::vector<Light> lights;
  for (Light& light : found) {
    const bool piece = std::any_of(lights.begin(), lights.end(), [&](const Light& other) {
      return do_lights_overlap(light, other);
    });
    if (!piece) lights.push_back(std::move(light));
  }
  return lights;
}

}  // namespace

std::vector<Light> join_parts_of_one_light(std::vector<LightPart>& parts, const LightShape& shape,
                                           const Background& background) {
  // A lamp has few pieces; an image with thousands of pieces contains other objects.
  constexpr int max_tries = 2000;
  int tries = 0;
  for (std::size_t i = 0; i < parts.size() && tries < max_tries; ++i) {
    for (std::size_t j = i + 1; j < parts.size() && tries < max_tries; ++j) {
      if (is_whole_light(parts[i]) || is_whole_light(parts[j]) ||
          !may_belong_together(parts[i].box, parts[j].box))
        continue;
      ++tries;
      std::vector<EdgePoint> joined_outline = parts[i].outline;
      joined_outline.insert(joined_outline.end(), parts[j].outline.begin(), parts[j].outline.end());
      joined_outline = select_outermost_edge_points(std::move(joined_outline));
      auto joined_light = shape.fit_light_to_outline(joined_outline, background);
      if (!joined_light ||
          !consists_of_two_parts(*joined_light, parts[i], parts[j], joined_outline.size()))
        continue;
      parts[i] = {std::move(joined_light), std::move(joined_outline),
                  enclosing_box(parts[i].box, parts[j].box)};
      parts.erase(parts.begin() + std::ptrdiff_t(j));
      j = i;  // the joined part may have further pieces
    }
  }
  std::vector<Light> found;
  for (LightPart& part : parts) {
    if (part.light) found.push_back(std::move(*part.light));
  }
  std::erase_if(parts, [](const LightPart& part) { return part.light.has_value(); });
  return remove_lights_overlapping_larger_ones(std::move(found));
}

std::vector<Light> make_lights_without_outline(std::vector<LightPart> parts,
                                               const std::vector<Light>& lights,
                                               const LightShape& shape, const ImageSize& size) {
  constexpr int min_px = 5;
  std::vector<Light> found;
  for (LightPart& part : parts) {
    const PixelBox& box = part.box;
    if (std::min(box.width, box.height) < min_px) continue;
    Light light{};
    light.kind = LightKind::no_outline;
    light.reason = find_missing_outline_reason(part, size);
    light.box_min = shape.swap_image_and_scanline_axes({box.x - 0.5, box.y - 0.5});
    light.box_max =
        shape.swap_image_and_scanline_axes({box.end_column() - 0.5, box.end_row() - 0.5});
    light.pixel = (light.box_min + light.box_max) / 2;
    light.radius_px = (light.box_max - light.box_min).mean() / 2;
    const bool inside = std::any_of(lights.begin(), lights.end(), [&](const Light& other) {
      return contains_point(other, light.pixel);
    });
    if (inside) continue;
    light.outline = std::move(part.outline);
    found.push_back(std::move(light));
  }
  return found;
}

}  // namespace vlp
