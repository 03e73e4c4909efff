// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/correlated_errors.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/symmetric.h"
#include "rig/calibration_error.h"

namespace vlp {
namespace {

/// Returns the derivatives of the rotation by the two coordinates of an error.
template <typename With>
void add_derivatives(std::vector<Eigen::Matrix3d>& turns, const Calibration& calibration,
                     Correction correction, With with_error) {
  constexpr double step = 1e-5;  // central differences have errors of second order: 1e-10
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d error = step * Eigen::Vector2d::Unit(axis);
    const Calibration less = with_error(calibration, -error), more = with_error(calibration, error);
    turns.emplace_back((compute_level_from_camera_matrix(more, correction) -
                        compute_level_from_camera_matrix(less, correction)) /
                       (2 * step));
  }
}

/// Returns the reduction of a covariance if the errors of these rows become known:
///   S_:P S_PP^-1 S_P:
/// Directions in which S_PP has only rounding errors contribute zero.
Eigen::MatrixXd compute_posterior(const Eigen::MatrixXd& covariance, Eigen::Index first,
                                  Eigen::Index size) {
  if (size == 0) return Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  if (first + size == covariance.rows()) return covariance;  // the last rows own the remainder
  const Eigen::MatrixXd columns = covariance.middleCols(first, size);
  const Eigen::VectorXd sd = columns.middleRows(first, size).diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse_sd =
      (sd.array() > 0).select(sd.cwiseInverse(), Eigen::VectorXd::Zero(size));
  const Eigen::MatrixXd scaled = columns * inverse_sd.asDiagonal();
  const auto eigen =
      eigendecompose(Eigen::MatrixXd(inverse_sd.asDiagonal() * scaled.middleRows(first, size)));
  constexpr double rounding = 1e-12;
  const Eigen::ArrayXd values = eigen.values;
  const Eigen::VectorXd whitening =
      (values > rounding * static_cast<double>(size))
          .select(values.max(1e-300).rsqrt(), Eigen::ArrayXd::Zero(size));
  Eigen::MatrixXd root = scaled * eigen.vectors;
  root *= whitening.asDiagonal();
  Eigen::MatrixXd known = root * root.transpose();
  known.middleRows(first, size) = columns.transpose();
  known.middleCols(first, size) = columns;
  return known;
}

}  // namespace

CommonErrors::CommonErrors(std::span<const Lamp> lamps, const Calibration& calibration,
                           Correction correction)
    : intrinsics_(count_intrinsics(calibration.camera)),
      base_from_camera_(compute_level_from_camera_matrix(calibration, correction)),
      camera_from_base_(base_from_camera_.inverse()) {
  const bool turned = calibration.rotation_center &&
                      (correction == Correction::rotation || correction == Correction::all);
  const bool shifted = calibration.dispersion &&
                       (correction == Correction::dispersion || correction == Correction::all);
  if (turned) add_derivatives(rotation_derivatives_, calibration, correction, add_zenith_error);
  if (shifted) add_derivatives(rotation_derivatives_, calibration, correction, add_offset_error);
  offset_ = intrinsics_ + (turned ? 2 : 0);
  const JointCovariance none, &joint = calibration.covariance ? *calibration.covariance : none;
  const std::vector<Eigen::Index> rows = assign_rows(lamps, joint);
  const auto is_known = [&](Eigen::Index row) { return rows[static_cast<std::size_t>(row)] >= 0; };
  const Eigen::Index size = std::ssize(rows);
  covariance_ = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index k = 0; is_known(i) && k < size; ++k) {
      if (is_known(k)) {
        covariance_(i, k) =
            joint.matrix(rows[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(k)]);
      }
    }
  }
  if (turned && shifted && !is_known(offset_)) {
    // An offset without a covariance compensates the error of the zenith.
    covariance_.middleRows<2>(offset_) = -covariance_.middleRows<2>(intrinsics_);
    covariance_.middleCols<2>(offset_) = -covariance_.middleCols<2>(intrinsics_);
  }
  // Steps that were calibrated with the lens compensate its errors in part: without their joint
  // covariance these would count twice.
  const auto& report = calibration.intrinsics_report;
  const bool is_lens_alone = !turned && !shifted && report && report->covariance;
  if (is_lens_alone && !is_known(0))
    covariance_.topLeftCorner(intrinsics_, intrinsics_) = *report->covariance;
  const bool is_adjusted = calibration.adjustment.has_value();
  if (!is_adjusted) num_lamps_moved_since_calibration_ = 0;
  part_stated_ = {is_adjusted || is_lens_alone || is_known(0),
                  is_adjusted || (turned && is_known(intrinsics_)), !shifted || is_known(offset_),
                  std::ranges::all_of(lamps_, &LampErrors::is_known)};
  complete_ = part_stated_[0] && part_stated_[1] && part_stated_[3];
  stated_ =
      is_adjusted || covariance_.diagonal().maxCoeff() > 0 ||
      std::ranges::any_of(lamps_, [](const LampErrors& lamp) { return lamp.variance_m2 > 0; });
}

