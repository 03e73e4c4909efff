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
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Returns the derivatives of the rotation by the two coordinates of an error.
template <typename With>
void add_rotation_derivatives(std::vector<Eigen::Matrix3d>& turns, const Calibration& calibration,
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
Eigen::MatrixXd compute_posterior_covariance(const Eigen::MatrixXd& covariance, Eigen::Index first,
                                             Eigen::Index size) {
  if (size == 0) return Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  if (first + size == covariance.rows()) return covariance;  // the last rows own the remainder
  const Eigen::MatrixXd columns = covariance.middleCols(first, size);
  const Eigen::VectorXd sd = columns.middleRows(first, size).diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse_sd =
      (sd.array() > 0).select(sd.cwiseInverse(), Eigen::VectorXd::Zero(size));
  const Eigen::MatrixXd scaled = columns * inverse_sd.asDiagonal();
  const auto eigen = eigendecompose_symmetric_matrix(
      Eigen::MatrixXd(inverse_sd.asDiagonal() * scaled.middleRows(first, size)));
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

/// Converts a covariance in px^2 to units of the normalized plane.
Eigen::Matrix2d convert_covariance_to_normalized_plane(const std::optional<Matrix2>& covariance_px,
                                                       const Eigen::Vector2d& focal_px) {
  if (!covariance_px) return Eigen::Matrix2d::Zero();
  const Eigen::Vector2d inverse = focal_px.cwiseInverse();
  return inverse.asDiagonal() * *covariance_px * inverse.asDiagonal();
}

/// Returns true if the lamp of a map has this place, to 1 um.
bool is_lamp_at_position(const Lamp& lamp, const Eigen::Vector3d& position_m) {
  constexpr double tolerance_m = 1e-6;
  return (position_m - lamp.position_m).norm() < tolerance_m;
}

/// Returns the place of a lamp in an adjustment or a dispersion; nullptr if it is not in it.
template <typename Place>
const Place* find_lamp_position_by_id(const std::vector<Place>& places, int id) {
  const auto place =
      std::find_if(places.begin(), places.end(), [&](const Place& one) { return one.id == id; });
  return place == places.end() ? nullptr : &*place;
}

}  // namespace

CommonErrors::CommonErrors(std::span<const Lamp> lamps, const Calibration& calibration,
                           Correction correction)
    : intrinsics_(count_intrinsics_with_covariance(calibration.camera)),
      base_from_camera_(compute_level_from_camera_matrix(calibration, correction)),
      camera_from_base_(base_from_camera_.inverse()) {
  const bool turned = calibration.rotation_center &&
                      (correction == Correction::rotation || correction == Correction::all);
  const bool shifted = calibration.dispersion &&
                       (correction == Correction::dispersion || correction == Correction::all);
  if (turned)
    add_rotation_derivatives(rotation_derivatives_, calibration, correction,
                             add_error_to_calibrated_zenith);
  if (shifted)
    add_rotation_derivatives(rotation_derivatives_, calibration, correction,
                             add_error_to_calibrated_dispersion_offset);
  offset_ = intrinsics_ + (turned ? 2 : 0);
  assign_covariance_rows_to_lamps(lamps, calibration);
  set_lens_and_zenith_covariances(calibration);
  set_lamp_covariances(lamps, calibration.adjustment);
  if (turned || shifted) propagate_errors_to_zenith_and_offset(lamps, calibration);
  stated_ =
      calibration.adjustment || covariance_.diagonal().maxCoeff() > 0 ||
      std::ranges::any_of(lamps_, [](const LampErrors& lamp) { return lamp.variance_m2 > 0; });
}

void CommonErrors::assign_covariance_rows_to_lamps(std::span<const Lamp> lamps,
                                                   const Calibration& calibration) {
  const auto is_correlated = [&](const Lamp& lamp) {
    const auto* adjusted = calibration.adjustment
                               ? find_lamp_position_by_id(calibration.adjustment->lamps, lamp.id)
                               : nullptr;
    if (adjusted != nullptr && is_lamp_at_position(lamp, adjusted->position_m)) return true;
    const auto* uncertain =
        has_dispersion_offset_errors()
            ? find_lamp_position_by_id(calibration.dispersion->uncertain_lamps, lamp.id)
            : nullptr;
    return uncertain != nullptr && is_lamp_at_position(lamp, uncertain->position_m);
  };
  lamps_.resize(lamps.size());
  Eigen::Index size = num_shared_errors();
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    if (!is_correlated(lamps[i])) continue;
    lamps_[i].row = size;
    size += 3;
  }
  covariance_ = Eigen::MatrixXd::Zero(size, size);
}

