// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "rig/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "camera/lens_table.h"
#include "rig/calibration_error.h"
#include "rig/calibration_text.h"
#include "rig/file.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

LensModel read_lens_model(const YamlValue& value) {
  if (const auto model = lens_model_from_name(value.read_yaml_string())) return *model;
  throw value.make_unknown_yaml_word_error("the models are: " + list_lens_model_names());
}

Readout read_readout(const YamlValue& value) {
  if (value.read_yaml_string() == "rows") return Readout::rows;
  if (value.read_yaml_string() == "columns") return Readout::columns;
  throw value.make_unknown_yaml_word_error("the readout is along rows or columns");
}

std::vector<double> read_intrinsics(const YamlValue& value, LensModel model) {
  std::vector<double> intrinsics = value.read_yaml_numbers(num_lens_parameters(model));
  if (intrinsics[0] <= 0 || intrinsics[1] <= 0) {
    throw value.make_yaml_error("the focal lengths, the first two, should be positive");
  }
  return intrinsics;
}

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
  const auto list = value.read_yaml_list();
  if (list.size() != rows) {
    throw value.make_yaml_error("should be " + std::to_string(rows) + " rows of " +
                                std::to_string(cols) + " numbers");
  }
  Eigen::MatrixXd matrix(rows, cols);
  for (std::size_t row = 0; row < rows; ++row) {
    matrix.row(static_cast<Eigen::Index>(row)) = Eigen::Map<const Eigen::RowVectorXd>(
        list[row].read_yaml_numbers(cols).data(), static_cast<Eigen::Index>(cols));
  }
  if (matrix.cwiseAbs().maxCoeff() > kMaxDerivative) {
    throw value.make_yaml_error("contains a derivative beyond 1e12: is the file damaged?");
  }
  return matrix;
}

/// Throws InputError if a standard deviation exceeds kMaxSd.
void check_variances(const YamlValue& value, const Eigen::MatrixXd& covariance) {
  if (covariance.diagonal().maxCoeff() <= kMaxSd * kMaxSd) return;
  throw value.make_yaml_error(
      "states a standard deviation beyond 1,000,000: is it in the right unit?");
}

/// Reads the rows of the lower triangle: 1, 2, 3 ... numbers.
Eigen::MatrixXd read_joint_covariance(const YamlValue& value, std::size_t size) {
  const auto list = value.read_yaml_list();
  if (list.size() != size) {
    throw value.make_yaml_error("should be " + std::to_string(size) +
                                " rows of 1, 2, 3 ... numbers, the lower triangle");
  }
  Eigen::MatrixXd matrix(size, size);
  for (std::size_t row = 0; row < size; ++row) {
    const auto numbers = list[row].read_yaml_numbers(row + 1);
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
        throw list[row].make_yaml_error("is not a covariance's: no correlation is beyond 1");
      }
    }
  }
  check_variances(value, matrix);
  return matrix;
}

Matrix2 read_covariance(const YamlValue& value) {
  const auto rows = value.read_yaml_list();
  if (rows.size() != 2) throw value.make_yaml_error("should be two rows of two numbers");
  Matrix2 covariance;
  for (int row = 0; row < 2; ++row) {
    covariance.row(row) =
        Eigen::RowVector2d(rows[static_cast<std::size_t>(row)].read_yaml_numbers(2).data());
  }
  const double product = covariance(0, 0) * covariance(1, 1);
  constexpr double rounding = 1e-12;  // of a full correlation
  if (covariance(0, 1) != covariance(1, 0) || covariance(0, 0) < 0 || covariance(1, 1) < 0 ||
      covariance(0, 1) * covariance(0, 1) > product * (1 + rounding)) {
    // [FILE-5] `is not a covariance`
    throw value.make_yaml_error("is not a covariance: it should be symmetric and not negative");
  }
  check_variances(value, covariance);
  return covariance;
}

template <typename Matrix>
std::optional<Matrix> read_optional_matrix(YamlMap& map, const std::string& key, std::size_t rows,
                                           std::size_t cols) {
  const auto value = map.get_optional_yaml_value(key);
  return value ? std::optional<Matrix>(read_matrix(*value, rows, cols)) : std::nullopt;
}

