// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration_builder.h"

#include <utility>

namespace vlp {
namespace {

void remove_history(Calibration& calibration, const std::string& part) {
  std::erase_if(calibration.history, [&](const HistoryEntry& entry) { return entry.part == part; });
}

void add_history(Calibration& calibration, const std::string& part, HistoryEntry entry) {
  remove_history(calibration, part);
  entry.part = part;
  calibration.history.push_back(std::move(entry));
}

}  // namespace

Calibration make_calibration(Camera camera, std::optional<IntrinsicsReport> report,
                             HistoryEntry entry) {
  Calibration calibration;
  calibration.camera = std::move(camera);
  calibration.intrinsics_report = std::move(report);
  add_history(calibration, "camera", std::move(entry));
  return calibration;
}

Calibration add_rotation_center(Calibration calibration, const RotationCenter& rotation_center,
                                std::optional<JointCovariance> covariance, HistoryEntry entry) {
  calibration = remove_dispersion(std::move(calibration));
  calibration.adjustment.reset();
  remove_history(calibration, "adjustment");
  calibration.rotation_center = rotation_center;
  calibration.covariance = std::move(covariance);
  add_history(calibration, "rotation_center", std::move(entry));
  return calibration;
}

Calibration add_adjustment(Calibration calibration, const RotationCenter& rotation_center,
                           Adjustment adjustment, JointCovariance covariance, HistoryEntry entry) {
  calibration = remove_dispersion(std::move(calibration));
  remove_history(calibration, "rotation_center");
  calibration.rotation_center = rotation_center;
  calibration.adjustment = std::move(adjustment);
  calibration.covariance = std::move(covariance);
  add_history(calibration, "adjustment", std::move(entry));
  return calibration;
}

Calibration extract_geometry(const Calibration& calibration) {
  Calibration geometry;
  geometry.camera = calibration.camera;
  geometry.rotation_center = calibration.rotation_center;
  return geometry;
}

Calibration remove_dispersion(Calibration calibration) {
  calibration.dispersion.reset();
  remove_history(calibration, "dispersion");
  if (auto& joint = calibration.covariance; joint && joint->find_row(kOffsetParameter)) {
    const Eigen::Index offset_row = std::ssize(joint->parameters) - 2;
    Eigen::Index rows = offset_row;
    // append_offset() appends lamps that are independent of all earlier parameters.
    while (!joint->lamps.empty() && joint->matrix.block(rows - 3, 0, 3, rows - 3).isZero(0) &&
           !joint->matrix.block(offset_row, rows - 3, 2, 3).isZero(0)) {
      joint->lamps.pop_back();
      rows -= 3;
    }
    joint->parameters.resize(static_cast<std::size_t>(rows));
    joint->matrix.conservativeResize(rows, rows);
  }
  return calibration;
}

Calibration add_dispersion(Calibration calibration, const Dispersion& dispersion,
                           std::optional<JointCovariance> covariance, HistoryEntry entry) {
  calibration.dispersion = dispersion;
  calibration.covariance = std::move(covariance);
  add_history(calibration, "dispersion", std::move(entry));
  return calibration;
}

}  // namespace vlp
