// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/lights_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "codecs/codecs.h"
#include "rig/file.h"

namespace vlp {
namespace {

std::string_view outline_name(const Light& light) {
  if (light.kind == LightKind::no_outline) return "";
  switch (light.outline_kind) {
    case LightOutline::none:
      return "glow";
    case LightOutline::edge:
      return "edge";
    case LightOutline::rim:
      return "rim";
    case LightOutline::rectangle:
      return "rectangle";
  }
  return "";
}

template <typename Names, typename Enumerator>
std::string_view enumerator_name(const Names& names, Enumerator enumerator) {
  return std::ranges::find(names, enumerator, &Names::value_type::first)->second;
}

std::string lamp_name(const Light& light) { return light.lamp ? std::to_string(*light.lamp) : ""; }

}  // namespace

int count_lights(std::span<const Observation> images, LightKind kind) {
  std::ptrdiff_t count = 0;
  for (const Observation& image : images) {
    count += std::count_if(image.lights.begin(), image.lights.end(),
                           [&](const Light& light) { return light.kind == kind; });
  }
  return static_cast<int>(count);
}

std::vector<CountedReason> count_rejected_lights(std::span<const Observation> images) {
  std::map<std::pair<LightKind, LightReason>, int> counts;
  for (const Observation& image : images) {
    for (const Light& light : image.lights) {
      if (!light.lamp) ++counts[{light.kind, light.reason}];
    }
  }
  std::vector<CountedReason> reasons;
  reasons.reserve(counts.size());
  for (const auto& [what, count] : counts) reasons.push_back({what.first, what.second, count});
  std::stable_sort(reasons.begin(), reasons.end(),
                   [](const CountedReason& a, const CountedReason& b) {
                     const bool form_a = a.kind != LightKind::no_outline;
                     const bool form_b = b.kind != LightKind::no_outline;
                     return form_a != form_b ? form_a : a.lights > b.lights;
                   });
  return reasons;
}

std::string_view light_kind_name(LightKind kind) {
  constexpr std::array<std::pair<LightKind, std::string_view>, 5> names{
      {{LightKind::lamp, "lamp"},
       {LightKind::truncated, "cut"},
       {LightKind::unknown, "unknown"},
       {LightKind::unmodulated, "steady"},
       {LightKind::no_outline, "no_outline"}}};
  return enumerator_name(names, kind);
}

std::string_view light_reason_name(LightReason reason) {
  constexpr std::array<std::pair<LightReason, std::string_view>, 9> names{
      {{LightReason::identified, "identified"},
       // [LAMP-2] `overexposed` | most pixels of the light at full scale | expose shorter
       {LightReason::overexposed, "overexposed"},
       // [LAMP-3] `steady` | not modulated, or exposure too long | expose shorter
       {LightReason::unmodulated, "steady"},
       // [LAMP-4] `too_few_periods` | too small, too far or too slow | go nearer, or raise the
       //   frequency
       {LightReason::too_few_periods, "too_few_periods"},
       // [LAMP-5] `no_clear_period` | object, letters or pattern in front, or wrong readout |
       //   `--readout`
       {LightReason::no_clear_period, "no_clear_period"},
       // [LAMP-6] `unknown_period` | wrong frequency, row time, readout or classifier; or a light
       //   outside the map | correct the wrong value
       {LightReason::unknown_period, "unknown_period"},
       // [LAMP-7] `reflection` | mirror image; lamp out of focus, or less than twice as large and
       //   bright as its mirror image; two lamps of one frequency | focus, cover the mirror,
       //   separate the frequencies
       {LightReason::reflection, "reflection"},
       // [LAMP-8] `wrong_shape` | lamp partly covered or touched by another light; wrong shape or
       //   size in the map | uncover it, or correct the map
       {LightReason::wrong_shape, "wrong_shape"},
       // [LAMP-9] `incomplete` | not wholly in view, or too small | aim at it, or go nearer
       {LightReason::incomplete, "incomplete"}}};
  return enumerator_name(names, reason);
}

std::string describe_light_reason(LightReason reason) {
  switch (reason) {
    case LightReason::identified:
      return "its stripes match this lamp";
    case LightReason::overexposed:
      return "most of it is overexposed: if it is a lamp, expose shorter";
    case LightReason::unmodulated:
      return fmt::format("its lines differ by less than {:.0f} %: if it is a lamp, expose shorter",
                         100 * kMinContrast);
    case LightReason::too_few_periods:
      return fmt::format(
          "it shows less than {} periods, or less than {} without a lamp of more periods in the "
          "image: if it is a lamp, move nearer, or use a higher frequency",
          kMinPeriods, kMinReliablePeriods);
    case LightReason::no_clear_period:
      return "it shows no clear period: if it is a lamp, uncover it, and check the readout "
             "direction";
    case LightReason::unknown_period:
      return "its period matches no lamp, or several: check frequencies, row time, readout "
             "direction and, if used, the classifier";
    case LightReason::reflection:
      return "it is more blurred than the lamps, or another light has the same period: if it is a "
             "lamp, focus, cover the mirror, or use separate frequencies";
    case LightReason::wrong_shape:
      return "its outline matches no lamp of the map: if it is a lamp, uncover it, separate it "
             "from other lights, and check its shape in the map";
    case LightReason::incomplete:
      return "the image's edge cuts it, or it is too small for an outline: if it is a lamp, aim so "
             "that it is in view, or go nearer";
  }
  return {};
}

std::string describe_light(const Light& light) {
  std::string line = fmt::format("({:.1f}, {:.1f}) {}", light.pixel.x(), light.pixel.y(),
                                 light_kind_name(light.kind));
  if (light.lamp) line += fmt::format(" {}", *light.lamp);
  line +=
      fmt::format(": {}; radius {:.1f} px", describe_light_reason(light.reason), light.radius_px);
  if (light.kind == LightKind::no_outline) return line;
  const Stripes& stripes = light.stripes;
  line += fmt::format(
      ", {} {:.0f} % {}, contrast {:.2f}", outline_name(light), 100 * light.inlier_fraction,
      light.outline_kind == LightOutline::rectangle ? "straight" : "round", stripes.contrast);
  if (!(stripes.period_lines > 0)) return line;
  return line +
         fmt::format(", {:.1f} periods of {:.2f} lines, periodicity_r2 {:.2f}, coherence {:.2f}",
                     stripes.periods, stripes.period_lines, stripes.periodicity_r2,
                     stripes.coherence);
}

void write_lights_table(const std::filesystem::path& file, std::span<const Observation> images) {
  CsvWriter csv(file, {"image", "kind", "reason", "lamp", "u_px", "v_px", "sigma_px", "radius_px",
                       "outline", "edge_rise_px", "inlier_fraction", "contrast", "period_lines",
                       "periods", "periodicity_r2", "coherence", "duty"});
  const auto number_if = [](bool there, double value) {
    return there ? format_fixed_decimals(value, 4) : "";
  };
  for (const Observation& image : images) {
    for (const Light& light : image.lights) {
      const Stripes& stripes = light.stripes;
      const bool form = light.kind != LightKind::no_outline;
      const bool striped = form && stripes.period_lines > 0;
      csv.write_csv_row(
          {image.image_file_name(), light_kind_name(light.kind), light_reason_name(light.reason),
           lamp_name(light), format_fixed_decimals(light.pixel.x(), 4),
           format_fixed_decimals(light.pixel.y(), 4), number_if(form, light.sigma_px),
           format_fixed_decimals(light.radius_px, 4), outline_name(light),
           number_if(form, light.rise_px), number_if(form, light.inlier_fraction),
           number_if(form, stripes.contrast), number_if(striped, stripes.period_lines),
           number_if(striped, stripes.periods), number_if(striped, stripes.periodicity_r2),
           number_if(striped, stripes.coherence), number_if(striped, stripes.duty)});
    }
  }
  csv.save_file();
}

namespace {

/// Number of fractional bits of OpenCV's drawing coordinates.
constexpr int kShift = 8;

cv::Scalar choose_color(LightKind kind) {
  static const std::map<LightKind, cv::Scalar> colors{{LightKind::lamp, {80, 255, 80}},
                                                      {LightKind::truncated, {0, 220, 255}},
                                                      {LightKind::unknown, {60, 60, 255}},
                                                      {LightKind::unmodulated, {255, 160, 60}},
                                                      {LightKind::no_outline, {170, 170, 170}}};
  return colors.at(kind);
}

std::string make_label(const Light& light) {
  if (light.kind != LightKind::lamp && light.kind != LightKind::truncated) {
    return fmt::format("{}: {}", light_kind_name(light.kind), light_reason_name(light.reason));
  }
  return std::to_string(*light.lamp) + (light.kind == LightKind::truncated ? " cut" : "");
}

cv::Point to_fixed_point(const Eigen::Vector2d& pixel) {
  constexpr double unit = 1 << kShift;
  return {static_cast<int>(std::lround(pixel.x() * unit)),
          static_cast<int>(std::lround(pixel.y() * unit))};
}

/// Converts an image to color and brightens it, so that dark surroundings are visible.
cv::Mat brighten_image(const cv::Mat& image) {
  constexpr double gamma = 0.5;
  const double white = image.depth() == CV_8U ? 255 : 65535;
  cv::Mat levels, result;
  image.convertTo(levels, CV_32F, 1 / white);
  cv::pow(levels, gamma, levels);
  levels.convertTo(result, CV_8U, 255);
  cv::cvtColor(result, result, cv::COLOR_GRAY2BGR);
  return result;
}

/// Draws a text next to a light, on the side with enough space.
void draw_label(cv::Mat& annotated_image, const Light& light, double size) {
  const std::string label = make_label(light);
  const int thickness = static_cast<int>(std::lround(size));
  const double scale = 0.5 * size;
  const cv::Size box = cv::getTextSize(label, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, nullptr);
  const int gap = static_cast<int>(3 * size);
  int left = static_cast<int>(light.box.max().x()) + gap;
  if (left + box.width > annotated_image.cols)
    left = static_cast<int>(light.box.min().x()) - gap - box.width;
  const int bottom = std::clamp(static_cast<int>(light.pixel.y()) + box.height / 2, box.height,
                                std::max(box.height, annotated_image.rows - 1));
  cv::putText(annotated_image, label, {std::max(0, left), bottom}, cv::FONT_HERSHEY_SIMPLEX, scale,
              choose_color(light.kind), thickness, cv::LINE_AA);
}

}  // namespace

cv::Mat annotate_image(const cv::Mat& image, const std::vector<Light>& lights) {
  cv::Mat annotated_image = brighten_image(image);
  const double size = std::max(1.0, annotated_image.cols / 1000.0);  // of letters and crosses
  const int thickness = static_cast<int>(std::lround(size));
  for (const Light& light : lights) {
    const cv::Scalar color = choose_color(light.kind);
    for (const Eigen::Vector2d& at : light.outline) {
      cv::circle(annotated_image, to_fixed_point(at), to_fixed_point({size, 0}).x, color,
                 cv::FILLED, cv::LINE_AA, kShift);
    }
    const Eigen::Vector2d across(6 * size, 0), along(0, 6 * size);
    cv::line(annotated_image, to_fixed_point(light.pixel - across),
             to_fixed_point(light.pixel + across), color, thickness, cv::LINE_AA, kShift);
    cv::line(annotated_image, to_fixed_point(light.pixel - along),
             to_fixed_point(light.pixel + along), color, thickness, cv::LINE_AA, kShift);
    draw_label(annotated_image, light, size);
  }
  return annotated_image;
}

void write_annotated_image(const std::filesystem::path& folder,
                           const std::filesystem::path& image_file,
                           const cv::Mat& annotated_image) {
  std::filesystem::path file = folder / image_file.filename();
  file += ".png";
  write_file(file, get_codecs().encode_image_file(".png", annotated_image, {}));
}

}  // namespace vlp