std::vector<Eigen::Index> CommonErrors::assign_rows(std::span<const Lamp> lamps,
                                                    const JointCovariance& joint) {
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(num_shared_errors()), -1);
  const auto set_rows = [&](Eigen::Index first, Eigen::Index size, std::string_view parameter) {
    const auto row = joint.find_row(parameter);
    for (Eigen::Index i = 0; row && i < size; ++i)
      rows[static_cast<std::size_t>(first + i)] = *row + i;
  };
  set_rows(0, intrinsics_, "fx");
  if (has_zenith_uncertainty()) set_rows(intrinsics_, 2, kZenithParameter);
  if (has_offset_errors()) set_rows(offset_, 2, kOffsetParameter);
  for (const Lamp& lamp : lamps) {
    LampErrors& errors = lamps_.emplace_back(
        LampErrors{{}, std::pow(lamp.sd_m.value_or(0), 2), lamp.sd_m.has_value()});
    if (const auto row = joint.find_lamp_row(lamp.id, lamp.position_m)) {
      errors = {std::ssize(rows), 0, true};
      for (Eigen::Index k = 0; k < 3; ++k) rows.push_back(*row + k);
    } else if (std::ranges::count(joint.lamps, lamp.id, &JointCovariance::LampPosition::id) > 0) {
      ++num_lamps_moved_since_calibration_;
    }
  }
  return rows;
}

Eigen::Matrix3d CommonErrors::lamp_covariance(std::size_t lamp) const {
  const LampErrors& errors = lamps_[lamp];
  if (!errors.row) return errors.variance_m2 * Eigen::Matrix3d::Identity();
  return covariance_.block<3, 3>(*errors.row, *errors.row);
}

Eigen::Matrix3d CommonErrors::lamp_cross_covariance(std::size_t lamp, std::size_t other) const {
  if (lamp == other) return lamp_covariance(lamp);
  const auto &row = lamps_[lamp].row, &column = lamps_[other].row;
  if (!row || !column) return Eigen::Matrix3d::Zero();
  return covariance_.block<3, 3>(*row, *column);
}

CommonErrors CommonErrors::isolate_error_source(CommonErrorSource part) const {
  const std::array<Eigen::Index, kCommonErrorSources.size() + 1> rows{
      0, intrinsics_, offset_, num_shared_errors(), covariance_.rows()};
  CommonErrors one = *this;
  MatrixX remainder = 0.5 * (covariance_ + covariance_.transpose());  // to the last bit
  for (std::size_t i = 0;; ++i) {
    one.covariance_ = compute_posterior(remainder, rows[i], rows[i + 1] - rows[i]);
    if (kCommonErrorSources[i] == part) break;
    remainder -= one.covariance_;
  }
  if (part != CommonErrorSource::lamps) {
    for (LampErrors& lamp : one.lamps_) lamp.variance_m2 = 0;
  }
  one.stated_ =
      one.covariance_.diagonal().maxCoeff() > 0 ||
      std::ranges::any_of(one.lamps_, [](const LampErrors& lamp) { return lamp.variance_m2 > 0; });
  one.complete_ = false;
  return one;
}

CommonErrors::RayJacobian CommonErrors::differentiate_ray(const Eigen::Vector3d& ray_in_base,
                                                          const Lens& lens) const {
  RayJacobian effect = RayJacobian::Zero(3, num_shared_errors());
  const Eigen::Vector3d ray = camera_from_base_ * ray_in_base;
  if (const auto seen = lens.project_with_jacobians(ray)) {
    // For a fixed pixel the ray moves within its plane of z.
    const Eigen::Matrix2d d_ray = -seen->d_pixel_d_point.leftCols<2>().inverse();
    const Eigen::Matrix<double, 3, 2> d_ray_in_base = base_from_camera_.leftCols<2>() * d_ray;
    effect.leftCols(intrinsics_).noalias() = d_ray_in_base * seen->d_pixel_d_parameters;
  }
  for (std::size_t i = 0; i < rotation_derivatives_.size(); ++i) {
    effect.col(intrinsics_ + static_cast<Eigen::Index>(i)) = rotation_derivatives_[i] * ray;
  }
  return effect;
}

CommonErrors::GainMatrix<2> CommonErrors::differentiate_residuals(
    const Observations& observations, std::size_t index,
    const LinearizedObservation& linearized) const {
  const auto& [sightings, lamps, lens, body_from_base, arm_m] = observations;
  const LampObservation& seen = sightings[index];
  const Eigen::Matrix<double, 2, 3> by_ray =
      seen.whitened_pixel_from_ray * body_from_base / seen.depth_axis.dot(seen.ray);
  GainMatrix<2> gain(num_shared_errors());
  gain.jacobian_wrt_shared =
      by_ray.lazyProduct(differentiate_ray(body_from_base.transpose() * seen.ray, lens));
  gain.add(lamps[index], linearized.jacobian.leftCols<3>());
  return gain;
}

