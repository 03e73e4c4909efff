// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "rig/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rig/calibration_error.h"
#include "rig/calibration_text.h"
#include "rig/file.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

LensModel read_lens_model(const YamlValue& value) {
  if (const auto model = lens_model_from_name(value.read_text())) return *model;
  throw value.make_unknown_word_error("the models are: " + list_lens_model_names());
}

Readout read_readout(const YamlValue& value) {
  if (value.read_text() == "rows") return Readout::rows;
  if (value.read_text() == "columns") return Readout::columns;
  throw value.make_unknown_word_error("the readout is along rows or columns");
}

std::vector<double> read_intrinsics(const YamlValue& value, LensModel model) {
  std::vector<double> intrinsics = value.read_numbers(num_lens_parameters(model));
  if (intrinsics[0] <= 0 || intrinsics[1] <= 0) {
    throw value.make_error("the focal lengths, the first two, should be positive");
  }
  return intrinsics;
}

constexpr int kLarge = std::numeric_limits<int>::max();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Largest standard deviation of a pixel, a lens parameter or a position: larger values carry
/// no information, and products of covariances remain finite.
constexpr double kMaxSd = 1e6;

/// Reads the rows of the lower triangle, 1, 2, 3 ... numbers, after the rows of `known`.
MatrixX read_covariance(const YamlValue& value, const MatrixX& known, Eigen::Index size) {
  const auto list = value.read_list();
  if (std::ssize(list) != size - known.rows()) {
    throw value.make_error("should be " + std::to_string(size - known.rows()) + " rows of " +
                           std::to_string(known.rows() + 1) + ", " +
                           std::to_string(known.rows() + 2) + " ... numbers, the lower triangle");
  }
  // All numbers are read first, so that the matrix is not larger than the file.
  std::vector<std::vector<double>> rows;
  rows.reserve(list.size());
  for (const YamlValue& item : list)
    rows.push_back(item.read_numbers(static_cast<std::size_t>(known.rows()) + rows.size() + 1));
  Eigen::MatrixXd matrix(size, size);
  matrix.topLeftCorner(known.rows(), known.rows()) = known;
  for (Eigen::Index row = known.rows(); row < size; ++row) {
    const auto index = static_cast<std::size_t>(row - known.rows());
    matrix.row(row).head(row + 1) =
        Eigen::Map<const Eigen::RowVectorXd>(rows[index].data(), row + 1);
    matrix.col(row).head(row) = matrix.row(row).head(row).transpose();
    // Checks each correlation: an invalid covariance usually has a mistake in one number.
    for (Eigen::Index col = 0; col <= row; ++col) {
      constexpr double rounding = 1e-9;
      if (matrix(row, row) < 0 || matrix(row, col) * matrix(row, col) >
                                      matrix(row, row) * matrix(col, col) * (1 + rounding)) {
        // [FILE-5] `is not a covariance`
        throw list[index].make_error("is not a covariance's: no correlation is beyond 1");
      }
    }
  }
  if (size > 0 && matrix.diagonal().maxCoeff() > kMaxSd * kMaxSd) {
    throw value.make_error(
        "states a standard deviation beyond 1,000,000: is it in the right unit?");
  }
  return matrix;
}

/// Throws InputError if a part has a covariance beside joint_covariance.
void check_no_covariance(const YamlMap& map, const std::string& program) {
  if (map.has("covariance")) {
    throw map.make_error("key 'covariance' is now in joint_covariance: run " + program +
                         " again on the calibration from before it");
  }
}

