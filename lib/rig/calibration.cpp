// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "rig/calibration.h"

#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/calibration_error.h"
#include "rig/file.h"
#include "rig/yaml_documents.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr const char* kCalibrationFormat = "vlp-calibration/1";
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Range kResidual{0, kInfinity, "px"};
constexpr Range kCount{1, std::numeric_limits<int>::max()};
/// Largest standard deviation of a pixel, a lens parameter or a position: larger values carry
/// no information, and products of covariances remain finite.
constexpr double kMaxSd = 1e6;
constexpr std::array<std::string_view, 2> kReadouts{"rows", "columns"};
constexpr Words kReadoutWords{kReadouts, "the readout is along ", " or "};
constexpr std::array<std::string_view, 2> kRotationModels{"shift", "tilt"};

/// Rows of a covariance in a file: the lower triangle, from `first_row` on. The rows before are
/// `known`.
struct LowerTriangle {
  Eigen::Index first_row, size;
  const MatrixX* known = nullptr;
};

/// Reads the rows of the lower triangle, 1, 2, 3 ... numbers, after the known rows.
MatrixX read_covariance(const YamlValue& value, const LowerTriangle& part) {
  const auto [first, size, known] = part;
  const auto list = value.read_list();
  if (std::ssize(list) != size - first) {
    throw value.make_error("should be " + std::to_string(size - first) + " rows of " +
                           std::to_string(first + 1) + ", " + std::to_string(first + 2) +
                           " ... numbers, the lower triangle");
  }
  // All numbers are read first, so that the matrix is not larger than the file.
  std::vector<std::vector<double>> rows;
  rows.reserve(list.size());
  for (const YamlValue& item : list)
    rows.push_back(item.read_numbers(static_cast<std::size_t>(first) + rows.size() + 1));
  Eigen::MatrixXd matrix(size, size);
  if (first > 0) matrix.topLeftCorner(first, first) = *known;
  for (Eigen::Index row = first; row < size; ++row) {
    const auto index = static_cast<std::size_t>(row - first);
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

/// Checks that the parameters are parts of the calibration, in their order.
void check_parameters(const JointCovariance& joint, const Calibration& calibration,
                      const YamlField& field) {
  std::size_t next = 0;
  const auto is_next = [&](const std::string& name) {
    return next < joint.parameters.size() && joint.parameters[next] == name;
  };
  const auto pass = [&](std::span<const std::string> names) {
    for (const std::string& name : names) {
      // [FILE-4] `is missing in its place`
      field.check(is_next(name), name + " is missing in its place");
      ++next;
    }
  };
  const auto& report = calibration.intrinsics_report;
  if (const auto names = list_intrinsics_names(calibration.camera); is_next(names.front())) {
    pass(names);
    field.check(report && report->covariance,
                "has the lens, and intrinsics_report has no covariance");
  }
  const auto pass_pair = [&](std::string_view name, bool is_known) {
    if (!is_next(std::string(name))) return;
    pass(list_pair_names(name));
    // [FILE-4] `which the calibration does not have`
    field.check(is_known, "has " + std::string(name) + ", which the calibration does not have");
  };
  pass_pair(kZenithParameter, calibration.rotation_center.has_value());
  pass_pair(kLeverArmParameter, calibration.rotation_center.has_value());
  for (const auto& lamp : joint.lamps) pass(list_lamp_parameters(lamp.id));
  pass_pair(kOffsetParameter, calibration.dispersion.has_value());
  if (next == joint.parameters.size()) return;
  // [FILE-4] `is not in its place`
  field.item(next).check(
      false, "is not in its place: the order is lens, zenith, lever arm, lamps, offset");
}

/// Checks that the file has the parts that its history lists.
void check_history(const Calibration& calibration, const YamlField& field) {
  for (std::size_t i = 0; i < calibration.history.size(); ++i) {
    const std::string& part = calibration.history[i].part;
    if ((part == "rotation_center" && !calibration.rotation_center) ||
        (part == "dispersion" && !calibration.dispersion) ||
        (part == "adjustment" && !calibration.adjustment)) {
      field.item(i).check(false, "lists a part '" + part + "': is the file cut short?");
    }
  }
}

}  // namespace

template <>
inline constexpr bool kSpansLines<HistoryEntry> = true;

static void read_value(const YamlValue& value, LensModel& target) {
  const auto model = lens_model_from_name(value.read_text());
  if (!model) throw value.make_word_error("the models are: " + list_lens_model_names());
  target = *model;
}

static void write_value(YamlWriter& out, LensModel model) {
  out << std::string(lens_model_name(model));
}

static void read_value(const YamlValue& value, std::array<int, 2>& target, const Range& range) {
  const auto sides = value.read_list();
  if (sides.size() != 2) throw value.make_error("should be [width, height]");
  target = {sides[0].read_integer(range), sides[1].read_integer(range)};
}

static void read_value(const YamlValue& value, std::array<double, 2>& target) {
  const auto numbers = value.read_numbers(2);
  target = {numbers[0], numbers[1]};
}

static void read_value(const YamlValue& value, MatrixX& target, const LowerTriangle& part) {
  target = read_covariance(value, part);
}

static void write_value(YamlWriter& out, const MatrixX& covariance, const LowerTriangle& part) {
  out << YAML::BeginSeq;
  for (Eigen::Index row = part.first_row; row < covariance.rows(); ++row)
    write_list(out, Eigen::VectorXd(covariance.row(row).head(row + 1)));
  out << YAML::EndSeq;
}

template <typename Io>
void describe(Io& io, Described<Io, Camera> camera) {
  io.required("id", camera.id);
  io.optional("pixel_pitch_m", camera.pixel_pitch_m, Range{1e-7, 1e-4, "m"});
  io.optional("row_time_s", camera.row_time_s, Range{1e-8, 1e-3, "s"});
  io.optional("readout", camera.readout, kReadoutWords);
  io.required("imager_px", camera.imager_px, Range{1, 1 << 20});
  io.required("lens_model", camera.lens_model);
  const auto intrinsics =
      io.required("intrinsics", camera.intrinsics, num_lens_parameters(camera.lens_model));
  if constexpr (Io::is_reader) {
    intrinsics.check(camera.focal_px().minCoeff() > 0,
                     "the focal lengths, the first two, should be positive");
  }
}

template void describe<YamlMap>(YamlMap& io, Camera& camera);

template <typename Io>
static void describe(Io& io, Described<Io, IntrinsicsReport> report, const Camera& camera) {
  io.required("views", report.views);
  io.required("corners", report.corners);
  io.required("outliers", report.outliers);
  io.required("rms_px", report.rms_px, kResidual);
  io.optional("board_warp_m", report.board_warp_m);
  // Infinite if the lens has no ray, which YAML cannot represent; a gate reports it.
  if (Io::is_reader || std::isfinite(report.expected_max_error_px.value_or(0)))
    io.optional("expected_max_error_px", report.expected_max_error_px, kResidual);
  io.optional("covariance", report.covariance, LowerTriangle{0, count_intrinsics(camera)});
  io.optional("valid_region_px", report.region_px)
      .check(report.region_px.size() >= 3, "should have three corners or more");
}

template <typename Io>
static void refuse_covariance(Io& io, const std::string& program) {
  io.refuse("covariance", "key 'covariance' is now in joint_covariance: run " + program +
                              " again on the calibration from before it");
}

template <typename Io>
static void describe(Io& io, Described<Io, RotationCenter> center) {
  refuse_covariance(io, "vlp-rotation");
  io.required("model", center.model, Words{kRotationModels, "the models are: "});
  io.required("center_px", center.center_px);
  // Six digits, as typed by a person, suffice.
  io.required("zenith_in_camera", center.zenith_in_camera)
      .check(
          std::abs(center.zenith_in_camera.norm() - 1) <= 1e-5 && center.zenith_in_camera.z() > 0,
          "should be a unit vector with z > 0");
  io.optional("lever_arm_m", center.lever_arm_m);
}

template <typename Io>
static void describe(Io& io, Described<Io, Dispersion> dispersion) {
  refuse_covariance(io, "vlp-dispersion");
  io.required("offset_px", dispersion.offset_px);
  io.required("radius_m", dispersion.radius_m, Range{0, kInfinity, "m"});
  io.required("center_m", dispersion.center_m);
  io.required("captures", dispersion.captures, kCount);
}

template <typename Io>
static void describe(Io& io, Described<Io, Adjustment> adjustment) {
  refuse_covariance(io, "vlp-adjust");
  io.required("sets", adjustment.sets);
  io.required("captures", adjustment.captures, kCount);
  io.required("detections", adjustment.detections, kCount);
  io.required("residual_px", adjustment.residual_px, kResidual);
}

template <typename Io>
static void describe(Io& io, Described<Io, JointCovariance::LampPosition> lamp) {
  io.required("id", lamp.id);
  io.required("position_m", lamp.position_m);
}

template <typename Io>
static void describe(Io& io, Described<Io, JointCovariance> joint, const Calibration& calibration) {
  io.required("lamps", joint.lamps);
  const auto parameters = io.required("parameters", joint.parameters, PlainText());
  if constexpr (Io::is_reader) check_parameters(joint, calibration, parameters);
  LowerTriangle part{0, std::ssize(joint.parameters)};
  const auto& report = calibration.intrinsics_report;
  if (joint.find_row("fx")) {
    part.first_row = count_intrinsics(calibration.camera);
    if (report && report->covariance) part.known = &*report->covariance;
  }
  io.required("rows", joint.matrix, part);
}

template <typename Io>
static void describe(Io& io, Described<Io, HistoryEntry::Input> input) {
  io.required("file", input.file);
  io.required("sha256", input.sha256);
}

template <typename Io>
static void describe(Io& io, Described<Io, HistoryEntry> entry) {
  io.required("part", entry.part, PlainText());
  io.required("program", entry.program, PlainText());
  io.required("version", entry.version);
  io.required("options", entry.options);
  io.required("inputs", entry.inputs);
}

template <typename Io>
static void describe(Io& io, Described<Io, Calibration> calibration) {
  io.required_last("camera", calibration.camera);
  const auto history = io.optional("history", calibration.history);
  io.optional("intrinsics_report", calibration.intrinsics_report, calibration.camera);
  io.optional("rotation_center", calibration.rotation_center);
  io.optional("dispersion", calibration.dispersion);
  io.optional("adjustment", calibration.adjustment);
  io.optional("joint_covariance", calibration.covariance, calibration);
  if constexpr (Io::is_reader) check_history(calibration, history);
}

Calibration read_calibration(const std::filesystem::path& file) {
  return read_yaml_document<Calibration>(file, kCalibrationFormat);
}

std::string format_calibration(const Calibration& calibration) {
  return format_document(kCalibrationFormat, calibration);
}

void write_calibration(const std::filesystem::path& file, const Calibration& calibration) {
  write_file(file, format_calibration(calibration));
}

}  // namespace vlp