Eigen::Matrix3d CommonErrors::lamp_position_covariance(std::size_t lamp) const {
  const auto& [row, variance_m2] = lamps_[lamp];
  if (!row) return variance_m2 * Eigen::Matrix3d::Identity();
  return covariance_.block<3, 3>(*row, *row);
}

Eigen::Matrix3d CommonErrors::lamp_cross_covariance(std::size_t lamp, std::size_t other) const {
  if (lamp == other) return lamp_position_covariance(lamp);
  const auto &row = lamps_[lamp].row, &column = lamps_[other].row;
  if (!row || !column) return Eigen::Matrix3d::Zero();
  return covariance_.block<3, 3>(*row, *column);
}

void CommonErrors::set_lens_and_zenith_covariances(const Calibration& calibration) {
  const auto& center = calibration.rotation_center;
  const auto& dispersion = calibration.dispersion;
  const auto& adjustment = calibration.adjustment;
  const auto& report = calibration.intrinsics_report;
  // A part that was calibrated with the lens compensates its errors in part: without
  // jacobian_wrt_intrinsics these would count twice.
  const bool lens_counts_once = has_zenith_errors() ? center->jacobian_wrt_intrinsics.has_value()
                                : has_dispersion_offset_errors()
                                    ? dispersion->jacobian_wrt_intrinsics.has_value()
                                    : true;
  const bool lens = report && report->covariance && lens_counts_once;
  const bool zenith_stated = adjustment || (has_zenith_errors() && center->covariance);
  complete_ = adjustment || (lens && zenith_stated);
  part_stated_ = {adjustment || lens, zenith_stated,
                  !has_dispersion_offset_errors() || dispersion->covariance.has_value(), true};
  if (lens && !adjustment) {
    covariance_.topLeftCorner(intrinsics_, intrinsics_) = *report->covariance;
  }
  if (has_zenith_errors() && !adjustment) {
    covariance_.block<2, 2>(intrinsics_, intrinsics_) =
        convert_covariance_to_normalized_plane(center->covariance, calibration.camera.focal_px());
  }
}

void CommonErrors::set_lamp_covariances(std::span<const Lamp> lamps,
                                        const std::optional<Adjustment>& adjustment) {
  // Pairs of a row here and the same row of the adjustment's covariance.
  std::vector<std::pair<Eigen::Index, Eigen::Index>> adjusted;
  if (adjustment) {
    for (Eigen::Index i = 0; i < offset_; ++i) adjusted.emplace_back(i, i);
  }
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const auto& row = lamps_[i].row;
    const auto* place =
        adjustment ? find_lamp_position_by_id(adjustment->lamps, lamps[i].id) : nullptr;
    if (place != nullptr && is_lamp_at_position(lamps[i], place->position_m)) {
      const Eigen::Index from = intrinsics_ + 4 + 3 * (place - adjustment->lamps.data());
      for (Eigen::Index k = 0; k < 3; ++k) adjusted.emplace_back(*row + k, from + k);
      continue;
    }
    if (place != nullptr) ++num_lamps_moved_since_calibration_;
    if (!lamps[i].sd_m) {
      complete_ = part_stated_.back() = false;
      continue;
    }
    const double variance_m2 = *lamps[i].sd_m * *lamps[i].sd_m;
    if (row) {
      covariance_.block<3, 3>(*row, *row) = variance_m2 * Eigen::Matrix3d::Identity();
    } else {
      lamps_[i].variance_m2 = variance_m2;
    }
  }
  for (const auto& [row, from_row] : adjusted) {
    for (const auto& [col, from_col] : adjusted) {
      covariance_(row, col) = adjustment->covariance(from_row, from_col);
    }
  }
}

