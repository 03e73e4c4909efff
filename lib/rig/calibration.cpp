// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration.h"

#include <cmath>
#include <limits>

#include "rig/yaml_parts.h"

namespace vlp {
namespace {

constexpr int kLarge = std::numeric_limits<int>::max();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

IntrinsicsReport read_intrinsics_report(YamlMap map) {
  IntrinsicsReport report;
  report.views = map.required("views").integer_within(0, kLarge);
  report.corners = map.required("corners").integer_within(0, kLarge);
  report.outliers = map.required("outliers").integer_within(0, kLarge);
  report.rms_px = map.required("rms_px").number_within(0, kInfinity, "px");
  if (const auto value = map.optional("board_warp_m")) {
    const auto warp = value->numbers(2);
    report.board_warp_m = {warp[0], warp[1]};
  }
  if (const auto value = map.optional("uncertainty_px")) {
    report.uncertainty_px = value->number_within(0, kInfinity, "px");
  }
  map.finish();
  return report;
}

Matrix2 read_covariance(const YamlValue& value) {
  const auto rows = value.list();
  if (rows.size() != 2) throw value.error("should be two rows of two numbers");
  Matrix2 covariance;
  for (int row = 0; row < 2; ++row) {
    covariance.row(row) = Eigen::RowVector2d(rows[static_cast<std::size_t>(row)].numbers(2).data());
  }
  const double product = covariance(0, 0) * covariance(1, 1);
  constexpr double rounding = 1e-12;  // of a full correlation
  if (covariance(0, 1) != covariance(1, 0) || covariance(0, 0) < 0 || covariance(1, 1) < 0 ||
      covariance(0, 1) * covariance(0, 1) > product * (1 + rounding)) {
    throw value.error("is not a covariance: it should be symmetric and not negative");
  }
  return covariance;
}

RotationCenter read_rotation_center(YamlMap map) {
  RotationCenter center;
  const YamlValue model = map.required("model");
  if (model.text() != "shift" && model.text() != "tilt") {
    throw model.unknown("the models are: shift, tilt");
  }
  center.model = model.text() == "tilt" ? RotationModel::tilt : RotationModel::shift;
  center.center_px = Eigen::Vector2d(map.required("center_px").numbers(2).data());
  const YamlValue zenith = map.required("zenith_in_camera");
  center.zenith_in_camera = Eigen::Vector3d(zenith.numbers(3).data());
  // Six digits, as a person would type them, are enough.
  if (std::abs(center.zenith_in_camera.norm() - 1) > 1e-5 || center.zenith_in_camera.z() <= 0) {
    throw zenith.error("should be a unit vector with z > 0");
  }
  if (const auto value = map.optional("covariance")) center.covariance = read_covariance(*value);
  if (const auto value = map.optional("lever_arm_m")) {
    center.lever_arm_m = Eigen::Vector2d(value->numbers(2).data());
  }
  if (const auto value = map.optional("lever_arm_covariance")) {
    if (!center.lever_arm_m) throw value->error("is of no lever_arm_m");
    center.lever_arm_covariance = read_covariance(*value);
  }
  map.finish();
  return center;
}

Dispersion read_dispersion(YamlMap map) {
  Dispersion dispersion;
  dispersion.offset_px = Eigen::Vector2d(map.required("offset_px").numbers(2).data());
  dispersion.radius_m = map.required("radius_m").number_within(0, kInfinity, "m");
  dispersion.center_m = Eigen::Vector2d(map.required("center_m").numbers(2).data());
  dispersion.captures = map.required("captures").integer_within(1, kLarge);
  if (const auto value = map.optional("covariance")) {
    dispersion.covariance = read_covariance(*value);
  }
  map.finish();
  return dispersion;
}

HistoryEntry read_history_entry(YamlMap map) {
  HistoryEntry entry;
  entry.part = map.required("part").text();
  entry.program = map.required("program").text();
  entry.version = map.required("version").text();
  entry.options = map.required("options").text();
  for (const YamlValue& item : map.required("inputs").list()) {
    YamlMap input = item.map();
    entry.inputs.push_back({input.required("file").text(), input.required("sha256").text()});
    input.finish();
  }
  map.finish();
  return entry;
}

}  // namespace

Calibration read_calibration(const std::filesystem::path& file) {
  YamlMap document = read_yaml(file, "vlp-calibration/1");
  Calibration calibration;
  const auto camera = document.required("camera");
  const auto report = document.optional("intrinsics_report");
  const auto rotation_center = document.optional("rotation_center");
  const auto dispersion = document.optional("dispersion");
  const auto history = document.optional("history");
  document.finish();
  YamlMap camera_map = camera.map();
  calibration.camera = read_camera(camera_map);
  camera_map.finish();
  if (report) calibration.intrinsics_report = read_intrinsics_report(report->map());
  if (rotation_center) calibration.rotation_center = read_rotation_center(rotation_center->map());
  if (dispersion) calibration.dispersion = read_dispersion(dispersion->map());
  if (!history) return calibration;
  for (const YamlValue& item : history->list()) {
    calibration.history.push_back(read_history_entry(item.map()));
    const std::string& part = calibration.history.back().part;
    if ((part == "rotation_center" && !rotation_center) || (part == "dispersion" && !dispersion)) {
      throw item.error("says that there is a part '" + part + "': is the file cut short?");
    }
  }
  return calibration;
}

}  // namespace vlp