std::optional<Matrix2> read_optional_covariance(YamlMap& map, const std::string& key) {
  const auto value = map.get_optional_yaml_value(key);
  return value ? std::optional(read_covariance(*value)) : std::nullopt;
}

IntrinsicsReport read_intrinsics_report(YamlMap& map, std::size_t intrinsics) {
  IntrinsicsReport report;
  report.views = map.get_required_yaml_value("views").read_yaml_integer_within(0, kLarge);
  report.corners = map.get_required_yaml_value("corners").read_yaml_integer_within(0, kLarge);
  report.outliers = map.get_required_yaml_value("outliers").read_yaml_integer_within(0, kLarge);
  report.rms_px = map.get_required_yaml_value("rms_px").read_yaml_number_within(0, kInfinity, "px");
  if (const auto value = map.get_optional_yaml_value("board_warp_m")) {
    const auto warp = value->read_yaml_numbers(2);
    report.board_warp_m = {warp[0], warp[1]};
  }
  report.expected_max_error_px =
      map.get_optional_yaml_number("expected_max_error_px", 0, kInfinity, "px");
  if (const auto value = map.get_optional_yaml_value("covariance")) {
    report.covariance = read_joint_covariance(*value, intrinsics);
  }
  if (const auto value = map.get_optional_yaml_value("valid_region_px")) {
    for (const YamlValue& corner : value->read_yaml_list()) {
      report.region_px.emplace_back(corner.read_yaml_numbers(2).data());
    }
    if (report.region_px.size() < 3)
      throw value->make_yaml_error("should have three corners or more");
  }
  return report;
}

RotationCenter read_rotation_center(YamlMap& map, std::size_t intrinsics) {
  RotationCenter center;
  const YamlValue model = map.get_required_yaml_value("model");
  if (model.read_yaml_string() != "shift" && model.read_yaml_string() != "tilt") {
    throw model.make_unknown_yaml_word_error("the models are: shift, tilt");
  }
  center.model = model.read_yaml_string() == "tilt" ? RotationModel::tilt : RotationModel::shift;
  center.center_px =
      Eigen::Vector2d(map.get_required_yaml_value("center_px").read_yaml_numbers(2).data());
  const YamlValue zenith = map.get_required_yaml_value("zenith_in_camera");
  center.zenith_in_camera = Eigen::Vector3d(zenith.read_yaml_numbers(3).data());
  // Six digits, as typed by a person, suffice.
  if (std::abs(center.zenith_in_camera.norm() - 1) > 1e-5 || center.zenith_in_camera.z() <= 0) {
    throw zenith.make_yaml_error("should be a unit vector with z > 0");
  }
  center.covariance = read_optional_covariance(map, "covariance");
  const auto lever_arm = map.get_optional_yaml_value("lever_arm_m");
  if (lever_arm) center.lever_arm_m = Eigen::Vector2d(lever_arm->read_yaml_numbers(2).data());
  const auto check_lever_arm = [&](const std::string& key) {
    const auto value = map.get_optional_yaml_value(key);
    if (value && !lever_arm) throw value->make_yaml_error("is of no lever_arm_m");
    return key;
  };
  center.lever_arm_covariance =
      read_optional_covariance(map, check_lever_arm("lever_arm_covariance"));
  center.jacobian_wrt_intrinsics =
      read_optional_matrix<MatrixX>(map, "jacobian_intrinsics", 2, intrinsics);
  center.lever_arm_jacobian_wrt_zenith =
      read_optional_matrix<Matrix2>(map, check_lever_arm("lever_arm_jacobian_zenith"), 2, 2);
  center.lever_arm_jacobian_wrt_intrinsics = read_optional_matrix<MatrixX>(
      map, check_lever_arm("lever_arm_jacobian_intrinsics"), 2, intrinsics);
  return center;
}

