// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "camera/distortion.h"
#include "camera/fisheye.h"
#include "camera/lens_family.h"
#include "camera/spline_surface.h"

namespace vlp {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// d(x/z, y/z) / d(x, y, z).
Matrix23 perspective_jacobian(const Eigen::Vector2d& z, double inverse_depth) {
  Matrix23 jacobian;
  jacobian << inverse_depth, 0, -z.x() * inverse_depth, 0, inverse_depth, -z.y() * inverse_depth;
  return jacobian;
}

/// OPENCVn; also PINHOLE, which is OPENCV0.
class Opencv : public LensFamily {
 public:
  explicit Opencv(std::span<const double> distortions)
      : distortions_(static_cast<Eigen::Index>(distortions.size())) {
    std::copy(distortions.begin(), distortions.end(), distortion_.k.begin());
    const double radius = distortion_.compute_max_radius();
    valid_radius_squared_ = radius * radius;
  }
  std::optional<Eigen::Vector2d> project_to_plane(const Eigen::Vector3d& x) const override {
    const Eigen::Vector2d z = x.head<2>() / x.z();
    if (!(x.z() > 0) || !(z.squaredNorm() <= valid_radius_squared_)) return std::nullopt;
    return distortion_(z).distorted;
  }
  Jacobians compute_jacobians(const Eigen::Vector3d& x) const override {
    const double inverse_depth = 1 / x.z();
    const Eigen::Vector2d z = x.head<2>() * inverse_depth;
    return {distortion_(z).d_distorted_d_z * perspective_jacobian(z, inverse_depth),
            distortion_.coefficient_jacobian(z).leftCols(distortions_)};
  }
  std::optional<Ray> unproject_from_plane(const Eigen::Vector2d& plane) const override {
    Eigen::Matrix2d d_plane_d_z;
    const auto z = undistort_newton(plane, d_plane_d_z);
    if (!z) return std::nullopt;
    Ray ray;
    ray.direction << *z, 1;
    ray.d_direction_d_plane << d_plane_d_z.inverse(), 0, 0;
    return ray;
  }

 private:
  std::optional<Eigen::Vector2d> undistort_newton(const Eigen::Vector2d& distorted,
                                                  Eigen::Matrix2d& d_distorted_d_z) const;

  Eigen::Index distortions_;
  Distortion distortion_;
  double valid_radius_squared_;
};

std::optional<Eigen::Vector2d> Opencv::undistort_newton(const Eigen::Vector2d& distorted,
                                                        Eigen::Matrix2d& d_distorted_d_z) const {
  constexpr double searched_radius_squared =
      Distortion::searched_radius * Distortion::searched_radius;
  const double reach_squared = std::min(valid_radius_squared_, searched_radius_squared);
  const double squared_norm = distorted.squaredNorm();
  // An initial point without the radial distortion at the distorted point saves a step. It is used
  // if it lies within the valid radius.
  Eigen::Vector2d z = distorted / distortion_.radial_factor(squared_norm);
  if (squared_norm > reach_squared) {
    z = distorted * (0.9 * std::sqrt(reach_squared / squared_norm));
  } else if (!(z.squaredNorm() <= reach_squared)) {
    z = distorted;
  }
  auto value = distortion_(z);
  Eigen::Vector2d error = value.distorted - distorted;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Eigen::Matrix2d& j = value.d_distorted_d_z;
    const double determinant = j.determinant();
    Eigen::Vector2d step = Eigen::Vector2d(j(0, 1) * error.y() - j(1, 1) * error.x(),
                                           j(1, 0) * error.x() - j(0, 0) * error.y()) /
                           determinant;
    // Newton's method converges quadratically: after a relative step of 1e-7 the error is 1e-14.
    if (step.squaredNorm() <= 1e-14 * (1e-2 + z.squaredNorm())) {
      z += step;
      d_distorted_d_z = j;
      if (!(determinant > 0) || !(z.squaredNorm() <= valid_radius_squared_)) return std::nullopt;
      return z;
    }
    // Halve the step until the error decreases and the point stays where the model is one to one.
    for (int halving = 0;; ++halving, step /= 2) {
      if (halving == 30) return std::nullopt;
      const Eigen::Vector2d next = z + step;
      if (!(next.squaredNorm() <= valid_radius_squared_)) continue;
      const auto next_value = distortion_(next);
      const Eigen::Vector2d next_error = next_value.distorted - distorted;
      if (!(next_error.squaredNorm() < error.squaredNorm())) continue;
      z = next, value = next_value, error = next_error;
      break;
    }
  }
  return std::nullopt;
}