IntrinsicsReport read_intrinsics_report(YamlMap& map, Eigen::Index intrinsics) {
  IntrinsicsReport report;
  report.views = map.require("views").read_integer({0, kLarge});
  report.corners = map.require("corners").read_integer({0, kLarge});
  report.outliers = map.require("outliers").read_integer({0, kLarge});
  report.rms_px = map.require("rms_px").read_number({0, kInfinity, "px"});
  if (const auto value = map.find("board_warp_m")) {
    const auto warp = value->read_numbers(2);
    report.board_warp_m = {warp[0], warp[1]};
  }
  map.optional("expected_max_error_px", report.expected_max_error_px, Range{0, kInfinity, "px"});
  if (const auto value = map.find("covariance")) {
    report.covariance = read_covariance(*value, MatrixX(0, 0), intrinsics);
  }
  if (const auto value = map.find("valid_region_px")) {
    for (const YamlValue& corner : value->read_list()) {
      report.region_px.emplace_back(corner.read_numbers(2).data());
    }
    if (report.region_px.size() < 3) throw value->make_error("should have three corners or more");
  }
  return report;
}

RotationCenter read_rotation_center(YamlMap& map) {
  check_no_covariance(map, "vlp-rotation");
  RotationCenter center;
  const YamlValue model = map.require("model");
  if (model.read_text() != "shift" && model.read_text() != "tilt") {
    throw model.make_unknown_word_error("the models are: shift, tilt");
  }
  center.model = model.read_text() == "tilt" ? RotationModel::tilt : RotationModel::shift;
  center.center_px = Eigen::Vector2d(map.require("center_px").read_numbers(2).data());
  const YamlValue zenith = map.require("zenith_in_camera");
  center.zenith_in_camera = Eigen::Vector3d(zenith.read_numbers(3).data());
  // Six digits, as typed by a person, suffice.
  if (std::abs(center.zenith_in_camera.norm() - 1) > 1e-5 || center.zenith_in_camera.z() <= 0) {
    throw zenith.make_error("should be a unit vector with z > 0");
  }
  if (const auto lever_arm = map.find("lever_arm_m"))
    center.lever_arm_m = Eigen::Vector2d(lever_arm->read_numbers(2).data());
  return center;
}

Dispersion read_dispersion(YamlMap& map) {
  check_no_covariance(map, "vlp-dispersion");
  Dispersion dispersion;
  dispersion.offset_px = Eigen::Vector2d(map.require("offset_px").read_numbers(2).data());
  dispersion.radius_m = map.require("radius_m").read_number({0, kInfinity, "m"});
  dispersion.center_m = Eigen::Vector2d(map.require("center_m").read_numbers(2).data());
  dispersion.captures = map.require("captures").read_integer({1, kLarge});
  return dispersion;
}

Adjustment read_adjustment(YamlMap& map) {
  check_no_covariance(map, "vlp-adjust");
  Adjustment adjustment;
  for (const YamlValue& item : map.require("sets").read_list())
    adjustment.sets.push_back(item.read_text());
  adjustment.captures = map.require("captures").read_integer({1, kLarge});
  adjustment.detections = map.require("detections").read_integer({1, kLarge});
  adjustment.residual_px = map.require("residual_px").read_number({0, kInfinity, "px"});
  return adjustment;
}

JointCovariance::LampPosition read_lamp_position(YamlMap& map) {
  return {map.require("id").read_integer({0, kLarge}),
          Eigen::Vector3d(map.require("position_m").read_numbers(3).data())};
}

