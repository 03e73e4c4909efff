// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/pixel_noise.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "geometry/symmetric.h"
#include "rig/calibration_error.h"

namespace vlp {
namespace {

/// Maximum number of lamps whose errors are unknowns; those of others count as noise.
constexpr std::size_t kMaxLamps = 60;

/// Residuals of a fix without the directions of its states, whitened, and their derivatives with
/// respect to the common errors in their standard deviations.
struct FrameResiduals {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd by_errors;

  double reduced_chi_squared() const {
    return residuals.squaredNorm() / static_cast<double>(residuals.size());
  }
};

/// Standard deviations and columns of the common errors.
class CommonUnknowns {
 public:
  CommonUnknowns(const LampMap& lamps, const Calibration& calibration) {
    if (calibration.rotation_center) {
      const auto zenith = find_parameter_covariance(calibration, kZenithParameter);
      if (zenith) tilt_sd_rad_ = std::sqrt(zenith->trace() / 2);
    }
    for (const Lamp& lamp : lamps.lamps) {
      if (lamp.sd_m && *lamp.sd_m > 0) sds_m_.emplace(lamp.id, *lamp.sd_m);
    }
  }

  /// Returns the residuals of a fix; std::nullopt without redundancy.
  std::optional<FrameResiduals> find_residuals(const Frame& frame, const Fix& fix,
                                               const Positioner& positioner,
                                               double unstated_sigma_px) {
    if (!fix.has_succeeded() || !(fix.redundancy > 0)) return std::nullopt;
    std::vector<Eigen::Index> states;
    for (Eigen::Index i = 0; i < kBodyStates; ++i) {
      if (fix.covariance(i, i) > 0) states.push_back(i);
    }
    const auto rows = 2 * std::ssize(frame.detections);
    Eigen::MatrixXd by_states = Eigen::MatrixXd::Zero(rows, std::ssize(states));
    Eigen::MatrixXd by_errors = Eigen::MatrixXd::Zero(rows, 2 + 3 * Eigen::Index(kMaxLamps));
    Eigen::VectorXd residuals = Eigen::VectorXd::Zero(rows);
    Eigen::Index row = 0;
    for (const Detection& detection : frame.detections) {
      const auto [use, predicted, residual_px] =
          positioner.compute_detection_residual(detection, fix);
      if (use != DetectionUse::used || !predicted.pixel.allFinite()) continue;
      const double weight = 1 / detection.sigma_px.value_or(unstated_sigma_px);
      const Eigen::Matrix<double, 2, kBodyStates> jacobian = weight * predicted.jacobian;
      residuals.segment<2>(row) = weight * residual_px;
      for (std::size_t k = 0; k < states.size(); ++k)
        by_states.block<2, 1>(row, static_cast<Eigen::Index>(k)) = jacobian.col(states[k]);
      by_errors.block<2, 2>(row, 0) = tilt_sd_rad_ * jacobian.middleCols<2>(kBodyRoll);
      if (const auto lamp = find_unknown(detection.lamp))
        by_errors.block<2, 3>(row, lamp->first) = -lamp->second * jacobian.leftCols<3>();
      row += 2;
    }
    if (row <= std::ssize(states)) return std::nullopt;
    const Eigen::HouseholderQR<Eigen::MatrixXd> factors(by_states.topRows(row));
    const Eigen::Index remaining = row - std::ssize(states);
    const auto project = [&](const auto& columns) -> Eigen::MatrixXd {
      return (factors.householderQ().transpose() * columns.topRows(row)).bottomRows(remaining);
    };
    return FrameResiduals{project(residuals), project(by_errors.leftCols(num_columns()))};
  }

  Eigen::Index num_columns() const { return 2 + 3 * std::ssize(columns_); }

 private:
  /// Returns the first column of a lamp's errors and their standard deviation, m.
  std::optional<std::pair<Eigen::Index, double>> find_unknown(int lamp) {
    const auto sd_m = sds_m_.find(lamp);
    if (sd_m == sds_m_.end()) return std::nullopt;
    if (columns_.size() == kMaxLamps && !columns_.contains(lamp)) return std::nullopt;
    return std::pair(columns_.try_emplace(lamp, num_columns()).first->second, sd_m->second);
  }

  double tilt_sd_rad_ = 0;
  std::map<int, double> sds_m_;
  std::map<int, Eigen::Index> columns_;
};

}  // namespace

NoiseScale estimate_noise_scale(std::span<const Frame> frames, std::span<const Fix> fixes,
                                const Positioner& positioner, const LampMap& lamps,
                                const Calibration& calibration, double unstated_sigma_px) {
  constexpr double max_ratio = 25, min_degrees_of_freedom = 6, min_fraction = 0.25;
  constexpr int max_iterations = 200;
  constexpr double tolerance = 1e-6;
  CommonUnknowns unknowns(lamps, calibration);
  std::vector<FrameResiduals> all;
  std::vector<double> reduced;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    auto residuals = unknowns.find_residuals(frames[i], fixes[i], positioner, unstated_sigma_px);
    if (!residuals) continue;
    reduced.push_back(residuals->reduced_chi_squared());
    all.push_back(std::move(*residuals));
  }
  if (all.empty()) return {};
  const double max_reduced = max_ratio * upper_median(reduced);
  const Eigen::Index size = unknowns.num_columns();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  double squares = 0, count = 0;
  for (const FrameResiduals& frame : all) {
    if (frame.reduced_chi_squared() > max_reduced) continue;
    const Eigen::Index columns = frame.by_errors.cols();
    information.topLeftCorner(columns, columns)
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(frame.by_errors.transpose());
    gradient.head(columns) += frame.by_errors.transpose() * frame.residuals;
    squares += frame.residuals.squaredNorm();
    count += static_cast<double>(frame.residuals.size());
  }
  const auto eigen = eigendecompose(information);
  const Eigen::ArrayXd values = eigen.values.array().max(0);
  const Eigen::ArrayXd projections = (eigen.vectors.transpose() * gradient).array().square();
  double variance = squares / count, freedom = count;
  for (int i = 0; i < max_iterations; ++i) {
    const Eigen::ArrayXd sums = values + variance;
    freedom = count - (values / sums).sum();
    const double residual = squares - (projections * (sums + variance) / sums.square()).sum();
    const double next = std::max(residual, 0.0) / freedom;
    const bool has_converged = std::abs(next - variance) <= tolerance * variance;
    variance = next;
    if (has_converged || !(variance > 0)) break;
  }
  if (freedom < min_degrees_of_freedom)
    variance = std::max(variance, min_fraction * squares / count);
  return {std::sqrt(variance), freedom};
}

}  // namespace vlp