/// Position of a point in the stereographic plane, and its derivative.
struct StereographicPoint {
  explicit StereographicPoint(const Eigen::Vector3d& x)
      : norm(x.norm()), depth(norm + x.z()), plane(x.head<2>() * (2 / depth)) {}
  Matrix23 compute_jacobian(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d d_depth = x / norm + Eigen::Vector3d::UnitZ();
    return 2 / depth * (Matrix23::Identity() - plane / 2 * d_depth.transpose());
  }

  double norm, depth;
  Eigen::Vector2d plane;
};

class Stereographic : public LensFamily {
 public:
  std::optional<Eigen::Vector2d> project_to_plane(const Eigen::Vector3d& x) const override {
    const StereographicPoint at(x);
    if (!(at.depth > 0)) return std::nullopt;
    return at.plane;
  }
  Jacobians compute_jacobians(const Eigen::Vector3d& x) const override {
    return {StereographicPoint(x).compute_jacobian(x), {}};
  }
  std::optional<Ray> unproject_from_plane(const Eigen::Vector2d& plane) const override {
    Ray ray;
    ray.direction << plane, 1 - plane.squaredNorm() / 4;
    if (!ray.direction.allFinite()) return std::nullopt;
    ray.d_direction_d_plane << Eigen::Matrix2d::Identity(), -plane.transpose() / 2;
    return ray;
  }
};

class Splined : public LensFamily {
 public:
  Splined(const SplineGrid& grid, std::span<const double> control_points)
      : surface_(grid, control_points) {}

  std::optional<Eigen::Vector2d> project_to_plane(const Eigen::Vector3d& x) const override {
    const StereographicPoint at(x);
    if (!(at.depth > 0) || !surface_.is_defined_at(at.plane)) return std::nullopt;
    return surface_.distort_point(at.plane);
  }
  Jacobians compute_jacobians(const Eigen::Vector3d& x) const override {
    const StereographicPoint at(x);
    return {surface_(at.plane).d_distorted_d_u * at.compute_jacobian(x), {}};
  }
  std::vector<DistortionDerivative> differentiate_distortions(
      const Eigen::Vector3d& x) const override {
    const SplineSurface::Weights at = surface_.look_up_weights(StereographicPoint(x).plane);
    const SplineGrid& grid = surface_.spline_grid();
    const auto width = static_cast<std::size_t>(grid.order) + 1;
    std::vector<DistortionDerivative> derivatives;
    for (std::size_t j = 0; j < width; ++j) {
      for (std::size_t i = 0; i < width; ++i) {
        const Eigen::Index point = (at.row + static_cast<Eigen::Index>(j)) * grid.nx + at.column +
                                   static_cast<Eigen::Index>(i);
        for (const int axis : {0, 1})
          derivatives.push_back({2 * point + axis, axis, at.x[i] * at.y[j]});
      }
    }
    return derivatives;
  }
  std::optional<Ray> unproject_from_plane(const Eigen::Vector2d& plane) const override {
    Eigen::Matrix2d d_plane_d_u;
    const auto u = surface_.undistort_point(plane, d_plane_d_u);
    if (!u) return std::nullopt;
    const Eigen::Matrix2d d_u_d_plane = d_plane_d_u.inverse();
    std::optional<Ray> ray(std::in_place);
    ray->direction << *u, 1 - u->squaredNorm() / 4;
    ray->d_direction_d_plane << d_u_d_plane, -u->transpose() / 2 * d_u_d_plane;
    return ray;
  }

