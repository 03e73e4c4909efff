// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp_shape.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string>

#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr double kMinSize_m = 1e-3, kMaxSize_m = 10;
constexpr double kMaxYaw_rad = 6.3;  // a full turn; larger values indicate degrees

/// Lists the names of all shapes, or of those with two sizes.
std::string list_names(bool only_two_sizes) {
  std::string names;
  for (const ShapeTraits& traits : kShapeTraits) {
    if (only_two_sizes && !traits.has_two_sizes) continue;
    names.append(names.empty() ? "" : ", ").append(traits.name);
  }
  return names;
}

}  // namespace

Eigen::Vector3d transform_shape_point_to_world(const LampShape& shape,
                                               const Eigen::Vector3d& center_m,
                                               const Eigen::Vector2d& point) {
  const double cosine = std::cos(shape.yaw_rad), sine = std::sin(shape.yaw_rad);
  const Eigen::Vector2d half_m = *shape.size_m / 2;
  return center_m + point.x() * (half_m.x() * Eigen::Vector3d(cosine, sine, 0)) +
         point.y() * (half_m.y() * Eigen::Vector3d(-sine, cosine, 0));
}

std::vector<Eigen::Vector3d> compute_lamp_outline_points(const LampShape& shape,
                                                         const Eigen::Vector3d& center_m,
                                                         int count) {
  std::vector<Eigen::Vector3d> points_m;
  for (int i = 0; i < count && shape.size_m; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / count;
    Eigen::Vector2d point(std::cos(angle_rad), std::sin(angle_rad));
    if (!get_lamp_shape_traits(shape.kind).is_round) point /= point.cwiseAbs().maxCoeff();
    points_m.push_back(transform_shape_point_to_world(shape, center_m, point));
  }
  return points_m;
}

LampShape read_lamp_shape_from_yaml(YamlMap& map) {
  LampShape shape;
  const auto word = map.find("shape");
  if (word) {
    const std::string name = word->read_text();
    const auto* traits = std::ranges::find(kShapeTraits, name, &ShapeTraits::name);
    if (traits == kShapeTraits.end()) throw word->make_unknown_word_error(list_names(false));
    shape.kind = traits->kind;
  }
  const ShapeTraits& traits = get_lamp_shape_traits(shape.kind);
  const auto diameter = map.find("diameter_m");
  const auto size = map.find("size_m"), yaw = map.find("yaw_rad");
  if (!traits.has_two_sizes) {
    if (size || yaw) {
      const std::string names = list_names(true);
      throw(size ? size : yaw)
          ->make_error("is of a " + names + ": say 'shape: " + names + "', too");
    }
    return diameter ? make_disc_lamp_shape(diameter->read_number({kMinSize_m, kMaxSize_m, "m"}))
                    : shape;
  }
  if (diameter) {
    throw diameter->make_error("is of a disc, and this is a " + std::string(traits.name) +
                               ": it has a size_m");
  }
  const YamlValue sides = map.require("size_m");
  shape.size_m = Eigen::Vector2d(sides.read_numbers(2).data());
  if (yaw) shape.yaw_rad = yaw->read_number({-kMaxYaw_rad, kMaxYaw_rad, "rad"});
  for (const YamlValue& side : sides.read_list()) side.read_number({kMinSize_m, kMaxSize_m, "m"});
  return shape;
}

void emit_yaml_lamp_shape(YAML::Emitter& out, const LampShape& shape) {
  assert(shape.size_m || !get_lamp_shape_traits(shape.kind).has_two_sizes);
  if (!shape.size_m) return;
  const ShapeTraits& traits = get_lamp_shape_traits(shape.kind);
  if (!traits.has_two_sizes) return emit_yaml_number(out, "diameter_m", shape.size_m->x());
  emit_yaml_plain_word(out, "shape", traits.name);
  emit_yaml_numbers(out, "size_m", *shape.size_m);
  emit_yaml_number(out, "yaw_rad", shape.yaw_rad);
}

}  // namespace vlp
