// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace vlp {

/// Shape of a lamp: a plane figure with two perpendicular axes, in a horizontal plane.
enum class ShapeKind { disc, rectangle };

/// Properties of a ShapeKind: its name in files, its outline, and its keys in lamps.yaml.
struct ShapeTraits {
  ShapeKind kind;
  /// Name of the shape in lamps.yaml and lights.csv.
  std::string_view name;
  /// True if the outline is the ellipse with these axes; false if it is the box around that
  /// ellipse.
  bool is_round;
  /// True if lamps.yaml has size_m and yaw_rad; false if it has diameter_m, the length of both
  /// axes.
  bool has_two_sizes;
};

/// Properties of all shapes, in the order of ShapeKind.
inline constexpr auto kShapeTraits = std::to_array<ShapeTraits>({
    {ShapeKind::disc, "disc", true, false},
    {ShapeKind::rectangle, "rectangle", false, true},
});
static_assert([] {
  for (std::size_t i = 0; i < kShapeTraits.size(); ++i) {
    if (kShapeTraits[i].kind != static_cast<ShapeKind>(i)) return false;
  }
  return true;
}());

/// Returns the properties of a kind of shapes from kShapeTraits.
inline const ShapeTraits& get_lamp_shape_traits(ShapeKind kind) {
  return kShapeTraits[static_cast<std::size_t>(kind)];
}

/// Shape of a lamp with the lengths of its axes and its yaw.
struct LampShape {
  ShapeKind kind = ShapeKind::disc;
  /// Lengths of the two axes; std::nullopt for a disc of unknown diameter.
  std::optional<Eigen::Vector2d> size_m = {};
  /// Angle from the world's x axis to the first axis, counter-clockwise seen from above.
  double yaw_rad = 0;
};

/// Returns a disc with this diameter, m.
inline LampShape make_disc_lamp_shape(double diameter_m) {
  return {ShapeKind::disc, Eigen::Vector2d::Constant(diameter_m)};
}

/// Converts a point (x, y) of a shape to the world frame, m. The point is in units of the half
/// axes: (1, 0) is the end of the first half axis.
/// @pre The shape has a size.
Eigen::Vector3d transform_shape_point_to_world(const LampShape& shape,
                                               const Eigen::Vector3d& center_m,
                                               const Eigen::Vector2d& point);

/// Computes `count` points of the outline in the world frame, m, counter-clockwise seen from above.
/// Returns none if the size is unknown. The points of a box include its corners if `count` is a
/// multiple of 8.
std::vector<Eigen::Vector3d> compute_lamp_outline_points(const LampShape& shape,
                                                         const Eigen::Vector3d& center_m,
                                                         int count = 16);

}  // namespace vlp