 private:
  SplineSurface surface_;
};

class OpencvFisheye : public LensFamily {
 public:
  explicit OpencvFisheye(std::span<const double> k)
      : fisheye_{{k[0], k[1], k[2], k[3]}}, angles_(fisheye_) {}
  std::optional<Eigen::Vector2d> project_to_plane(const Eigen::Vector3d& x) const override {
    const double axis_distance = x.head<2>().norm();
    const double angle_rad = std::atan2(axis_distance, x.z());
    if (!x.allFinite() || !(angle_rad <= angles_.max_angle_rad()) ||
        !(axis_distance > 0 || x.z() > 0)) {
      return std::nullopt;
    }
    return x.head<2>() * (fisheye_.radius_from_angle(angle_rad) / std::max(axis_distance, kOnAxis));
  }
  Jacobians compute_jacobians(const Eigen::Vector3d& x) const override;
  std::optional<Ray> unproject_from_plane(const Eigen::Vector2d& plane) const override;

 private:
  /// Distance from the axis below which the direction away from it is not defined.
  static constexpr double kOnAxis = 1e-300;

  Fisheye fisheye_;
  FisheyeAngles angles_;
};

LensFamily::Jacobians OpencvFisheye::compute_jacobians(const Eigen::Vector3d& x) const {
  const Eigen::Vector2d xy = x.head<2>();
  const double axis_distance = xy.norm(), squared_norm = x.squaredNorm();
  const double angle_rad = std::atan2(axis_distance, x.z());
  const double slope = fisheye_.radius_derivative(angle_rad);
  const bool on_axis = axis_distance <= kOnAxis;
  const double scale = on_axis ? 1 / x.z() : fisheye_.radius_from_angle(angle_rad) / axis_distance;
  const Eigen::Vector2d radial_direction =
      on_axis ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(xy / axis_distance);
  Jacobians result;
  result.d_plane_d_point.leftCols<2>() =
      scale * Eigen::Matrix2d::Identity() +
      (slope * x.z() / squared_norm - scale) * radial_direction * radial_direction.transpose();
  result.d_plane_d_point.col(2) = xy * (-slope / squared_norm);
  result.d_plane_d_distortions.resize(2, std::ssize(fisheye_.k));
  double power = angle_rad;
  for (Eigen::Index i = 0; i < result.d_plane_d_distortions.cols(); ++i) {
    power *= angle_rad * angle_rad;
    result.d_plane_d_distortions.col(i) = radial_direction * power;
  }
  return result;
}

std::optional<LensFamily::Ray> OpencvFisheye::unproject_from_plane(
    const Eigen::Vector2d& plane) const {
  const double distance = plane.norm();
  const double angle_rad = angles_(distance);
  if (std::isnan(angle_rad)) return std::nullopt;
  const double sine = std::sin(angle_rad), cosine = std::cos(angle_rad);
  const bool on_axis = distance <= kOnAxis;
  const double inverse = on_axis ? 0 : 1 / distance, across = on_axis ? 1 : sine * inverse;
  const double x = plane.x() * inverse, y = plane.y() * inverse;
  const double by_slope = 1 / fisheye_.radius_derivative(angle_rad),
               more = cosine * by_slope - across;
  std::optional<Ray> ray(std::in_place);
  ray->direction << across * plane, cosine;
  ray->d_direction_d_plane << across + more * x * x, more * x * y,  //
      more * x * y, across + more * y * y,                          //
      -sine * by_slope * x, -sine * by_slope * y;
  return ray;
}

std::shared_ptr<const LensFamily> make_lens_family(LensModel model,
                                                   std::span<const double> distortions) {
  if (is_splined_lens_model(model))
    return std::make_shared<Splined>(spline_grid_of(model), distortions);
  switch (model) {
    case LensModel::stereographic:
      return std::make_shared<Stereographic>();
    case LensModel::fisheye:
      return std::make_shared<OpencvFisheye>(distortions);
    default:
      return std::make_shared<Opencv>(distortions);
  }
}

}  // namespace

