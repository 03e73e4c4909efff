// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace vlp {
namespace {

constexpr double kSearchedRadiusSquared = Distortion::searched_radius * Distortion::searched_radius;

/// Nearer to the axis a direction away from it is not defined.
constexpr double kOnAxis = 1e-300;

using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// Where a point lies in the stereographic plane, and its derivative.
struct Stereographic {
  explicit Stereographic(const Eigen::Vector3d& x)
      : norm(x.norm()), depth(norm + x.z()), plane(x.head<2>() * (2 / depth)) {}
  Matrix23 jacobian(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d d_depth = x / norm + Eigen::Vector3d::UnitZ();
    return 2 / depth * (Matrix23::Identity() - plane / 2 * d_depth.transpose());
  }

  double norm, depth;
  Eigen::Vector2d plane;
};

/// d(x/z, y/z) / d(x, y, z).
Matrix23 division_jacobian(const Eigen::Vector2d& z, double inverse_depth) {
  Matrix23 jacobian;
  jacobian << inverse_depth, 0, -z.x() * inverse_depth, 0, inverse_depth, -z.y() * inverse_depth;
  return jacobian;
}

}  // namespace

Lens::Lens(LensModel model, std::span<const double> parameters) : model_(model) {
  const auto finite = [](double value) { return std::isfinite(value); };
  if (parameters.size() != parameter_count(model)) {
    throw std::invalid_argument(std::string(name_of(model)) + " takes " +
                                std::to_string(parameter_count(model)) + " parameters, not " +
                                std::to_string(parameters.size()));
  }
  if (!std::all_of(parameters.begin(), parameters.end(), finite)) {
    throw std::invalid_argument("a lens parameter is not finite");
  }
  if (parameters[0] <= 0 || parameters[1] <= 0) {
    throw std::invalid_argument("a focal length is not positive");
  }
  focal_px_ = {parameters[0], parameters[1]};
  center_px_ = {parameters[2], parameters[3]};
  if (is_splined(model)) {
    spline_ = std::make_shared<const SplineSurface>(grid_of(model), parameters.subspan(4));
  } else if (model == LensModel::fisheye) {
    std::copy(parameters.begin() + 4, parameters.end(), fisheye_.k.begin());
  } else {
    std::copy(parameters.begin() + 4, parameters.end(), distortion_.k.begin());
  }
  valid_angle_rad_ = model == LensModel::fisheye ? fisheye_.valid_angle_rad() : 0;
  const double radius = distortion_.valid_radius();
  valid_radius_squared_ = radius * radius;
}

