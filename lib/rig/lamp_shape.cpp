// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp_shape.h"

#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr Range kLampSize{1e-3, 10, "m"};
constexpr Range kLampYaw{-6.3, 6.3, "rad"};  // a full turn; larger values indicate degrees

constexpr std::array kShapeNames{kShapeTraits[0].name, kShapeTraits[1].name};
static_assert(kShapeNames.size() == kShapeTraits.size());
constexpr Words kShapeWords{kShapeNames, ""};

std::string list_two_sizes() {
  std::string names;
  for (const ShapeTraits& traits : kShapeTraits) {
    if (traits.has_two_sizes) names.append(names.empty() ? "" : ", ").append(traits.name);
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

template <typename Io>
void describe(Io& io, Described<Io, LampShape> shape) {
  io.optional("shape", shape.kind, kShapeWords);
  const ShapeTraits& traits = get_lamp_shape_traits(shape.kind);
  std::optional<double> diameter_m, yaw_rad;
  std::optional<Eigen::Vector2d> size_m;
  if constexpr (!Io::is_reader) {
    assert(shape.size_m || !traits.has_two_sizes);
    if (traits.has_two_sizes) {
      size_m = shape.size_m;
      yaw_rad = shape.yaw_rad;
    } else if (shape.size_m) {
      diameter_m = shape.size_m->x();
    }
  }
  const auto diameter = io.optional("diameter_m", diameter_m, kLampSize);
  const auto size = io.optional("size_m", size_m, kLampSize),
             yaw = io.optional("yaw_rad", yaw_rad, kLampYaw);
  if constexpr (Io::is_reader) {
    if (traits.has_two_sizes) {
      diameter.check(
          false, "is of a disc, and this is a " + std::string(traits.name) + ": it has a size_m");
      if (!size) io.require("size_m");
      shape.size_m = size_m;
      shape.yaw_rad = yaw_rad.value_or(0);
    } else {
      const std::string names = list_two_sizes();
      (size ? size : yaw).check(false, "is of a " + names + ": say 'shape: " + names + "', too");
      if (diameter_m) shape = make_disc_lamp_shape(*diameter_m);
    }
  }
}

template void describe<YamlMap>(YamlMap& io, LampShape& shape);
template void describe<YamlWriter>(YamlWriter& io, const LampShape& shape);

}  // namespace vlp