Lens::Lens(LensModel model, std::span<const double> parameters) : model_(model) {
  const auto finite = [](double value) { return std::isfinite(value); };
  if (parameters.size() != num_lens_parameters(model)) {
    throw std::invalid_argument(std::string(lens_model_name(model)) + " takes " +
                                std::to_string(num_lens_parameters(model)) + " parameters, not " +
                                std::to_string(parameters.size()));
  }
  if (!std::all_of(parameters.begin(), parameters.end(), finite)) {
    // [FILE-5] `not finite`, `is not positive` | calibration edited, damaged or of another program
    //   | calibrate again
    throw std::invalid_argument("a lens parameter is not finite");
  }
  if (parameters[0] <= 0 || parameters[1] <= 0) {
    throw std::invalid_argument("a focal length is not positive");
  }
  focal_px_ = {parameters[0], parameters[1]};
  center_px_ = {parameters[2], parameters[3]};
  family_ = make_lens_family(model, parameters.subspan(4));
}

std::optional<Eigen::Vector2d> Lens::project_point(const Eigen::Vector3d& x_in_camera) const {
  const auto plane = family_->project_to_plane(x_in_camera);
  if (!plane) return std::nullopt;
  Eigen::Vector2d pixel = focal_px_.cwiseProduct(*plane) + center_px_;
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Lens::Projection> Lens::project_with_jacobians(
    const Eigen::Vector3d& x_in_camera) const {
  const auto pixel = project_point(x_in_camera);
  if (!pixel) return std::nullopt;
  constexpr Eigen::Index core = 4;
  const LensFamily::Jacobians family_jacobians = family_->compute_jacobians(x_in_camera);
  const Eigen::Index distortions = family_jacobians.d_plane_d_distortions.cols();
  Projection result{*pixel, focal_px_.asDiagonal() * family_jacobians.d_plane_d_point, {}};
  result.d_pixel_d_parameters.resize(2, core + distortions);
  result.d_pixel_d_parameters.leftCols<2>() =
      (*pixel - center_px_).cwiseQuotient(focal_px_).asDiagonal();
  result.d_pixel_d_parameters.middleCols<2>(2).setIdentity();
  result.d_pixel_d_parameters.rightCols(distortions) =
      focal_px_.asDiagonal() * family_jacobians.d_plane_d_distortions;
  return result;
}

std::optional<Lens::SparseJacobian> Lens::differentiate_intrinsics(
    const Eigen::Vector3d& x_in_camera) const {
  const auto projection = project_with_jacobians(x_in_camera);
  if (!projection) return std::nullopt;
  constexpr Eigen::Index core = 4;
  const auto& dense = projection->d_pixel_d_parameters;
  const auto sparse = family_->differentiate_distortions(x_in_camera);
  SparseJacobian result{{}, Eigen::Matrix2Xd::Zero(2, dense.cols() + std::ssize(sparse))};
  result.d_pixel.leftCols(dense.cols()) = dense;
  for (Eigen::Index i = 0; i < dense.cols(); ++i) result.parameters.push_back(i);
  for (const auto& [distortion, axis, d_plane] : sparse) {
    result.d_pixel(axis, std::ssize(result.parameters)) = focal_px_[axis] * d_plane;
    result.parameters.push_back(core + distortion);
  }
  return result;
}

std::optional<Lens::Ray> Lens::unproject_pixel(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d plane = (pixel - center_px_).cwiseQuotient(focal_px_);
  if (!plane.allFinite()) return std::nullopt;
  const auto ray = family_->unproject_from_plane(plane);
  if (!ray) return std::nullopt;
  return Ray{ray->direction, ray->d_direction_d_plane * focal_px_.cwiseInverse().asDiagonal()};
}

}  // namespace vlp