std::optional<Eigen::Vector2d> Lens::project(const Eigen::Vector3d& x_in_camera) const {
  Eigen::Vector2d plane;
  if (model_ == LensModel::stereographic) {
    const double depth = x_in_camera.norm() + x_in_camera.z();
    if (!(depth > 0)) return std::nullopt;
    plane = x_in_camera.head<2>() * (2 / depth);
  } else if (model_ == LensModel::fisheye) {
    const double beside = x_in_camera.head<2>().norm();
    const double angle_rad = std::atan2(beside, x_in_camera.z());
    if (!x_in_camera.allFinite() || !(angle_rad <= valid_angle_rad_) ||
        !(beside > 0 || x_in_camera.z() > 0)) {
      return std::nullopt;
    }
    plane = x_in_camera.head<2>() * (fisheye_.distance(angle_rad) / std::max(beside, kOnAxis));
  } else if (spline_) {
    const Stereographic at(x_in_camera);
    if (!(at.depth > 0) || !spline_->covers(at.plane)) return std::nullopt;
    plane = spline_->distorted(at.plane);
  } else {
    const Eigen::Vector2d z = x_in_camera.head<2>() / x_in_camera.z();
    if (!(x_in_camera.z() > 0) || !(z.squaredNorm() <= valid_radius_squared_)) return std::nullopt;
    plane = model_ == LensModel::pinhole ? z : distortion_(z).distorted;
  }
  Eigen::Vector2d pixel = focal_px_.cwiseProduct(plane) + center_px_;
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Lens::Projection> Lens::project_with_jacobians(
    const Eigen::Vector3d& x_in_camera) const {
  const auto pixel = project(x_in_camera);
  if (!pixel) return std::nullopt;
  constexpr Eigen::Index core = 4;
  const Eigen::Index columns = spline_ ? core : static_cast<Eigen::Index>(parameter_count(model_));
  Projection result{*pixel, {}, {}};
  result.d_pixel_d_parameters.resize(2, columns);
  result.d_pixel_d_parameters.leftCols<2>() =
      (*pixel - center_px_).cwiseQuotient(focal_px_).asDiagonal();
  result.d_pixel_d_parameters.middleCols<2>(2).setIdentity();
  if (model_ == LensModel::stereographic) {
    result.d_pixel_d_point = Stereographic(x_in_camera).jacobian(x_in_camera);
  } else if (spline_) {
    const Stereographic at(x_in_camera);
    result.d_pixel_d_point = (*spline_)(at.plane).d_distorted_d_u * at.jacobian(x_in_camera);
  } else if (model_ == LensModel::fisheye) {
    const Eigen::Vector2d xy = x_in_camera.head<2>();
    const double beside = xy.norm(), squared_norm = x_in_camera.squaredNorm();
    const double angle_rad = std::atan2(beside, x_in_camera.z());
    const double slope = fisheye_.slope(angle_rad);
    const bool on_axis = beside <= kOnAxis;
    const double scale = on_axis ? 1 / x_in_camera.z() : fisheye_.distance(angle_rad) / beside;
    const Eigen::Vector2d way = on_axis ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(xy / beside);
    result.d_pixel_d_point.leftCols<2>() =
        scale * Eigen::Matrix2d::Identity() +
        (slope * x_in_camera.z() / squared_norm - scale) * way * way.transpose();
    result.d_pixel_d_point.col(2) = xy * (-slope / squared_norm);
    double power = angle_rad;
    for (int i = 0; i < 4; ++i) {
      power *= angle_rad * angle_rad;
      result.d_pixel_d_parameters.col(4 + i) = focal_px_.cwiseProduct(way) * power;
    }
  } else {
    const double inverse_depth = 1 / x_in_camera.z();
    const Eigen::Vector2d z = x_in_camera.head<2>() * inverse_depth;
    result.d_pixel_d_point = distortion_(z).d_distorted_d_z * division_jacobian(z, inverse_depth);
    result.d_pixel_d_parameters.rightCols(columns - 4) =
        focal_px_.asDiagonal() * distortion_.coefficient_jacobian(z).leftCols(columns - core);
  }
  result.d_pixel_d_point = focal_px_.asDiagonal() * result.d_pixel_d_point.eval();
  return result;
}

std::optional<Lens::ByParameters> Lens::by_parameters(const Eigen::Vector3d& x_in_camera) const {
  const auto projection = project_with_jacobians(x_in_camera);
  if (!projection) return std::nullopt;
  ByParameters result;
  result.d_pixel = projection->d_pixel_d_parameters;
  const Eigen::Index core = result.d_pixel.cols();
  for (Eigen::Index i = 0; i < core; ++i) result.parameters.push_back(i);
  if (!spline_) return result;
  const SplineSurface::Weights at = spline_->weights(Stereographic(x_in_camera).plane);
  const SplineGrid& grid = spline_->grid();
  const auto width = static_cast<std::size_t>(grid.order) + 1;
  result.d_pixel.conservativeResize(2, core + 2 * static_cast<Eigen::Index>(width * width));
  result.d_pixel.rightCols(result.d_pixel.cols() - core).setZero();
  for (std::size_t j = 0; j < width; ++j) {
    for (std::size_t i = 0; i < width; ++i) {
      const Eigen::Index point = (at.row + static_cast<Eigen::Index>(j)) * grid.nx + at.column +
                                 static_cast<Eigen::Index>(i);
      for (Eigen::Index k = 0; k < 2; ++k) {
        result.d_pixel(k, std::ssize(result.parameters)) = focal_px_[k] * at.x[i] * at.y[j];
        result.parameters.push_back(core + 2 * point + k);
      }
    }
  }
  return result;
}

std::optional<Eigen::Vector2d> Lens::undistort(const Eigen::Vector2d& distorted,
                                               Eigen::Matrix2d& d_distorted_d_z) const {
  const double reach_squared = std::min(valid_radius_squared_, kSearchedRadiusSquared);
  const double squared_norm = distorted.squaredNorm();
  // Undoing the radial part where the pixel is saves a step, if that stays within reach.
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
    // Newton squares the error: after a step of 1e-7 of the radius 1e-14 of it is left.
    if (step.squaredNorm() <= 1e-14 * (1e-2 + z.squaredNorm())) {
      z += step;
      d_distorted_d_z = j;
      if (!(determinant > 0) || !(z.squaredNorm() <= valid_radius_squared_)) return std::nullopt;
      return z;
    }
    // Halved until it helps and stays where the model is one to one.
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

std::optional<Lens::Ray> Lens::unproject_fisheye(const Eigen::Vector2d& plane) const {
  const double distance = plane.norm();
  const auto angle_rad = fisheye_.angle_rad(distance, valid_angle_rad_);
  if (!angle_rad) return std::nullopt;
  const double sine = std::sin(*angle_rad), cosine = std::cos(*angle_rad);
  const bool on_axis = distance <= kOnAxis;
  const Eigen::Vector2d way = on_axis ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(plane / distance);
  const double across = on_axis ? 1 : sine / distance;
  Ray ray;
  ray.direction << across * plane, cosine;
  const double slope = fisheye_.slope(*angle_rad);
  ray.d_direction_d_pixel.topRows<2>() =
      across * Eigen::Matrix2d::Identity() + (cosine / slope - across) * way * way.transpose();
  ray.d_direction_d_pixel.row(2) = -sine / slope * way.transpose();
  ray.d_direction_d_pixel *= focal_px_.cwiseInverse().asDiagonal();
  return ray;
}

std::optional<Lens::Ray> Lens::unproject_splined(const Eigen::Vector2d& plane) const {
  Eigen::Matrix2d d_plane_d_u;
  const auto u = spline_->undistorted(plane, d_plane_d_u);
  if (!u) return std::nullopt;
  const Eigen::Matrix2d d_u_d_pixel = d_plane_d_u.inverse() * focal_px_.cwiseInverse().asDiagonal();
  Ray ray;
  ray.direction << *u, 1 - u->squaredNorm() / 4;
  ray.d_direction_d_pixel << d_u_d_pixel, -u->transpose() / 2 * d_u_d_pixel;
  return ray;
}

std::optional<Lens::Ray> Lens::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d plane = (pixel - center_px_).cwiseQuotient(focal_px_);
  if (!plane.allFinite()) return std::nullopt;
  const Eigen::Matrix2d d_plane_d_pixel = focal_px_.cwiseInverse().asDiagonal();
  Ray ray;
  if (model_ == LensModel::stereographic) {
    ray.direction << plane, 1 - plane.squaredNorm() / 4;
    if (!ray.direction.allFinite()) return std::nullopt;
    ray.d_direction_d_pixel << d_plane_d_pixel, -plane.transpose() / 2 * d_plane_d_pixel;
    return ray;
  }
  if (model_ == LensModel::fisheye) return unproject_fisheye(plane);
  if (spline_) return unproject_splined(plane);
  if (model_ == LensModel::pinhole) {
    ray.direction << plane, 1;
    ray.d_direction_d_pixel << d_plane_d_pixel, 0, 0;
    return ray;
  }
  Eigen::Matrix2d d_plane_d_z;
  const auto z = undistort(plane, d_plane_d_z);
  if (!z) return std::nullopt;
  ray.direction << *z, 1;
  ray.d_direction_d_pixel << d_plane_d_z.inverse() * d_plane_d_pixel, 0, 0;
  return ray;
}

}  // namespace vlp
