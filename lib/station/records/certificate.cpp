// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/certificate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "captures/digest.h"
#include "captures/number_text.h"
#include "report/calibration_sections.h"
#include "report/html.h"
#include "rig/calibration_error.h"
#include "rig/input_error.h"
#include "station/records/publish_run.h"

namespace vlp {
namespace {

constexpr double kCoverage = 2;
constexpr int kSixDigits = 6;

using Values = std::vector<CertifiedValue>;

/// Adds x and y with the standard deviations of a covariance.
template <typename Covariance>
void add_x_and_y_values(Values& values, const std::string& name, const std::string& unit,
                        const Eigen::Vector2d& pair, const std::optional<Covariance>& covariance,
                        double scale = 1, Eigen::Index first = 0) {
  for (const Eigen::Index i : {0, 1}) {
    std::optional<double> sd;
    if (covariance) sd = scale * std::sqrt((*covariance)(first + i, first + i));
    values.push_back({name + (i == 0 ? " x" : " y"), unit, scale * pair(i), sd});
  }
}

std::string append_unit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + "\u00a0" + unit;
}

std::string make_verdict_section(const RunRecord& record) {
  const bool conforms = record.has_run_passed();
  const std::string words = conforms ? "The unit conforms with all requirements below."
                                     : "The unit does not conform: " + record.first_cause() + ".";
  return std::string("<div class=\"verdict ") + (conforms ? "pass" : "fail") + "\"><strong>" +
         escape_html_text(record.verdict) + "</strong>" + make_html_element("p", words) +
         "</div>\n";
}

std::string make_subject_section(const RunRecord& record, const Calibration& calibration) {
  const auto& [width_px, height_px] = calibration.camera.imager_px;
  return make_html_table(
      {"",
       {},
       {{"certificate number", record.run},
        {"unit", "camera " + record.camera},
        {"image", fmt::format("{} x {} px", width_px, height_px)},
        {"measured at", record.station},
        {"operator", record.operator_name.empty() ? "\u00a0" : record.operator_name},
        {"started (UTC)", record.begun_utc},
        {"ended (UTC)", record.ended_utc},
        {"procedure",
         "lens from views of a board; rotation center and tilt from a rotation in "
         "place; dispersion at one reference point; check at known points"},
        {"program", record.program},
        {"libraries", record.libraries},
        {"images",
         fmt::format("{} taken, {} used", record.images.size(), record.count_used_images())}}});
}

/// Makes the matrix of the correlations of lens, zenith, lever arm and dispersion offset; empty
/// without a covariance. Quantities taken as exact have none.
std::string make_correlation_table(const Calibration& calibration) {
  if (!calibration.covariance) return "";
  const auto& [lamps, parameters, covariance] = *calibration.covariance;
  HtmlTable table{"Correlations of the errors", {""}, {}};
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    const std::string& name = parameters[static_cast<std::size_t>(i)];
    if (!(covariance(i, i) > 0) || name.starts_with("lamp_")) continue;
    rows.push_back(i);
    std::vector<std::string> cells{name};
    for (const Eigen::Index j : rows) {
      cells.push_back(format_fixed_decimals(
          covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j)), 2));
    }
    table.header.push_back(name);
    table.rows.push_back(std::move(cells));
  }
  for (auto& cells : table.rows) cells.resize(table.header.size());
  return rows.empty() ? "" : make_html_table(table);
}

/// Describes the inputs that the uncertainty includes, and those that are assumed exact.
std::string describe_inputs(const RunRecord& record, const Calibration& calibration) {
  const CheckedMetric* print = record.find_metric("board_print_px");
  const auto& report = calibration.intrinsics_report;
  if (print == nullptr || !print->value || !report || !report->covariance) {
    return "The board and the known points are assumed to be exact.";
  }
  return fmt::format(
      "That of the focal length and the principal point includes the print of the board, as far as "
      "board.yaml states it: {:.3g} px, rms over the image, for one standard deviation. The known "
      "points are taken as exact.",
      *print->value);
}