Dispersion::UncertainLamp read_uncertain_lamp(YamlMap& map) {
  Dispersion::UncertainLamp lamp;
  lamp.id = map.get_required_yaml_value("id").read_yaml_integer_within(0, kLarge);
  lamp.position_m =
      Eigen::Vector3d(map.get_required_yaml_value("position_m").read_yaml_numbers(3).data());
  lamp.sd_m = map.get_required_yaml_value("sd_m").read_yaml_number_within(0, kMaxSd, "m");
  lamp.jacobian_wrt_position = read_matrix(map.get_required_yaml_value("by_position"), 2, 3);
  return lamp;
}

Dispersion read_dispersion(YamlMap& map, std::size_t intrinsics) {
  Dispersion dispersion;
  dispersion.offset_px =
      Eigen::Vector2d(map.get_required_yaml_value("offset_px").read_yaml_numbers(2).data());
  dispersion.radius_m =
      map.get_required_yaml_value("radius_m").read_yaml_number_within(0, kInfinity, "m");
  dispersion.center_m =
      Eigen::Vector2d(map.get_required_yaml_value("center_m").read_yaml_numbers(2).data());
  dispersion.captures = map.get_required_yaml_value("captures").read_yaml_integer_within(1, kLarge);
  dispersion.covariance = read_optional_covariance(map, "covariance");
  dispersion.jacobian_wrt_intrinsics =
      read_optional_matrix<MatrixX>(map, "jacobian_intrinsics", 2, intrinsics);
  dispersion.jacobian_wrt_zenith = read_optional_matrix<Matrix2>(map, "jacobian_zenith", 2, 2);
  if (const auto value = map.get_optional_yaml_value("by_lamps")) {
    const auto items = value->read_yaml_list();
    if (items.size() > kMaxUncertainLamps)
      throw value->make_yaml_error("contains more than 1,000 lamps");
    for (const YamlValue& item : items) {
      const Dispersion::UncertainLamp lamp = item.convert_yaml_mapping(read_uncertain_lamp);
      const auto has_same_id = [&](const auto& earlier) { return earlier.id == lamp.id; };
      if (std::ranges::any_of(dispersion.uncertain_lamps, has_same_id))
        throw item.make_yaml_error("occurs twice");
      dispersion.uncertain_lamps.push_back(lamp);
    }
  }
  return dispersion;
}

Adjustment::AdjustedLamp read_adjusted_lamp_position(YamlMap& map) {
  return {map.get_required_yaml_value("id").read_yaml_integer_within(0, kLarge),
          Eigen::Vector3d(map.get_required_yaml_value("position_m").read_yaml_numbers(3).data())};
}

Adjustment read_adjustment(YamlMap& map, const Camera& camera) {
  Adjustment adjustment;
  for (const YamlValue& item : map.get_required_yaml_value("sets").read_yaml_list())
    adjustment.sets.push_back(item.read_yaml_string());
  adjustment.captures = map.get_required_yaml_value("captures").read_yaml_integer_within(1, kLarge);
  adjustment.detections =
      map.get_required_yaml_value("detections").read_yaml_integer_within(1, kLarge);
  adjustment.residual_px =
      map.get_required_yaml_value("residual_px").read_yaml_number_within(0, kInfinity, "px");
  adjustment.lamps =
      map.get_required_yaml_value("lamps").convert_yaml_mapping_list(read_adjusted_lamp_position);
  const YamlValue parameters = map.get_required_yaml_value("parameters");
  const auto found = parameters.read_yaml_list();
  const auto names = list_adjustment_parameter_names(camera, adjustment);
  for (std::size_t i = 0; i < std::max(found.size(), names.size()); ++i) {
    if (i >= found.size() || i >= names.size() || found[i].read_yaml_string() != names[i]) {
      // [FILE-4] `is missing in its place`, `there are more than these`
      throw parameters.make_yaml_error(
          "should be the lens model's, the zenith, the lever arm, the lamps: " +
          (i < names.size() ? names[i] + " is missing in its place" : "there are more than these"));
    }
  }
  adjustment.covariance =
      read_joint_covariance(map.get_required_yaml_value("covariance"), names.size());
  return adjustment;
}

HistoryEntry::Input read_history_input(YamlMap& map) {
  return {map.get_required_yaml_value("file").read_yaml_string(),
          map.get_required_yaml_value("sha256").read_yaml_string()};
}

