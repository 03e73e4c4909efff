// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/report_picture.h"

#include <algorithm>
#include <array>
#include <pugixml.hpp>
#include <string_view>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{16} << 20;

struct Kind {
  std::string_view title;
  ReportPart part;
  std::string_view caption, alt;
};

constexpr std::array<Kind, 8> kKinds = {
    {{"intrinsics", ReportPart::camera,
      "Coverage: the corners of all views should reach the edges of the image. Residuals: short "
      "and "
      "without a pattern; long arrows that point the same way mean a lens that is not modeled "
      "well. "
      "Uncertainty: how far the projection can be trusted, by one standard deviation. "
      "Sharpness, with AprilTags: even, or falling equally towards all edges; a fall to one side "
      "is a tilted lens, a spot is a smear.",
      "Maps of the image: corners of the board in all views, their residuals enlarged, the "
      "standard deviation of the projection, and the MTF50 where it was measured."},
     {"rotation", ReportPart::rotation,
      "Left: the lamps while the camera rotates in place; each moves on an ellipse. Right, "
      "enlarged: the ellipse centers of the lamps, the rotation center and the principal point. "
      "Centers far apart indicate tilt.",
      "Traces of the lamps in the undistorted image with fitted ellipses; next to them the ellipse "
      "centers, the rotation center and the principal point."},
     {"dispersion", ReportPart::dispersion,
      "Fixes minus reference point, before and after the dispersion calibration, each with the "
      "smallest enclosing circle. The circle after it should be smaller.",
      "Errors of fixes about the reference point with their dispersion circles, before and after."},
     {"errors", ReportPart::floor,
      "Arrows from the true position of each capture towards its fix, enlarged as the title "
      "states; the bar below the plan is the scale.",
      "Floor plan with the lamps and an enlarged error arrow at each true position."},
     {"cdf", ReportPart::distribution,
      "Cumulative distribution of the errors; marks at 50 % and 90 %.",
      "Cumulative distribution of the horizontal errors."},
     {"budget", ReportPart::distribution,
      "Error budget of the fixes, from their reported uncertainty: below, noise, which averages "
      "out; above, contributions of calibration and lamp map, which do not. Reduce the largest "
      "contribution first. It holds for a level camera whose fixes are those of the camera: fixes "
      "with estimated roll and pitch are left out, and it does not hold for fixes of a robot "
      "center.",
      "Stacked horizontal variances of the fixes by their sources."},
     {"track", ReportPart::tracks,
      "Above: the commanded line and the fixes on the floor. Below: their offset to the left of "
      "the commanded line, in millimeters; the scatter about the fitted line is jitter.",
      "Commanded line, fixes and the line fitted to them, on the floor and across the line."},
     {"limits", ReportPart::other,
      "Theoretical limit (CRLB) of the horizontal standard deviation over the floor.",
      "Map of the theoretical limit over the floor with the lamps."}}};

/// Returns the text between <title> and </title>; empty if there is none.
std::string_view extract_svg_title(std::string_view svg) {
  constexpr std::string_view opening = "<title>";
  const std::size_t start = svg.find(opening);
  if (start == std::string_view::npos) return {};
  const std::size_t end = svg.find("</title>", start);
  return svg.substr(start + opening.size(), end - start - opening.size());
}

/// Returns true if the file ends in the chunk IEND with its checksum.
bool is_complete_png(std::string_view png) {
  constexpr std::string_view end("IEND\xAE\x42\x60\x82");
  return png.ends_with(end);
}

bool is_complete_svg(const std::string& svg) {
  pugi::xml_document document;
  return document.load_buffer(svg.data(), svg.size()) && document.child("svg").first_child();
}

/// Returns the plot of the kind with this title, without an image.
ReportPlot classify_plot(std::string_view title, const std::string& name) {
  const auto* kind = std::find_if(kKinds.begin(), kKinds.end(),
                                  [&](const Kind& other) { return other.title == title; });
  if (kind == kKinds.end()) return {ReportPart::other, {}, name, "Picture " + name};
  return {kind->part, {}, std::string(kind->caption), std::string(kind->alt)};
}

}  // namespace

ReportPlot read_report_plot(const std::filesystem::path& file) {
  std::string image = read_file(file, kMaxBytes);
  constexpr std::size_t head = 1024;
  const bool png = image.starts_with("\x89PNG");
  if (!png && image.substr(0, head).find("<svg") == std::string::npos) {
    throw InputError(file, "is neither an SVG nor a PNG");
  }
  if (png ? !is_complete_png(image) : !is_complete_svg(image)) {
    // [FILE-4]
    throw InputError(file, "is cut short, or holds no picture");
  }
  ReportPlot plot = classify_plot(extract_svg_title(image), file.filename().string());
  plot.image = std::move(image);
  return plot;
}

ReportPlot make_report_plot(Drawing drawing) {
  ReportPlot plot = classify_plot(drawing.name, drawing.name);
  plot.table = drawing.table;
  plot.drawing = std::move(drawing);
  return plot;
}

void render_plots(std::vector<ReportPlot>& plots) {
  std::vector<Drawing> drawings;
  for (ReportPlot& plot : plots) {
    if (plot.drawing) drawings.push_back(*plot.drawing);
  }
  const std::vector<std::string> images = render_plots_as_svg(drawings);
  auto image = images.begin();
  for (ReportPlot& plot : plots) {
    if (!plot.drawing) continue;
    plot.image = *image++;
    plot.drawing.reset();
  }
}

ReportPlot render_report_plot(Drawing drawing) {
  std::vector<ReportPlot> plots{make_report_plot(std::move(drawing))};
  render_plots(plots);
  return std::move(plots.front());
}

}  // namespace vlp
