// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/lights_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <utility>

#include "captures/csv_writer.h"
#include "captures/number_text.h"

namespace vlp {
namespace {

std::string_view outline_name(const Light& light) {
  if (light.kind == LightKind::formless) return "";
  if (light.is_glow) return "glow";
  if (!is_disc(light)) return traits_of(light.shape).name;
  return light.is_uneven ? "rim" : "edge";
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

std::vector<CountedReason> count_reasons(std::span<const Observation> images) {
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
                     const bool form_a = a.kind != LightKind::formless;
                     const bool form_b = b.kind != LightKind::formless;
                     return form_a != form_b ? form_a : a.lights > b.lights;
                   });
  return reasons;
}

std::string_view to_string(LightKind kind) {
  switch (kind) {
    case LightKind::lamp:
      return "lamp";
    case LightKind::cut:
      return "cut";
    case LightKind::unknown:
      return "unknown";
    case LightKind::steady:
      return "steady";
    case LightKind::formless:
      return "no_outline";
  }
  return {};
}

std::string_view to_string(LightReason reason) {
  switch (reason) {
    case LightReason::identified:
      return "identified";
    case LightReason::overexposed:
      return "overexposed";
    case LightReason::steady:
      return "steady";
    case LightReason::too_few_periods:
      return "too_few_periods";
    case LightReason::no_clear_period:
      return "no_clear_period";
    case LightReason::unknown_period:
      return "unknown_period";
    case LightReason::reflection:
      return "reflection";
    case LightReason::wrong_shape:
      return "wrong_shape";
    case LightReason::incomplete:
      return "incomplete";
  }
  return {};
}

std::string describe(LightReason reason) {
  switch (reason) {
    case LightReason::identified:
      return "its stripes are that lamp's";
    case LightReason::overexposed:
      return "most of it is overexposed, which hides stripes: if it is a lamp, expose shorter";
    case LightReason::steady:
      return fmt::format("its lines differ by less than {:.0f} %: if it is a lamp, expose shorter",
                         100 * kMinContrast);
    case LightReason::too_few_periods:
      return fmt::format(
          "it shows less than {} periods, or less than {} and no lamp with more is in the image: "
          "if "
          "it is a lamp, go nearer, or modulate it faster",
          kMinPeriods, kMinReliablePeriods);
    case LightReason::no_clear_period:
      return "it shows no clear period: if it is a lamp, see that nothing hides a part, and that "
             "the read-out is right";
    case LightReason::unknown_period:
      return "its period is that of no lamp, or of several: check frequencies, row time and "
             "read-out, and the classifier, if there is one";
    case LightReason::reflection:
      return "it is softer than the lamps, or another light has its period: if it is a lamp, "
             "focus, "
             "cover what mirrors it, or give each lamp a frequency of its own";
    case LightReason::wrong_shape:
      return "its outline is not that of a lamp of the map: if it is a lamp, see that nothing "
             "hides "
             "a part or joins it, and check its shape in the map";
    case LightReason::incomplete:
      return "the image's edge cuts it, or it is too small for an outline: if it is a lamp, aim so "
             "that it is in view, or go nearer";
  }
  return {};
}

std::string describe_light(const Light& light) {
  std::string line =
      fmt::format("({:.1f}, {:.1f}) {}", light.pixel.x(), light.pixel.y(), to_string(light.kind));
  if (light.lamp) line += fmt::format(" {}", *light.lamp);
  line += fmt::format(": {}; radius {:.1f} px", describe(light.reason), light.radius_px);
  if (light.kind == LightKind::formless) return line;
  const Stripes& stripes = light.stripes;
  line +=
      fmt::format(", {} {:.0f} % {}, contrast {:.2f}", outline_name(light), 100 * light.roundness,
                  traits_of(light.shape).is_round ? "round" : "straight", stripes.contrast);
  if (!(stripes.period_lines > 0)) return line;
  return line + fmt::format(
                    ", {:.1f} periods of {:.2f} lines, periodicity_r2 {:.2f}, coherence {:.2f}",
                    stripes.periods, stripes.period_lines, stripes.periodicity_r2, light.coherence);
}

void write_lights(const std::filesystem::path& file, std::span<const Observation> images) {
  CsvWriter csv(file, {"image", "kind", "reason", "lamp", "u_px", "v_px", "sigma_px", "radius_px",
                       "outline", "edge_rise_px", "inlier_fraction", "contrast", "period_lines",
                       "periods", "periodicity_r2", "coherence", "duty"});
  const auto number_if = [](bool there, double value) { return there ? fixed(value, 4) : ""; };
  for (const Observation& image : images) {
    for (const Light& light : image.lights) {
      const Stripes& stripes = light.stripes;
      const bool form = light.kind != LightKind::formless;
      const bool striped = form && stripes.period_lines > 0;
      csv.row({image.name(), to_string(light.kind), to_string(light.reason), lamp_name(light),
               fixed(light.pixel.x(), 4), fixed(light.pixel.y(), 4),
               number_if(form, light.sigma_px), fixed(light.radius_px, 4), outline_name(light),
               number_if(form, light.rise_px), number_if(form, light.roundness),
               number_if(form, stripes.contrast), number_if(striped, stripes.period_lines),
               number_if(striped, stripes.periods), number_if(striped, stripes.periodicity_r2),
               number_if(striped, light.coherence), number_if(striped, stripes.duty)});
    }
  }
  csv.save();
}

}  // namespace vlp