JointCovariance read_joint_covariance(YamlMap& map, const Calibration& calibration) {
  JointCovariance joint;
  joint.lamps = map.require("lamps").convert_mapping_list(read_lamp_position);
  std::vector<std::string> lamp_names;
  for (const auto& lamp : joint.lamps)
    std::ranges::move(list_lamp_parameter_names(lamp.id), std::back_inserter(lamp_names));
  const YamlValue parameters = map.require("parameters");
  const auto items = parameters.read_list();
  const auto& report = calibration.intrinsics_report;
  MatrixX lens(0, 0);
  const auto read_names_if_next = [&](std::span<const std::string> names, bool is_required) {
    const std::size_t first = joint.parameters.size();
    if (names.empty() ||
        (!is_required && (first >= items.size() || items[first].read_text() != names.front())))
      return false;
    for (const std::string& name : names) {
      const std::size_t at = joint.parameters.size();
      if (at >= items.size() || items[at].read_text() != name) {
        // [FILE-4] `is missing in its place`
        throw parameters.make_error(name + " is missing in its place");
      }
      joint.parameters.push_back(name);
    }
    return true;
  };
  if (read_names_if_next(list_intrinsics_names(calibration.camera), false)) {
    if (!report || !report->covariance)
      throw parameters.make_error("has the lens, and intrinsics_report has no covariance");
    lens = *report->covariance;
  }
  const auto read_pair = [&](std::string_view name, bool is_known) {
    if (read_names_if_next(list_pair_names(name), false) && !is_known) {
      // [FILE-4] `which the calibration does not have`
      throw parameters.make_error("has " + std::string(name) +
                                  ", which the calibration does not have");
    }
  };
  read_pair(kZenithParameter, calibration.rotation_center.has_value());
  read_pair(kLeverArmParameter, calibration.rotation_center.has_value());
  read_names_if_next(lamp_names, true);
  read_pair(kOffsetParameter, calibration.dispersion.has_value());
  if (joint.parameters.size() < items.size()) {
    // [FILE-4] `is not in its place`
    throw items[joint.parameters.size()].make_error(
        "is not in its place: the order is lens, zenith, lever arm, lamps, offset");
  }
  joint.matrix = read_covariance(map.require("rows"), lens, std::ssize(items));
  return joint;
}

HistoryEntry::Input read_history_input(YamlMap& map) {
  return {map.require("file").read_text(), map.require("sha256").read_text()};
}