void CommonErrors::propagate_errors_to_zenith_and_offset(std::span<const Lamp> lamps,
                                                         const Calibration& calibration) {
  const Eigen::Index rows = num_shared_errors() - intrinsics_;
  // Derivatives of zenith and offset by independent errors: lens, the zenith's step, the offset's
  // step, lamps.
  Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(rows, covariance_.cols());
  derivatives.middleCols(intrinsics_, rows).setIdentity();
  if (has_zenith_errors() && !calibration.adjustment &&
      calibration.rotation_center->jacobian_wrt_intrinsics) {
    derivatives.topLeftCorner(2, intrinsics_) =
        *calibration.rotation_center->jacobian_wrt_intrinsics;
  }
  if (has_dispersion_offset_errors()) {
    const Dispersion& dispersion = *calibration.dispersion;
    covariance_.block<2, 2>(offset_, offset_) = convert_covariance_to_normalized_plane(
        dispersion.covariance, calibration.camera.focal_px());
    auto of_offset = derivatives.bottomRows<2>();
    if (dispersion.jacobian_wrt_intrinsics)
      of_offset.leftCols(intrinsics_) = *dispersion.jacobian_wrt_intrinsics;
    for (const Dispersion::UncertainLamp& uncertain : dispersion.uncertain_lamps) {
      if (const auto row = find_covariance_row_of_lamp(lamps, uncertain)) {
        of_offset.middleCols<3>(*row) = uncertain.jacobian_wrt_position;
      } else {
        const Eigen::Matrix<double, 2, 3> move = uncertain.sd_m * uncertain.jacobian_wrt_position;
        covariance_.block<2, 2>(offset_, offset_) += move * move.transpose();
      }
    }
    if (has_zenith_errors()) {
      // The offset compensates the error of the zenith.
      const Eigen::Matrix2d jacobian_wrt_zenith =
          dispersion.jacobian_wrt_zenith ? Eigen::Matrix2d(*dispersion.jacobian_wrt_zenith)
                                         : Eigen::Matrix2d(-Eigen::Matrix2d::Identity());
      of_offset += jacobian_wrt_zenith * Eigen::MatrixXd(derivatives.topRows<2>());
    }
  }
  covariance_.middleRows(intrinsics_, rows) = derivatives * covariance_;
  covariance_.middleCols(intrinsics_, rows) = covariance_ * derivatives.transpose();
}

std::optional<Eigen::Index> CommonErrors::find_covariance_row_of_lamp(
    std::span<const Lamp> lamps, const Dispersion::UncertainLamp& uncertain) const {
  const Lamp* lamp = find_lamp_by_id(lamps, uncertain.id);
  if (lamp == nullptr || !is_lamp_at_position(*lamp, uncertain.position_m)) return std::nullopt;
  const auto row = lamps_[static_cast<std::size_t>(lamp - lamps.data())].row;
  const bool is_stated = lamp->sd_m || covariance_.block<3, 3>(*row, *row).trace() > 0;
  return is_stated ? row : std::nullopt;
}