HistoryEntry read_history_entry(YamlMap& map) {
  return {map.get_required_yaml_value("part").read_yaml_string(),
          map.get_required_yaml_value("program").read_yaml_string(),
          map.get_required_yaml_value("version").read_yaml_string(),
          map.get_required_yaml_value("options").read_yaml_string(),
          map.get_required_yaml_value("inputs").convert_yaml_mapping_list(read_history_input)};
}

void begin_yaml_section(YAML::Emitter& out, const char* key) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
}

/// Required keys come last, see write_calibration().
void emit_camera(YAML::Emitter& out, const Camera& camera) {
  begin_yaml_section(out, "camera");
  emit_yaml_quoted_text(out, "id", camera.id);
  if (camera.pixel_pitch_m) emit_yaml_number(out, "pixel_pitch_m", *camera.pixel_pitch_m);
  if (camera.row_time_s) emit_yaml_number(out, "row_time_s", *camera.row_time_s);
  if (camera.readout) {
    emit_yaml_plain_word(out, "readout", *camera.readout == Readout::rows ? "rows" : "columns");
  }
  emit_yaml_integers(out, "imager_px", camera.imager_px);
  emit_yaml_plain_word(out, "lens_model", lens_model_name(camera.lens_model));
  emit_yaml_numbers(out, "intrinsics", camera.intrinsics);
  out << YAML::EndMap;
}

void emit_matrix(YAML::Emitter& out, const char* key, const Eigen::MatrixXd& matrix) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const Eigen::VectorXd numbers = matrix.row(row);
    emit_yaml_inline_list(out, {numbers.data(), static_cast<std::size_t>(numbers.size())});
  }
  out << YAML::EndSeq;
}

/// Writes the rows of the lower triangle.
void emit_joint_covariance(YAML::Emitter& out, const Eigen::MatrixXd& covariance) {
  out << YAML::Key << "covariance" << YAML::Value << YAML::BeginSeq;
  for (Eigen::Index row = 0; row < covariance.rows(); ++row) {
    const Eigen::VectorXd numbers = covariance.row(row).head(row + 1);
    emit_yaml_inline_list(out, {numbers.data(), static_cast<std::size_t>(numbers.size())});
  }
  out << YAML::EndSeq;
}

