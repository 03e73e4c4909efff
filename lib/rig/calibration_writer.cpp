// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include "rig/calibration_text.h"
#include "rig/file.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

void begin_part(YAML::Emitter& out, const char* key) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
}

/// Required keys come last, see write_calibration().
void emit_camera(YAML::Emitter& out, const Camera& camera) {
  begin_part(out, "camera");
  emit_quoted(out, "id", camera.id);
  if (camera.pixel_pitch_m) emit_number(out, "pixel_pitch_m", *camera.pixel_pitch_m);
  if (camera.row_time_s) emit_number(out, "row_time_s", *camera.row_time_s);
  if (camera.readout) {
    emit_word(out, "readout", *camera.readout == Readout::rows ? "rows" : "columns");
  }
  emit_integers(out, "imager_px", camera.imager_px);
  emit_word(out, "lens_model", to_string(camera.lens_model));
  emit_numbers(out, "intrinsics", camera.intrinsics);
  out << YAML::EndMap;
}

void emit_matrix(YAML::Emitter& out, const char* key, const Eigen::MatrixXd& matrix) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const Eigen::VectorXd numbers = matrix.row(row);
    emit_row(out, {numbers.data(), static_cast<std::size_t>(numbers.size())});
  }
  out << YAML::EndSeq;
}

/// Writes the rows of the lower triangle.
void emit_joint_covariance(YAML::Emitter& out, const Eigen::MatrixXd& covariance) {
  out << YAML::Key << "covariance" << YAML::Value << YAML::BeginSeq;
  for (Eigen::Index row = 0; row < covariance.rows(); ++row) {
    const Eigen::VectorXd numbers = covariance.row(row).head(row + 1);
    emit_row(out, {numbers.data(), static_cast<std::size_t>(numbers.size())});
  }
  out << YAML::EndSeq;
}

void emit_intrinsics_report(YAML::Emitter& out, const IntrinsicsReport& report) {
  begin_part(out, "intrinsics_report");
  emit_integer(out, "views", report.views);
  emit_integer(out, "corners", report.corners);
  emit_integer(out, "outliers", report.outliers);
  emit_number(out, "rms_px", report.rms_px);
  if (report.board_warp_m) emit_numbers(out, "board_warp_m", *report.board_warp_m);
  // Infinite if the lens has no ray, which YAML cannot represent; a gate reports it.
  if (report.expected_max_error_px && std::isfinite(*report.expected_max_error_px)) {
    emit_number(out, "expected_max_error_px", *report.expected_max_error_px);
  }
  if (report.covariance) emit_joint_covariance(out, *report.covariance);
  if (!report.region_px.empty()) {
    out << YAML::Key << "valid_region_px" << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (const Eigen::Vector2d& corner : report.region_px) {
      emit_row(out, std::array{corner.x(), corner.y()});
    }
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
}

void emit_covariance(YAML::Emitter& out, const char* key, const Matrix2& covariance) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginSeq;
  emit_row(out, std::array{covariance(0, 0), covariance(0, 1)});
  emit_row(out, std::array{covariance(1, 0), covariance(1, 1)});
  out << YAML::EndSeq;
}

void emit_rotation_center(YAML::Emitter& out, const RotationCenter& center) {
  begin_part(out, "rotation_center");
  emit_word(out, "model", center.model == RotationModel::tilt ? "tilt" : "shift");
  emit_numbers(out, "center_px", center.center_px);
  emit_numbers(out, "zenith_in_camera", center.zenith_in_camera);
  if (center.covariance) emit_covariance(out, "covariance", *center.covariance);
  if (center.lever_arm_m) emit_numbers(out, "lever_arm_m", *center.lever_arm_m);
  if (center.lever_arm_covariance) {
    emit_covariance(out, "lever_arm_covariance", *center.lever_arm_covariance);
  }
  if (center.by_intrinsics) emit_matrix(out, "jacobian_intrinsics", *center.by_intrinsics);
  if (center.lever_arm_by_zenith) {
    emit_matrix(out, "lever_arm_jacobian_zenith", *center.lever_arm_by_zenith);
  }
  if (center.lever_arm_by_intrinsics) {
    emit_matrix(out, "lever_arm_jacobian_intrinsics", *center.lever_arm_by_intrinsics);
  }
  out << YAML::EndMap;
}

void emit_uncertain_lamps(YAML::Emitter& out, const std::vector<Dispersion::UncertainLamp>& lamps) {
  out << YAML::Key << "by_lamps" << YAML::Value << YAML::BeginSeq;
  for (const auto& [id, position_m, sd_m, by_position] : lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_integer(out, "id", id);
    emit_numbers(out, "position_m", position_m);
    emit_number(out, "sd_m", sd_m);
    emit_matrix(out, "by_position", by_position);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

void emit_dispersion(YAML::Emitter& out, const Dispersion& dispersion) {
  begin_part(out, "dispersion");
  emit_numbers(out, "offset_px", dispersion.offset_px);
  emit_number(out, "radius_m", dispersion.radius_m);
  emit_numbers(out, "center_m", dispersion.center_m);
  emit_integer(out, "captures", dispersion.captures);
  if (dispersion.covariance) emit_covariance(out, "covariance", *dispersion.covariance);
  if (dispersion.by_intrinsics) emit_matrix(out, "jacobian_intrinsics", *dispersion.by_intrinsics);
  if (dispersion.by_zenith) emit_covariance(out, "jacobian_zenith", *dispersion.by_zenith);
  if (!dispersion.by_lamps.empty()) emit_uncertain_lamps(out, dispersion.by_lamps);
  out << YAML::EndMap;
}

void emit_adjustment(YAML::Emitter& out, const Camera& camera, const Adjustment& adjustment) {
  begin_part(out, "adjustment");
  out << YAML::Key << "sets" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& set : adjustment.sets) out << YAML::DoubleQuoted << set;
  out << YAML::EndSeq;
  emit_integer(out, "captures", adjustment.captures);
  emit_integer(out, "detections", adjustment.detections);
  emit_number(out, "residual_px", adjustment.residual_px);
  out << YAML::Key << "lamps" << YAML::Value << YAML::BeginSeq;
  for (const auto& [id, position_m] : adjustment.lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_integer(out, "id", id);
    emit_numbers(out, "position_m", position_m);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::Key << "parameters" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& name : parameter_names(camera, adjustment)) out << name;
  out << YAML::EndSeq;
  emit_joint_covariance(out, adjustment.covariance);
  out << YAML::EndMap;
}

void emit_history(YAML::Emitter& out, const std::vector<HistoryEntry>& history) {
  out << YAML::Key << "history" << YAML::Value << YAML::BeginSeq;
  for (const HistoryEntry& entry : history) {
    out << YAML::BeginMap;
    emit_word(out, "part", entry.part);
    emit_word(out, "program", entry.program);
    emit_quoted(out, "version", entry.version);
    emit_quoted(out, "options", entry.options);
    out << YAML::Key << "inputs" << YAML::Value << YAML::BeginSeq;
    for (const auto& input : entry.inputs) {
      out << YAML::Flow << YAML::BeginMap;
      emit_quoted(out, "file", input.file);
      emit_quoted(out, "sha256", input.sha256);
      out << YAML::EndMap;
    }
    out << YAML::EndSeq << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

}  // namespace

std::string calibration_text(const Calibration& calibration) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  emit_word(out, "format", "vlp-calibration/1");
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
  write_file(file, calibration_text(calibration));
}

}  // namespace vlp
