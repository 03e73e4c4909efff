// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/calibration_sections.h"

#include <cmath>

#include "captures/number_text.h"
#include "geometry/angles.h"
#include "report/html.h"
#include "rig/calibration_error.h"

namespace vlp {
namespace {

std::string format_six_digits(double value) { return format_digits(value, 6); }

/// Formats a standard deviation.
std::string format_sd(double value) { return format_digits(value, 2); }

std::string format_pair(const Eigen::Vector2d& values, const std::string& unit) {
  return format_six_digits(values.x()) + ", " + format_six_digits(values.y()) + " " + unit;
}

/// Returns "; standard deviation 0.1, 0.2 px" for a pair; empty without a covariance.
std::string format_sds(const std::optional<Matrix2>& covariance, double scale,
                       const std::string& unit) {
  if (!covariance) return "";
  const auto sd = [&](int i) { return format_sd(scale * std::sqrt((*covariance)(i, i))); };
  return "; standard deviation " + sd(0) + ", " + sd(1) + " " + unit;
}

}  // namespace

std::string make_camera_table(const Camera& camera) {
  HtmlTable table;
  const auto add_row = [&](const char* label, std::string value) {
    table.rows.push_back({label, std::move(value)});
  };
  const auto& [width_px, height_px] = camera.imager_px;
  if (!camera.id.empty()) add_row("camera", camera.id);
  add_row("image", std::to_string(width_px) + " x " + std::to_string(height_px) + " px");
  add_row("lens model", std::string(lens_model_name(camera.lens_model)));
  const std::vector<double>& k = camera.intrinsics;
  add_row("focal length", format_pair({k[0], k[1]}, "px"));
  add_row("principal point", format_pair({k[2], k[3]}, "px"));
  std::string distortion;
  for (std::size_t i = 4; i < k.size(); ++i) {
    distortion.append(i > 4 ? ", " : "").append(format_six_digits(k[i]));
  }
  if (!distortion.empty()) add_row("distortion", distortion);
  if (camera.pixel_pitch_m)
    add_row("pixel pitch", format_six_digits(1e6 * *camera.pixel_pitch_m) + " um");
  if (camera.row_time_s) add_row("row time", format_six_digits(1e6 * *camera.row_time_s) + " us");
  if (camera.readout) add_row("readout", *camera.readout == Readout::rows ? "rows" : "columns");
  return make_html_table(table);
}

std::string make_intrinsics_table(const IntrinsicsReport& report) {
  HtmlTable table{"Lens calibration", {}, {}};
  if (report.views > 0) {
    table.rows = {{"views of the board", std::to_string(report.views)},
                  {"corners", std::to_string(report.corners)},
                  {"outliers", std::to_string(report.outliers)},
                  {"residual, rms per axis", format_digits(report.rms_px, 3) + " px"}};
  }
  if (report.expected_max_error_px) {
    table.rows.push_back({"largest error of the projection that is to be expected",
                          format_digits(*report.expected_max_error_px, 3) + " px"});
  }
  if (!report.region_px.empty()) {
    table.rows.push_back({"known", "in the valid region (valid_region_px) only"});
  }
  if (report.board_warp_m) {
    const auto& [x_m, y_m] = *report.board_warp_m;
    table.rows.push_back(
        {"deflection of the board along x, y",
         format_digits(1e3 * x_m, 3) + ", " + format_digits(1e3 * y_m, 3) + " mm"});
  }
  return make_html_table(table);
}

std::string make_rotation_table(const Calibration& calibration) {
  const RotationCenter& center = *calibration.rotation_center;
  const Eigen::Vector3d& up = center.zenith_in_camera;
  const double tilt_rad = std::atan2(up.head<2>().norm(), up.z());
  HtmlTable table{"",
                  {},
                  {{"rotation center in the undistorted image",
                    format_pair(center.center_px, "px") +
                        format_sds(compute_center_covariance(calibration), 1, "px")},
                   {"tilt of the camera", format_digits(deg_from_rad(tilt_rad), 4) + " degrees"},
                   {"correction", center.model == RotationModel::tilt ? "tilt" : "shift"}}};
  if (center.lever_arm_m) {
    table.rows.push_back(
        {"from the axis of rotation to the camera",
         format_pair(1e3 * *center.lever_arm_m, "mm") +
             format_sds(find_parameter_covariance(calibration, kLeverArmParameter), 1e3, "mm")});
  }
  return make_html_table(table);
}

std::string make_dispersion_table(const Calibration& calibration) {
  const Dispersion& dispersion = *calibration.dispersion;
  const auto mm = [](double value_m) { return format_digits(1e3 * value_m, 3); };
  return make_html_table(
      {"",
       {},
       {{"captures at the reference point", std::to_string(dispersion.captures)},
        {"radius of the circle before", mm(dispersion.radius_m) + " mm"},
        {"its center from the reference point",
         mm(dispersion.center_m.x()) + ", " + mm(dispersion.center_m.y()) + " mm"},
        {"offset subtracted from the image",
         format_pair(dispersion.offset_px, "px") +
             format_sds(compute_offset_covariance(calibration), 1, "px")}}});
}

std::string make_history_list(const std::vector<HistoryEntry>& entries) {
  constexpr std::size_t max_unfolded = 8;
  std::string html;
  for (const auto& entry : entries) {
    html += entry.inputs.size() > max_unfolded ? "<details>\n" : "<details open>\n";
    html += make_html_element("summary", entry.part + ": " + entry.program + " " + entry.version +
                                             ", " + std::to_string(entry.inputs.size()) +
                                             (entry.inputs.size() == 1 ? " input" : " inputs"));
    if (!entry.options.empty()) {
      html += "<p>Options: <code>" + escape_html_text(entry.options) + "</code></p>\n";
    }
    HtmlTable table{"", {"input", "SHA-256"}, {}};
    for (const auto& [file, sha256] : entry.inputs) table.rows.push_back({file, sha256});
    if (!table.rows.empty())
      html += "<div class=\"digests\">\n" + make_html_table(table) + "</div>\n";
    html += "</details>\n";
  }
  return html;
}

}  // namespace vlp
