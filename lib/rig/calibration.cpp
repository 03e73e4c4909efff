// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "camera/lens_table.h"
#include "rig/calibration_error.h"
#include "rig/yaml_parts.h"

namespace vlp {
namespace {

constexpr int kLarge = std::numeric_limits<int>::max();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Largest standard deviation of a pixel, a lens parameter or a position: larger values carry
/// no information, and products of covariances remain finite.
constexpr double kMaxSd = 1e6;
/// Largest derivative of a calibrated quantity by another, for the same reason.
constexpr double kMaxDerivative = 1e12;
/// Maximum number of lamps correlated with a dispersion, which has few captures: their joint
/// covariance is dense.
constexpr std::size_t kMaxUncertainLamps = 1000;

/// Reads `rows` rows of `cols` numbers.
Eigen::MatrixXd read_matrix(const YamlValue& value, std::size_t rows, std::size_t cols) {
  const auto list = value.list();
  if (list.size() != rows) {
    throw value.error("should be " + std::to_string(rows) + " rows of " + std::to_string(cols) +
                      " numbers");
  }
  Eigen::MatrixXd matrix(rows, cols);
  for (std::size_t row = 0; row < rows; ++row) {
    matrix.row(static_cast<Eigen::Index>(row)) = Eigen::Map<const Eigen::RowVectorXd>(
        list[row].numbers(cols).data(), static_cast<Eigen::Index>(cols));
  }
  if (matrix.cwiseAbs().maxCoeff() > kMaxDerivative) {
    throw value.error("holds a derivative beyond 1e12: is the file damaged?");
  }
  return matrix;
}

/// Throws InputError if a standard deviation exceeds kMaxSd.
void check_variances(const YamlValue& value, const Eigen::MatrixXd& covariance) {
  if (covariance.diagonal().maxCoeff() <= kMaxSd * kMaxSd) return;
  throw value.error("states a standard deviation beyond 1,000,000: is it in the right unit?");
}

/// Reads the rows of the lower triangle: 1, 2, 3 ... numbers.
Eigen::MatrixXd read_joint_covariance(const YamlValue& value, std::size_t size) {
  const auto list = value.list();
  if (list.size() != size) {
    throw value.error("should be " + std::to_string(size) +
                      " rows of 1, 2, 3 ... numbers, the lower triangle");
  }
  Eigen::MatrixXd matrix(size, size);
  for (std::size_t row = 0; row < size; ++row) {
    const auto numbers = list[row].numbers(row + 1);
    for (std::size_t col = 0; col <= row; ++col) {
      const auto i = static_cast<Eigen::Index>(row), j = static_cast<Eigen::Index>(col);
      matrix(i, j) = matrix(j, i) = numbers[col];
    }
    // Checks each correlation: an invalid covariance usually has a mistake in one number.
    for (std::size_t col = 0; col <= row; ++col) {
      const auto i = static_cast<Eigen::Index>(row), j = static_cast<Eigen::Index>(col);
      constexpr double rounding = 1e-9;
      if (matrix(i, i) < 0 ||
          matrix(i, j) * matrix(i, j) > matrix(i, i) * matrix(j, j) * (1 + rounding)) {
        throw list[row].error("is not a covariance's: no correlation is beyond 1");
      }
    }
  }
  check_variances(value, matrix);
  return matrix;
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
  check_variances(value, covariance);
  return covariance;
}

IntrinsicsReport read_intrinsics_report(YamlMap map, std::size_t intrinsics) {
  IntrinsicsReport report;
  report.views = map.required("views").integer_within(0, kLarge);
  report.corners = map.required("corners").integer_within(0, kLarge);
  report.outliers = map.required("outliers").integer_within(0, kLarge);
  report.rms_px = map.required("rms_px").number_within(0, kInfinity, "px");
  if (const auto value = map.optional("board_warp_m")) {
    const auto warp = value->numbers(2);
    report.board_warp_m = {warp[0], warp[1]};
  }
  if (const auto value = map.optional("expected_max_error_px")) {
    report.expected_max_error_px = value->number_within(0, kInfinity, "px");
  }
  if (const auto value = map.optional("covariance")) {
    report.covariance = read_joint_covariance(*value, intrinsics);
  }
  if (const auto value = map.optional("valid_region_px")) {
    for (const YamlValue& corner : value->list()) {
      const auto pixel = corner.numbers(2);
      report.region_px.emplace_back(pixel[0], pixel[1]);
    }
    if (report.region_px.size() < 3) throw value->error("should have three corners or more");
  }
  map.finish();
  return report;
}

RotationCenter read_rotation_center(YamlMap map, std::size_t intrinsics) {
  RotationCenter center;
  const YamlValue model = map.required("model");
  if (model.text() != "shift" && model.text() != "tilt") {
    throw model.unknown("the models are: shift, tilt");
  }
  center.model = model.text() == "tilt" ? RotationModel::tilt : RotationModel::shift;
  center.center_px = Eigen::Vector2d(map.required("center_px").numbers(2).data());
  const YamlValue zenith = map.required("zenith_in_camera");
  center.zenith_in_camera = Eigen::Vector3d(zenith.numbers(3).data());
  // Six digits, as typed by a person, suffice.
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
  if (const auto value = map.optional("jacobian_intrinsics")) {
    center.by_intrinsics = read_matrix(*value, 2, intrinsics);
  }
  if (const auto value = map.optional("lever_arm_jacobian_zenith")) {
    if (!center.lever_arm_m) throw value->error("is of no lever_arm_m");
    center.lever_arm_by_zenith = read_matrix(*value, 2, 2);
  }
  if (const auto value = map.optional("lever_arm_jacobian_intrinsics")) {
    if (!center.lever_arm_m) throw value->error("is of no lever_arm_m");
    center.lever_arm_by_intrinsics = read_matrix(*value, 2, intrinsics);
  }
  map.finish();
  return center;
}

Dispersion::UncertainLamp read_uncertain_lamp(YamlMap map) {
  Dispersion::UncertainLamp lamp;
  lamp.id = map.required("id").integer_within(0, kLarge);
  lamp.position_m = Eigen::Vector3d(map.required("position_m").numbers(3).data());
  lamp.sd_m = map.required("sd_m").number_within(0, kMaxSd, "m");
  lamp.by_position = read_matrix(map.required("by_position"), 2, 3);
  map.finish();
  return lamp;
}

Dispersion read_dispersion(YamlMap map, std::size_t intrinsics) {
  Dispersion dispersion;
  dispersion.offset_px = Eigen::Vector2d(map.required("offset_px").numbers(2).data());
  dispersion.radius_m = map.required("radius_m").number_within(0, kInfinity, "m");
  dispersion.center_m = Eigen::Vector2d(map.required("center_m").numbers(2).data());
  dispersion.captures = map.required("captures").integer_within(1, kLarge);
  if (const auto value = map.optional("covariance")) {
    dispersion.covariance = read_covariance(*value);
  }
  if (const auto value = map.optional("jacobian_intrinsics")) {
    dispersion.by_intrinsics = read_matrix(*value, 2, intrinsics);
  }
  if (const auto value = map.optional("jacobian_zenith")) {
    dispersion.by_zenith = read_matrix(*value, 2, 2);
  }
  if (const auto value = map.optional("by_lamps")) {
    const auto items = value->list();
    if (items.size() > kMaxUncertainLamps) throw value->error("holds more than 1,000 lamps");
    dispersion.by_lamps.reserve(items.size());
    for (const YamlValue& item : items) {
      const Dispersion::UncertainLamp lamp = read_uncertain_lamp(item.map());
      const auto has_same_id = [&](const auto& earlier) { return earlier.id == lamp.id; };
      if (std::ranges::any_of(dispersion.by_lamps, has_same_id)) throw item.error("stands twice");
      dispersion.by_lamps.push_back(lamp);
    }
  }
  map.finish();
  return dispersion;
}

Adjustment read_adjustment(YamlMap map, const Camera& camera) {
  Adjustment adjustment;
  for (const YamlValue& item : map.required("sets").list()) adjustment.sets.push_back(item.text());
  adjustment.captures = map.required("captures").integer_within(1, kLarge);
  adjustment.detections = map.required("detections").integer_within(1, kLarge);
  adjustment.residual_px = map.required("residual_px").number_within(0, kInfinity, "px");
  for (const YamlValue& item : map.required("lamps").list()) {
    YamlMap lamp = item.map();
    adjustment.lamps.push_back({lamp.required("id").integer_within(0, kLarge),
                                Eigen::Vector3d(lamp.required("position_m").numbers(3).data())});
    lamp.finish();
  }
  const YamlValue parameters = map.required("parameters");
  const auto found = parameters.list();
  const auto names = parameter_names(camera, adjustment);
  for (std::size_t i = 0; i < std::max(found.size(), names.size()); ++i) {
    if (i >= found.size() || i >= names.size() || found[i].text() != names[i]) {
      throw parameters.error(
          "should be the lens model's, the zenith, the lever arm, the lamps: " +
          (i < names.size() ? names[i] + " is missing in its place" : "there are more than these"));
    }
  }
  adjustment.covariance = read_joint_covariance(map.required("covariance"), names.size());
  map.finish();
  return adjustment;
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

std::vector<std::string> parameter_names(const Camera& camera, const Adjustment& adjustment) {
  std::vector<std::string> names{"fx", "fy", "cx", "cy"};
  for (const auto& distortion : distortions_of(camera.lens_model)) {
    names.emplace_back(distortion.name);
  }
  names.insert(names.end(), {"zenith_x", "zenith_y", "lever_arm_x_m", "lever_arm_y_m"});
  for (const Adjustment::Place& lamp : adjustment.lamps) {
    const std::string prefix = "lamp_" + std::to_string(lamp.id);
    for (const char* axis : {"_x_m", "_y_m", "_z_m"}) names.push_back(prefix + axis);
  }
  return names;
}

Calibration read_calibration(const std::filesystem::path& file) {
  YamlMap document = read_yaml(file, "vlp-calibration/1");
  Calibration calibration;
  const auto camera = document.required("camera");
  const auto report = document.optional("intrinsics_report");
  const auto rotation_center = document.optional("rotation_center");
  const auto dispersion = document.optional("dispersion");
  const auto adjustment = document.optional("adjustment");
  const auto history = document.optional("history");
  document.finish();
  YamlMap camera_map = camera.map();
  calibration.camera = read_camera(camera_map);
  camera_map.finish();
  const auto intrinsics = static_cast<std::size_t>(count_reported_intrinsics(calibration.camera));
  if (report) calibration.intrinsics_report = read_intrinsics_report(report->map(), intrinsics);
  if (rotation_center) {
    calibration.rotation_center = read_rotation_center(rotation_center->map(), intrinsics);
  }
  if (dispersion) calibration.dispersion = read_dispersion(dispersion->map(), intrinsics);
  if (adjustment) {
    calibration.adjustment = read_adjustment(adjustment->map(), calibration.camera);
  }
  if (!history) return calibration;
  for (const YamlValue& item : history->list()) {
    calibration.history.push_back(read_history_entry(item.map()));
    const std::string& part = calibration.history.back().part;
    if ((part == "rotation_center" && !rotation_center) || (part == "dispersion" && !dispersion) ||
        (part == "adjustment" && !adjustment)) {
      throw item.error("says that there is a part '" + part + "': is the file cut short?");
    }
  }
  return calibration;
}

}  // namespace vlp