std::string make_results_section(const RunRecord& record, const Calibration& calibration) {
  HtmlTable table{"", {"quantity", "value and expanded uncertainty"}, {}};
  for (const CertifiedValue& value : list_certified_values(calibration)) {
    table.rows.push_back({value.name, format_value_with_expanded_uncertainty(value)});
  }
  const std::string lens(lens_model_name(calibration.camera.lens_model));
  return make_html_table(table) +
         make_html_element(
             "p",
             "Lens model " + lens +
                 "; all its parameters are in the unit's calibration.yaml. The "
                 "expanded uncertainty is the standard uncertainty times k = 2, for "
                 "about 95 % of a normal distribution. It includes the scatter of the "
                 "captures, the lamp map as far as lamps.yaml states its sd_m, and the lens. " +
                 describe_inputs(record, calibration)) +
         make_correlation_table(calibration);
}

/// Returns "rms_px: residuals of the board's corners, ..." for readers of the certificate only.
std::string describe_requirement(const std::string& metric) {
  const auto kind = find_metric_kind(metric);
  return kind ? metric + ": " + kind->description : metric;
}

/// Makes the table of the gates: metric, limit, and conformity with its decision rule.
std::string make_conformity_table(const RunRecord& record) {
  HtmlTable table{"", {"requirement", "value", "limit", "accepted", "conforms", "rule"}, {}};
  constexpr int digits = 4, probability_digits = 3;
  for (const CheckedMetric& metric : record.metrics) {
    if (!metric.limit) continue;
    std::string measured = metric.value ? format_digits(*metric.value, digits) : "none";
    std::string rule = "simple", outcome = metric.has_passed_gate() ? "yes" : "no";
    if (const auto& guard = metric.guard_band) {
      if (metric.value) {
        measured = format_value_with_expanded_uncertainty(
            CertifiedValue{"", metric.unit, *metric.value, guard->standard_uncertainty});
      }
      rule = fmt::format("guard band of {:.4g} u", guard->k);
      if (const auto sure = metric.conformance_probability()) {
        outcome += ", p = " + format_digits(*sure, probability_digits);
      }
    } else if (metric.value) {
      measured = append_unit(measured, metric.unit);
    }
    if (!metric.has_passed_gate()) table.highlighted_rows.push_back(table.rows.size());
    table.rows.push_back(
        {describe_requirement(metric.name), measured,
         describe_direction(metric.direction) + " " +
             append_unit(format_digits(*metric.limit, digits), metric.unit),
         append_unit(format_digits(metric.acceptance_limit(), digits), metric.unit), outcome,
         rule});
  }
  return make_html_table(table) +
         make_html_element(
             "p",
             "Decision rules: \"simple\" compares the value with the limit without its "
             "uncertainty, which is not stated, so that half of the units exactly at the limit are "
             "accepted; a guard band of k u subtracts k times the standard uncertainty from the "
             "limit (ISO 14253-1, JCGM 106:2012). p is the probability that the true value is "
             "within the limit.");
}

/// Returns the digest of the names and digests of the images that a step used, empty without any.
std::string digest_images(const RunRecord& record, const std::string& step) {
  std::string text;
  for (const RunRecord::Image& image : record.images) {
    if (image.step == step && image.rejection.empty())
      text += image.name + " " + image.sha256 + "\n";
  }
  return text.empty() ? "" : hash_text(text);
}

std::string make_traceability_section(const RunRecord& record, const Calibration& calibration) {
  const std::string check = digest_images(record, "check");
  return make_html_element(
             "p",
             "Digests (SHA-256) of the data behind the results. \"station\" is the "
             "configuration with the camera's type, the board and the lamp map, whose own "
             "certificates belong to this one: " +
                 record.config_sha256 + "." +
                 (check.empty() ? ""
                                : " \"check\", the list of names and digests of the "
                                  "images at the known points: " +
                                      check + ".")) +
         make_history_list(calibration.history);
}

/// Makes the part with the data that a record does not contain.
std::string make_section_of_missing_data() {
  HtmlTable table{"", {}, {}};
  for (const char* line : {"laboratory, address", "customer", "temperature, humidity",
                           "certificates of board and lamp map", "issued by, date"}) {
    table.rows.push_back({line, "\u00a0"});
  }
  return make_html_table(table) + "<div class=\"signature\">signature</div>\n" +
         make_html_element("p", "The results relate only to this unit as measured.");
}

}  // namespace