void emit_intrinsics_report(YAML::Emitter& out, const IntrinsicsReport& report) {
  begin_yaml_section(out, "intrinsics_report");
  emit_yaml_integer(out, "views", report.views);
  emit_yaml_integer(out, "corners", report.corners);
  emit_yaml_integer(out, "outliers", report.outliers);
  emit_yaml_number(out, "rms_px", report.rms_px);
  if (report.board_warp_m) emit_yaml_numbers(out, "board_warp_m", *report.board_warp_m);
  // Infinite if the lens has no ray, which YAML cannot represent; a gate reports it.
  if (report.expected_max_error_px && std::isfinite(*report.expected_max_error_px)) {
    emit_yaml_number(out, "expected_max_error_px", *report.expected_max_error_px);
  }
  if (report.covariance) emit_joint_covariance(out, *report.covariance);
  if (!report.region_px.empty()) {
    out << YAML::Key << "valid_region_px" << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (const Eigen::Vector2d& corner : report.region_px) {
      emit_yaml_inline_list(out, std::array{corner.x(), corner.y()});
    }
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
}

void emit_optional_matrix(YAML::Emitter& out, const char* key, const auto& matrix) {
  if (matrix) emit_matrix(out, key, *matrix);
}

void emit_rotation_center(YAML::Emitter& out, const RotationCenter& center) {
  begin_yaml_section(out, "rotation_center");
  emit_yaml_plain_word(out, "model", center.model == RotationModel::tilt ? "tilt" : "shift");
  emit_yaml_numbers(out, "center_px", center.center_px);
  emit_yaml_numbers(out, "zenith_in_camera", center.zenith_in_camera);
  emit_optional_matrix(out, "covariance", center.covariance);
  if (center.lever_arm_m) emit_yaml_numbers(out, "lever_arm_m", *center.lever_arm_m);
  emit_optional_matrix(out, "lever_arm_covariance", center.lever_arm_covariance);
  emit_optional_matrix(out, "jacobian_intrinsics", center.jacobian_wrt_intrinsics);
  emit_optional_matrix(out, "lever_arm_jacobian_zenith", center.lever_arm_jacobian_wrt_zenith);
  emit_optional_matrix(out, "lever_arm_jacobian_intrinsics",
                       center.lever_arm_jacobian_wrt_intrinsics);
  out << YAML::EndMap;
}

void emit_uncertain_lamps(YAML::Emitter& out, const std::vector<Dispersion::UncertainLamp>& lamps) {
  out << YAML::Key << "by_lamps" << YAML::Value << YAML::BeginSeq;
  for (const auto& [id, position_m, sd_m, by_position] : lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_yaml_integer(out, "id", id);
    emit_yaml_numbers(out, "position_m", position_m);
    emit_yaml_number(out, "sd_m", sd_m);
    emit_matrix(out, "by_position", by_position);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

void emit_dispersion(YAML::Emitter& out, const Dispersion& dispersion) {
  begin_yaml_section(out, "dispersion");
  emit_yaml_numbers(out, "offset_px", dispersion.offset_px);
  emit_yaml_number(out, "radius_m", dispersion.radius_m);
  emit_yaml_numbers(out, "center_m", dispersion.center_m);
  emit_yaml_integer(out, "captures", dispersion.captures);
  emit_optional_matrix(out, "covariance", dispersion.covariance);
  emit_optional_matrix(out, "jacobian_intrinsics", dispersion.jacobian_wrt_intrinsics);
  emit_optional_matrix(out, "jacobian_zenith", dispersion.jacobian_wrt_zenith);
  if (!dispersion.uncertain_lamps.empty()) emit_uncertain_lamps(out, dispersion.uncertain_lamps);
  out << YAML::EndMap;
}

void emit_adjustment(YAML::Emitter& out, const Camera& camera, const Adjustment& adjustment) {
  begin_yaml_section(out, "adjustment");
  out << YAML::Key << "sets" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& set : adjustment.sets) out << YAML::DoubleQuoted << set;
  out << YAML::EndSeq;
  emit_yaml_integer(out, "captures", adjustment.captures);
  emit_yaml_integer(out, "detections", adjustment.detections);
  emit_yaml_number(out, "residual_px", adjustment.residual_px);
  out << YAML::Key << "lamps" << YAML::Value << YAML::BeginSeq;
  for (const auto& [id, position_m] : adjustment.lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_yaml_integer(out, "id", id);
    emit_yaml_numbers(out, "position_m", position_m);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::Key << "parameters" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& name : list_adjustment_parameter_names(camera, adjustment)) out << name;
  out << YAML::EndSeq;
  emit_joint_covariance(out, adjustment.covariance);
  out << YAML::EndMap;
}

void emit_history(YAML::Emitter& out, const std::vector<HistoryEntry>& history) {
  out << YAML::Key << "history" << YAML::Value << YAML::BeginSeq;
  for (const HistoryEntry& entry : history) {
    out << YAML::BeginMap;
    emit_yaml_plain_word(out, "part", entry.part);
    emit_yaml_plain_word(out, "program", entry.program);
    emit_yaml_quoted_text(out, "version", entry.version);
    emit_yaml_quoted_text(out, "options", entry.options);
    out << YAML::Key << "inputs" << YAML::Value << YAML::BeginSeq;
    for (const auto& input : entry.inputs) {
      out << YAML::Flow << YAML::BeginMap;
      emit_yaml_quoted_text(out, "file", input.file);
      emit_yaml_quoted_text(out, "sha256", input.sha256);
      out << YAML::EndMap;
    }
    out << YAML::EndSeq << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

}  // namespace

Camera read_camera_from_yaml(YamlMap& map) {
  Camera camera;
  camera.id = map.get_required_yaml_value("id").read_yaml_string();
  const YamlValue imager_px = map.get_required_yaml_value("imager_px");
  const auto imager = imager_px.read_yaml_list();
  if (imager.size() != 2) throw imager_px.make_yaml_error("should be [width, height]");
  camera.imager_px = {imager[0].read_yaml_integer_within(1, 1 << 20),
                      imager[1].read_yaml_integer_within(1, 1 << 20)};
  camera.lens_model = read_lens_model(map.get_required_yaml_value("lens_model"));
  camera.intrinsics = read_intrinsics(map.get_required_yaml_value("intrinsics"), camera.lens_model);
  camera.pixel_pitch_m = map.get_optional_yaml_number("pixel_pitch_m", 1e-7, 1e-4, "m");
  camera.row_time_s = map.get_optional_yaml_number("row_time_s", 1e-8, 1e-3, "s");
  if (const auto value = map.get_optional_yaml_value("readout"))
    camera.readout = read_readout(*value);
  return camera;
}

std::vector<std::string> list_adjustment_parameter_names(const Camera& camera,
                                                         const Adjustment& adjustment) {
  std::vector<std::string> names{"fx", "fy", "cx", "cy"};
  for (const auto& distortion : list_distortion_names_and_initial_values(camera.lens_model)) {
    names.emplace_back(distortion.name);
  }
  names.insert(names.end(), {"zenith_x", "zenith_y", "lever_arm_x_m", "lever_arm_y_m"});
  for (const Adjustment::AdjustedLamp& lamp : adjustment.lamps) {
    const std::string prefix = "lamp_" + std::to_string(lamp.id);
    for (const char* axis : {"_x_m", "_y_m", "_z_m"}) names.push_back(prefix + axis);
  }
  return names;
}

Calibration read_calibration(const std::filesystem::path& file) {
  YamlMap document = read_yaml_file(file, "vlp-calibration/1");
  Calibration calibration;
  const auto camera = document.get_required_yaml_value("camera");
  const auto report = document.get_optional_yaml_value("intrinsics_report");
  const auto rotation_center = document.get_optional_yaml_value("rotation_center");
  const auto dispersion = document.get_optional_yaml_value("dispersion");
  const auto adjustment = document.get_optional_yaml_value("adjustment");
  const auto history = document.get_optional_yaml_value("history");
  document.check_all_yaml_keys_read();
  calibration.camera = camera.convert_yaml_mapping(read_camera_from_yaml);
  const auto read_if = [](const auto& value, const auto& read, const auto& argument) {
    const auto read_part = [&](YamlMap& map) { return read(map, argument); };
    return value ? std::optional(value->convert_yaml_mapping(read_part)) : std::nullopt;
  };
  const auto intrinsics =
      static_cast<std::size_t>(count_intrinsics_with_covariance(calibration.camera));
  calibration.intrinsics_report = read_if(report, read_intrinsics_report, intrinsics);
  calibration.rotation_center = read_if(rotation_center, read_rotation_center, intrinsics);
  calibration.dispersion = read_if(dispersion, read_dispersion, intrinsics);
  calibration.adjustment = read_if(adjustment, read_adjustment, calibration.camera);
  if (!history) return calibration;
  for (const YamlValue& item : history->read_yaml_list()) {
    calibration.history.push_back(item.convert_yaml_mapping(read_history_entry));
    const std::string& part = calibration.history.back().part;
    if ((part == "rotation_center" && !rotation_center) || (part == "dispersion" && !dispersion) ||
        (part == "adjustment" && !adjustment)) {
      throw item.make_yaml_error("lists a part '" + part + "': is the file cut short?");
    }
  }
  return calibration;
}

std::string format_calibration_yaml(const Calibration& calibration) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  emit_yaml_plain_word(out, "format", "vlp-calibration/1");
  if (!calibration.history.empty()) emit_history(out, calibration.history);
  if (calibration.intrinsics_report) emit_intrinsics_report(out, *calibration.intrinsics_report);
  if (calibration.rotation_center) emit_rotation_center(out, *calibration.rotation_center);
  if (calibration.dispersion) emit_dispersion(out, *calibration.dispersion);
  if (calibration.adjustment) {
    emit_adjustment(out, calibration.camera, *calibration.adjustment);
  }
  emit_camera(out, calibration.camera);
  out << YAML::EndMap << YAML::Newline;
  return out.c_str();
}

void write_calibration(const std::filesystem::path& file, const Calibration& calibration) {
  write_file(file, format_calibration_yaml(calibration));
}

}  // namespace vlp