CommonErrors CommonErrors::isolate_error_source(CommonErrorSource part) const {
  const std::array<Eigen::Index, kCommonErrorSources.size() + 1> rows{
      0, intrinsics_, offset_, num_shared_errors(), covariance_.rows()};
  CommonErrors one = *this;
  MatrixX remainder = 0.5 * (covariance_ + covariance_.transpose());  // to the last bit
  for (std::size_t i = 0;; ++i) {
    one.covariance_ = compute_posterior_covariance(remainder, rows[i], rows[i + 1] - rows[i]);
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

CommonErrors::RayJacobian CommonErrors::compute_ray_jacobian_wrt_errors(
    const Eigen::Vector3d& ray_in_base, const Lens& lens) const {
  RayJacobian effect = RayJacobian::Zero(3, num_shared_errors());
  const Eigen::Vector3d ray = camera_from_base_ * ray_in_base;
  if (const auto seen = lens.project_point_with_jacobians(ray)) {
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

CommonErrors::GainMatrix<2> CommonErrors::compute_residual_gain(
    const Observations& observations, std::size_t index,
    const LinearizedObservation& linearized) const {
  const auto& [sightings, lamps, lens, body_from_base, arm_m] = observations;
  const LampObservation& seen = sightings[index];
  const Eigen::Matrix<double, 2, 3> by_ray =
      seen.whitened_pixel_from_ray * body_from_base / seen.depth_axis.dot(seen.ray);
  GainMatrix<2> gain(num_shared_errors());
  gain.jacobian_wrt_shared = by_ray.lazyProduct(
      compute_ray_jacobian_wrt_errors(body_from_base.transpose() * seen.ray, lens));
  gain.add(lamps[index], linearized.jacobian.leftCols<3>());
  return gain;
}

template <int States>
CommonErrors::GainMatrix<States> CommonErrors::compute_gain_from_errors_to_fix(
    const Observations& observations, const BodyFix& fix) const {
  const EvaluatedState body(fix.state);
  const Eigen::Matrix<double, States, kBodyStates> covariance = fix.covariance.topRows<States>();
  GainMatrix<States> whole(num_shared_errors());
  for (std::size_t i = 0; i < observations.sightings.size(); ++i) {
    const LinearizedObservation seen =
        linearize_observation(observations.sightings[i], body, observations.arm_m);
    const GainMatrix<2> by_errors = compute_residual_gain(observations, i, seen);
    const Eigen::Matrix<double, States, 2> gain = covariance.lazyProduct(seen.jacobian.transpose());
    whole.jacobian_wrt_shared.noalias() += gain.lazyProduct(by_errors.jacobian_wrt_shared);
    whole.add(observations.lamps[i], gain * by_errors.jacobian_wrt_lamp[0]);
  }
  return whole;
}

void CommonErrors::compute_residual_covariances(const Observations& observations,
                                                const BodyState& state,
                                                std::span<Matrix2> covariances) const {
  const EvaluatedState body(state);
  for (std::size_t i = 0; i < covariances.size(); ++i) {
    const LinearizedObservation seen =
        linearize_observation(observations.sightings[i], body, observations.arm_m);
    covariances[i] = propagate_covariance_to_fix(compute_residual_gain(observations, i, seen));
  }
}

template <int States>
Eigen::Matrix<double, States, States, Eigen::DontAlign> CommonErrors::propagate_covariance_to_fix(
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
    LampGain other = 0.5 * jacobian_wrt_lamp[i] * lamp_position_covariance(gain.lamps[i]);
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

double compute_expected_chi_squared_of_common_errors(const CommonErrors::Observations& observations,
                                                     std::span<const Matrix2> residual_covariances,
                                                     const BodyFix& fix,
                                                     const BodyCovariance& common) {
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

template CommonErrors::GainMatrix<4> CommonErrors::compute_gain_from_errors_to_fix(
    const Observations& observations, const BodyFix& fix) const;
template CommonErrors::GainMatrix<kBodyStates> CommonErrors::compute_gain_from_errors_to_fix(
    const Observations& observations, const BodyFix& fix) const;
template Matrix4 CommonErrors::propagate_covariance_to_fix(const GainMatrix<4>& gain) const;
template BodyCovariance CommonErrors::propagate_covariance_to_fix(
    const GainMatrix<kBodyStates>& gain) const;

namespace {

/// Returns true if the calibration reports errors of its lens that `errors` lacks.
bool lacks_lens_covariance(const CommonErrors& errors, const Calibration& calibration) {
  const auto& report = calibration.intrinsics_report;
  return report && report->covariance &&
         !errors.is_error_source_known_or_absent(CommonErrorSource::lens);
}

}  // namespace

std::optional<Matrix2> compute_zenith_covariance(const Calibration& calibration) {
  const CommonErrors errors({}, calibration, Correction::all);
  if (!errors.is_error_source_known_or_absent(CommonErrorSource::zenith) ||
      lacks_lens_covariance(errors, calibration))
    return std::nullopt;
  const Eigen::Index zenith = count_intrinsics_with_covariance(calibration.camera);
  return Matrix2(errors.joint_error_covariance().block<2, 2>(zenith, zenith));
}

std::optional<Matrix2> compute_dispersion_offset_covariance(const Calibration& calibration) {
  const CommonErrors errors({}, calibration, Correction::all);
  if (!errors.is_error_source_known_or_absent(CommonErrorSource::offset) ||
      lacks_lens_covariance(errors, calibration))
    return std::nullopt;
  if (!calibration.adjustment) {
    const Dispersion& dispersion = *calibration.dispersion;
    const auto& report = calibration.intrinsics_report;
    if (report && report->covariance && !dispersion.jacobian_wrt_intrinsics) return std::nullopt;
    const bool turned = calibration.rotation_center.has_value();
    if (turned && !(errors.is_error_source_known_or_absent(CommonErrorSource::zenith) &&
                    dispersion.jacobian_wrt_zenith))
      return std::nullopt;
  }
  const Eigen::Index offset = errors.joint_error_covariance().rows() - 2;
  const Eigen::Vector2d focal_px = calibration.camera.focal_px();
  return Matrix2(focal_px.asDiagonal() *
                 errors.joint_error_covariance().block<2, 2>(offset, offset) *
                 focal_px.asDiagonal());
}

}  // namespace vlp