template <int States>
CommonErrors::GainMatrix<States> CommonErrors::differentiate_fix(const Observations& observations,
                                                                 const BodyFix& fix) const {
  const EvaluatedState body(fix.state);
  const Eigen::Matrix<double, States, kBodyStates> covariance = fix.covariance.topRows<States>();
  GainMatrix<States> whole(num_shared_errors());
  for (std::size_t i = 0; i < observations.sightings.size(); ++i) {
    const LinearizedObservation seen =
        linearize_observation(observations.sightings[i], body, observations.arm_m);
    const GainMatrix<2> by_errors = differentiate_residuals(observations, i, seen);
    const Eigen::Matrix<double, States, 2> gain = covariance.lazyProduct(seen.jacobian.transpose());
    whole.jacobian_wrt_shared.noalias() += gain.lazyProduct(by_errors.jacobian_wrt_shared);
    whole.add(observations.lamps[i], gain * by_errors.jacobian_wrt_lamp[0]);
  }
  return whole;
}

void CommonErrors::add_covariances(const Observations& observations, const BodyState& state,
                                   std::span<Matrix2> covariances) const {
  const EvaluatedState body(state);
  for (std::size_t i = 0; i < covariances.size(); ++i) {
    const LinearizedObservation seen =
        linearize_observation(observations.sightings[i], body, observations.arm_m);
    covariances[i] = propagate(differentiate_residuals(observations, i, seen));
  }
}

template <int States>
Eigen::Matrix<double, States, States, Eigen::DontAlign> CommonErrors::propagate(
    const GainMatrix<States>& gain) const {
  using SharedGain = typename GainMatrix<States>::SharedGain;
  using LampGain = typename GainMatrix<States>::LampGain;
  using Covariance = Eigen::Matrix<double, States, States>;
  const SharedGain& jacobian_wrt_shared = gain.jacobian_wrt_shared;
  const auto& jacobian_wrt_lamp = gain.jacobian_wrt_lamp;
  const Eigen::Index n = num_shared_errors();
  const SharedGain with_shared = jacobian_wrt_shared.lazyProduct(covariance_.topLeftCorner(n, n));
  Covariance sum = with_shared.lazyProduct(jacobian_wrt_shared.transpose());
  for (std::size_t i = 0; i < gain.size; ++i) {
    // Half of the lamp's own errors, the shared errors, and those of the lamps before it.
    LampGain other = 0.5 * jacobian_wrt_lamp[i] * lamp_covariance(gain.lamps[i]);
    if (const auto& row = lamps_[gain.lamps[i]].row) {
      other += jacobian_wrt_shared.lazyProduct(covariance_.block(0, *row, n, 3));
    }
    for (std::size_t j = 0; j < i; ++j) {
      other += jacobian_wrt_lamp[j] * lamp_cross_covariance(gain.lamps[j], gain.lamps[i]);
    }
    const Covariance half = other * jacobian_wrt_lamp[i].transpose();
    sum += half + half.transpose();
  }
  return sum;
}

double compute_expected_chi_squared(const CommonErrors::Observations& observations,
                                    std::span<const Matrix2> residual_covariances,
                                    const BodyFix& fix, const BodyCovariance& common) {
  using Matrix = Eigen::Matrix<double, kBodyStates, kBodyStates>;
  const EvaluatedState body(fix.state);
  Matrix information = Matrix::Zero();
  double sum = 0;
  for (std::size_t i = 0; i < residual_covariances.size(); ++i) {
    const auto jacobian =
        linearize_observation(observations.sightings[i], body, observations.arm_m).jacobian;
    sum += residual_covariances[i].trace();
    information += jacobian.transpose() * jacobian;
  }
  // States that are not estimated have no variance, and `common` is zero there.
  Matrix covariance = fix.covariance;
  for (int i = 0; i < kBodyStates; ++i) {
    if (!(covariance(i, i) > 0)) covariance(i, i) = 1;
  }
  return sum - ((2 * covariance.inverse() - information) * common).trace();
}

template CommonErrors::GainMatrix<4> CommonErrors::differentiate_fix(
    const Observations& observations, const BodyFix& fix) const;
template CommonErrors::GainMatrix<kBodyStates> CommonErrors::differentiate_fix(
    const Observations& observations, const BodyFix& fix) const;
template Matrix4 CommonErrors::propagate(const GainMatrix<4>& gain) const;
template BodyCovariance CommonErrors::propagate(const GainMatrix<kBodyStates>& gain) const;

}  // namespace vlp