HistoryEntry read_history_entry(YamlMap& map) {
  return {map.require("part").read_text(), map.require("program").read_text(),
          map.require("version").read_text(), map.require("options").read_text(),
          map.require("inputs").convert_mapping_list(read_history_input)};
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

/// Writes the rows of the lower triangle from the first one on.
void emit_covariance(YAML::Emitter& out, const char* key, const MatrixX& covariance,
                     Eigen::Index first) {
  out << YAML::Key << key << YAML::Value << YAML::BeginSeq;
  for (Eigen::Index row = first; row < covariance.rows(); ++row) {
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
  if (report.covariance) emit_covariance(out, "covariance", *report.covariance, 0);
  if (!report.region_px.empty()) {
    out << YAML::Key << "valid_region_px" << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (const Eigen::Vector2d& corner : report.region_px) {
      emit_yaml_inline_list(out, std::array{corner.x(), corner.y()});
    }
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
}

void emit_rotation_center(YAML::Emitter& out, const RotationCenter& center) {
  begin_yaml_section(out, "rotation_center");
  emit_yaml_plain_word(out, "model", center.model == RotationModel::tilt ? "tilt" : "shift");
  emit_yaml_numbers(out, "center_px", center.center_px);
  emit_yaml_numbers(out, "zenith_in_camera", center.zenith_in_camera);
  if (center.lever_arm_m) emit_yaml_numbers(out, "lever_arm_m", *center.lever_arm_m);
  out << YAML::EndMap;
}

void emit_dispersion(YAML::Emitter& out, const Dispersion& dispersion) {
  begin_yaml_section(out, "dispersion");
  emit_yaml_numbers(out, "offset_px", dispersion.offset_px);
  emit_yaml_number(out, "radius_m", dispersion.radius_m);
  emit_yaml_numbers(out, "center_m", dispersion.center_m);
  emit_yaml_integer(out, "captures", dispersion.captures);
  out << YAML::EndMap;
}

void emit_adjustment(YAML::Emitter& out, const Adjustment& adjustment) {
  begin_yaml_section(out, "adjustment");
  out << YAML::Key << "sets" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& set : adjustment.sets) out << YAML::DoubleQuoted << set;
  out << YAML::EndSeq;
  emit_yaml_integer(out, "captures", adjustment.captures);
  emit_yaml_integer(out, "detections", adjustment.detections);
  emit_yaml_number(out, "residual_px", adjustment.residual_px);
  out << YAML::EndMap;
}

void emit_joint_covariance(YAML::Emitter& out, const JointCovariance& joint, Eigen::Index lens) {
  begin_yaml_section(out, "joint_covariance");
  out << YAML::Key << "lamps" << YAML::Value << YAML::BeginSeq;
  for (const auto& [id, position_m] : joint.lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_yaml_integer(out, "id", id);
    emit_yaml_numbers(out, "position_m", position_m);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::Key << "parameters" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& name : joint.parameters) out << name;
  out << YAML::EndSeq;
  emit_covariance(out, "rows", joint.matrix, joint.find_row("fx") ? lens : 0);
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
  camera.id = map.require("id").read_text();
  const YamlValue imager_px = map.require("imager_px");
  const auto imager = imager_px.read_list();
  if (imager.size() != 2) throw imager_px.make_error("should be [width, height]");
  camera.imager_px = {imager[0].read_integer({1, 1 << 20}), imager[1].read_integer({1, 1 << 20})};
  camera.lens_model = read_lens_model(map.require("lens_model"));
  camera.intrinsics = read_intrinsics(map.require("intrinsics"), camera.lens_model);
  map.optional("pixel_pitch_m", camera.pixel_pitch_m, Range{1e-7, 1e-4, "m"});
  map.optional("row_time_s", camera.row_time_s, Range{1e-8, 1e-3, "s"});
  if (const auto value = map.find("readout")) camera.readout = read_readout(*value);
  return camera;
}

Calibration read_calibration(const std::filesystem::path& file) {
  YamlMap document = read_yaml_file(file, "vlp-calibration/1");
  Calibration calibration;
  const auto camera = document.require("camera");
  const auto report = document.find("intrinsics_report");
  const auto rotation_center = document.find("rotation_center");
  const auto dispersion = document.find("dispersion");
  const auto adjustment = document.find("adjustment");
  const auto covariance = document.find("joint_covariance");
  const auto history = document.find("history");
  document.check_all_keys_read();
  calibration.camera = camera.convert_mapping(read_camera_from_yaml);
  const auto read_if = [](const auto& value, const auto& read, const auto&... arguments) {
    const auto read_part = [&](YamlMap& map) { return read(map, arguments...); };
    return value ? std::optional(value->convert_mapping(read_part)) : std::nullopt;
  };
  const Eigen::Index intrinsics = count_intrinsics_with_covariance(calibration.camera);
  calibration.intrinsics_report = read_if(report, read_intrinsics_report, intrinsics);
  calibration.adjustment = read_if(adjustment, read_adjustment);
  calibration.rotation_center = read_if(rotation_center, read_rotation_center);
  calibration.dispersion = read_if(dispersion, read_dispersion);
  calibration.covariance = read_if(covariance, read_joint_covariance, calibration);
  if (!history) return calibration;
  for (const YamlValue& item : history->read_list()) {
    calibration.history.push_back(item.convert_mapping(read_history_entry));
    const std::string& part = calibration.history.back().part;
    if ((part == "rotation_center" && !rotation_center) || (part == "dispersion" && !dispersion) ||
        (part == "adjustment" && !adjustment)) {
      throw item.make_error("lists a part '" + part + "': is the file cut short?");
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
  if (calibration.adjustment) emit_adjustment(out, *calibration.adjustment);
  if (calibration.covariance) {
    emit_joint_covariance(out, *calibration.covariance,
                          count_intrinsics_with_covariance(calibration.camera));
  }
  emit_camera(out, calibration.camera);
  out << YAML::EndMap << YAML::Newline;
  return out.c_str();
}

void write_calibration(const std::filesystem::path& file, const Calibration& calibration) {
  write_file(file, format_calibration_yaml(calibration));
}

}  // namespace vlp