std::vector<CertifiedValue> list_certified_values(const Calibration& calibration) {
  constexpr double millimeters = 1e3, degrees = 180 / std::numbers::pi;
  const std::vector<double>& k = calibration.camera.intrinsics;
  const auto& lens = calibration.intrinsics_report;
  const std::optional<MatrixX> lens_covariance = lens ? lens->covariance : std::nullopt;
  Values values;
  add_x_and_y_values(values, "focal length", "px", {k[0], k[1]}, lens_covariance);
  add_x_and_y_values(values, "principal point", "px", {k[2], k[3]}, lens_covariance, 1, 2);
  if (const auto& center = calibration.rotation_center) {
    add_x_and_y_values(values, "rotation center, undistorted image", "px", center->center_px,
                       compute_center_covariance(calibration));
    add_x_and_y_values(values, "zenith from the optical axis, 180/pi times its normalized point",
                       "deg", compute_zenith_point(*center),
                       find_parameter_covariance(calibration, kZenithParameter), degrees);
    if (center->lever_arm_m) {
      add_x_and_y_values(values, "lever arm", "mm", *center->lever_arm_m,
                         find_parameter_covariance(calibration, kLeverArmParameter), millimeters);
    }
  }
  if (const auto& dispersion = calibration.dispersion) {
    add_x_and_y_values(values, "dispersion offset", "px", dispersion->offset_px,
                       compute_offset_covariance(calibration));
  }
  return values;
}

std::string format_value_with_expanded_uncertainty(const CertifiedValue& value) {
  const double expanded = kCoverage * value.standard_uncertainty.value_or(0);
  if (!(expanded > 0) || !std::isfinite(expanded)) {
    return append_unit(format_digits(value.value, kSixDigits), value.unit) +
           ", uncertainty not stated";
  }
  constexpr double ten = 10, two_digits = 100;
  constexpr int max_places = 12;
  int exponent = static_cast<int>(std::floor(std::log10(expanded)));
  // 0.0996 is 0.10.
  if (std::round(expanded * std::pow(ten, 1 - exponent)) >= two_digits) ++exponent;
  const int places = std::clamp(1 - exponent, 0, max_places);
  return append_unit(format_fixed_decimals(value.value, places) + " \u00b1 " +
                         format_fixed_decimals(expanded, places),
                     value.unit);
}

void check_certifiable(const RunRecord& record) {
  const auto none = [&](const std::string& why) {
    return InputError(record.run, why + ": it has no certificate");
  };
  if (record.kind != "unit") throw none("is a run of the golden unit, which measures the station");
  const std::string no_verdict = explain_void_verdict(record);
  if (!no_verdict.empty()) throw none(no_verdict);
  if (record.is_verdict_invalid()) throw none("was not judged (" + record.first_cause() + ")");
  if (record.calibration.empty()) throw none("has no calibration");
}

std::string make_certificate(const RunRecord& record, const Calibration& calibration) {
  check_certifiable(record);
  return make_html_page(
      "Calibration certificate: camera " + record.camera,
      make_verdict_section(record) +
          make_html_section("Unit and calibration", make_subject_section(record, calibration)) +
          make_html_section("Results", make_results_section(record, calibration)) +
          make_html_section("Statement of conformity", make_conformity_table(record)) +
          make_html_section("Traceability", make_traceability_section(record, calibration)) +
          make_html_section("To be completed by the issuer", make_section_of_missing_data()));
}

std::filesystem::path write_certificate(const RunRecord& record,
                                        const std::filesystem::path& results) {
  check_certifiable(record);
  const std::filesystem::path calibration =
      publish_run_files(record, {}, results) / calibration_file_name(record);
  const SharedFolder folder = open_run_results(record, results);
  constexpr const char* name = "certificate.html";
  folder.replace_file(name, make_certificate(record, read_calibration(calibration)));
  return folder.folder_path() / name;
}

}  // namespace vlp
