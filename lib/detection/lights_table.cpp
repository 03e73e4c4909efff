// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lights_table.h"

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
  if (light.glows) return "glow";
  if (is_rectangle(light)) return "rectangle";
  return light.uneven ? "rim" : "edge";
}

std::string lamp_name(const Light& light) { return light.lamp ? std::to_string(*light.lamp) : ""; }

}  // namespace

int count_of(std::span<const LightsOfImage> images, LightKind kind) {
  std::ptrdiff_t count = 0;
  for (const LightsOfImage& image : images) {
    count += std::count_if(image.lights.begin(), image.lights.end(),
                           [&](const Light& light) { return light.kind == kind; });
  }
  return static_cast<int>(count);
}

std::vector<CountedReason> reasons_of(std::span<const LightsOfImage> images) {
  std::map<std::pair<LightKind, LightReason>, int> counts;
  for (const LightsOfImage& image : images) {
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

std::string_view name_of(LightKind kind) {
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
      return "formless";
  }
  return {};
}

std::string_view name_of(LightReason reason) {
  switch (reason) {
    case LightReason::identified:
      return "identified";
    case LightReason::clipped:
      return "clipped";
    case LightReason::even:
      return "even";
    case LightReason::few_stripes:
      return "few_stripes";
    case LightReason::unclear:
      return "unclear";
    case LightReason::incoherent:
      return "incoherent";
    case LightReason::irregular:
      return "irregular";
    case LightReason::like_no_lamp:
      return "like_no_lamp";
    case LightReason::other_shape:
      return "other_shape";
    case LightReason::soft:
      return "soft";
    case LightReason::not_round:
      return "not_round";
    case LightReason::seen_better:
      return "seen_better";
    case LightReason::alone:
      return "alone";
    case LightReason::at_edge:
      return "at_edge";
    case LightReason::small:
      return "small";
    case LightReason::no_outline:
      return "no_outline";
  }
  return {};
}

std::string explanation_of(LightReason reason) {
  switch (reason) {
    case LightReason::identified:
      return "its stripes are that lamp's";
    case LightReason::clipped:
      return "most of it is as bright as can be, which hides stripes: if it is a lamp, expose "
             "shorter";
    case LightReason::even:
      return fmt::format("its lines differ by less than {:.0f} %: if it is a lamp, expose shorter",
                         100 * kLeastContrast);
    case LightReason::few_stripes:
      return fmt::format(
          "it shows less than {} periods: if it is a lamp, go nearer, or modulate it faster",
          kLeastPeriods);
    case LightReason::unclear:
      return "no period explains half of what varies from line to line: if it is a lamp, see that "
             "nothing hides a part, and that the read-out is right";
    case LightReason::incoherent:
      return "its parts vary each in its way, as letters and patterns do, and no stripes: if it is "
             "a lamp, is the read-out right?";
    case LightReason::irregular:
      return "its stripes keep no time: if it is a lamp, see that nothing hides a part";
    case LightReason::like_no_lamp:
      return "its period is like no lamp's, or like two lamps': are frequencies, row time and "
             "read-out right, and the classifier, if there is one, of these lamps?";
    case LightReason::other_shape:
      return "the lamp of its period has another shape in the map: is it a disc, or a rectangle of "
             "that size, and does nothing hide a part?";
    case LightReason::soft:
      return "it is much softer than others, as reflections are: if it is a lamp, bring it into "
             "focus";
    case LightReason::not_round:
      return "most of its edge is not on its outline: if it is a lamp, see that nothing hides a "
             "part";
    case LightReason::seen_better:
      return "another light of the image is that lamp and has the surer centre: if both are lamps, "
             "give "
             "each a frequency of its own";
    case LightReason::alone:
      return fmt::format(
          "it shows less than {} periods, and no lamp with more is in the image: go nearer, or "
          "modulate faster",
          kEnoughPeriods);
    case LightReason::at_edge:
      return "the image's edge cuts it, and the rest has no round outline: if it is a lamp, aim so "
             "that it is in view";
    case LightReason::small:
      return "its outline is too short to be fitted: if it is a lamp, go nearer";
    case LightReason::no_outline:
      return "no circle or ellipse fits its outline: if it is a lamp, something hides or joins it";
  }
  return {};
}

std::string line_of(const Light& light) {
  std::string line =
      fmt::format("({:.1f}, {:.1f}) {}", light.pixel.x(), light.pixel.y(), name_of(light.kind));
  if (light.lamp) line += fmt::format(" {}", *light.lamp);
  line += fmt::format(": {}; radius {:.1f} px", explanation_of(light.reason), light.radius_px);
  if (light.kind == LightKind::formless) return line;
  const Stripes& stripes = light.stripes;
  line +=
      fmt::format(", {} {:.0f} % {}, contrast {:.2f}", outline_name(light), 100 * light.roundness,
                  is_rectangle(light) ? "straight" : "round", stripes.contrast);
  if (!(stripes.period_lines > 0)) return line;
  return line + fmt::format(", {:.1f} periods of {:.2f} lines, clarity {:.2f}, coherence {:.2f}",
                            stripes.periods, stripes.period_lines, stripes.clarity,
                            light.coherence);
}

void write_lights(const std::filesystem::path& file, std::span<const LightsOfImage> images) {
  CsvWriter csv(file, {"image", "kind", "reason", "lamp", "u_px", "v_px", "sigma_px", "radius_px",
                       "outline", "rise_px", "roundness", "contrast", "period_lines", "periods",
                       "clarity", "coherence", "duty"});
  const auto number_if = [](bool there, double value) { return there ? fixed(value, 4) : ""; };
  for (const LightsOfImage& image : images) {
    for (const Light& light : image.lights) {
      const Stripes& stripes = light.stripes;
      const bool form = light.kind != LightKind::formless;
      const bool striped = form && stripes.period_lines > 0;
      csv.row({image.image, name_of(light.kind), name_of(light.reason), lamp_name(light),
               fixed(light.pixel.x(), 4), fixed(light.pixel.y(), 4),
               number_if(form, light.sigma_px), fixed(light.radius_px, 4), outline_name(light),
               number_if(form, light.rise_px), number_if(form, light.roundness),
               number_if(form, stripes.contrast), number_if(striped, stripes.period_lines),
               number_if(striped, stripes.periods), number_if(striped, stripes.clarity),
               number_if(striped, light.coherence), number_if(striped, stripes.duty)});
    }
  }
  csv.save();
}

}  // namespace vlp
