// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/guidance_maps.h"

#include <fmt/core.h>

#include <cmath>
#include <map>

#include "calibration/intrinsics/lens_sharpness.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

std::string missing_angles(const TurnMap::Height& height) {
  std::string angles;
  for (std::size_t part = 0; part < height.parts.size(); ++part) {
    if (height.parts[part]) continue;
    angles += fmt::format(" {:.0f}", 360.0 * double(part) / double(height.parts.size()));
  }
  return angles;
}

}  // namespace

std::vector<std::string> draw_board_map(const Unit& unit) {
  const ImageCoverage coverage =
      board_coverage(unit.step(StationStep::boards), unit.config().type.imager_px);
  constexpr int many = 20;
  std::vector<std::string> lines;
  const std::string edge = "  +-----------------+";
  lines.push_back(edge);
  for (int row = 0; row < ImageCoverage::kRows; ++row) {
    std::string line = "  |";
    for (int col = 0; col < ImageCoverage::kCols; ++col) {
      const int corners = coverage.corners(col, row);
      line += corners == 0 ? " ." : corners < many ? " +" : " #";
    }
    lines.push_back(line + " |");
  }
  lines.push_back(edge);
  lines[1] += fmt::format("   {:.0f} % of the image have corners, {:.0f} % wanted",
                          100 * coverage.fraction(), 100 * unit.config().sufficient.board_coverage);
  lines[3] += "   # many corners   + some   . none";
  const UnitStep& boards = unit.step(StationStep::boards);
  const auto last = boards.images.find(boards.last);
  if (last == boards.images.end() || !last->second.seen.board) return lines;
  if (const auto mtf50 = compute_view_mtf50(last->second.seen.board->seen)) {
    lines[5] += fmt::format("   sharpness of the last image: MTF50 {:.3f} cycles/px", *mtf50);
  }
  return lines;
}

TurnMap compute_unit_turn_map(const Unit& unit) {
  const auto& lens = unit.step(StationStep::boards).result;
  if (!lens || !lens->ok()) return {};
  return compute_turn_map(collect_frames(unit.step(StationStep::rotation)), unit.config(),
                          lens->calibration);
}

std::vector<std::string> describe_turn(const Unit& unit) {
  std::vector<std::string> lines;
  for (const TurnMap::Height& height : compute_unit_turn_map(unit).heights) {
    std::string parts;
    for (const bool there : height.parts) parts += there ? '#' : '.';
    const double z_m = std::round(100 * height.z_m) / 100 + 0.0;  // without negative zero
    lines.push_back(fmt::format("  height {:5.2f} m  [{}]  {} captures over {:.0f} degrees", z_m,
                                parts, height.captures, deg_from_rad(height.arc_rad)));
    const std::string missing = missing_angles(height);
    if (!missing.empty()) lines.push_back("    missing, degrees from the first:" + missing);
  }
  return lines;
}

std::string describe_lamps(const Unit& unit, const UnitStep& step) {
  std::map<int, int> seen;
  for (const UnitImage* image : used_images(step)) {
    for (const Detection& lamp : collect_lamps(image->seen)) ++seen[lamp.lamp];
  }
  std::string there, missing;
  for (const Lamp& lamp : unit.config().lamps.lamps) {
    (seen.contains(lamp.id) ? there : missing) += fmt::format(" {}", lamp.id);
  }
  return "  lamps seen:" + (there.empty() ? " none" : there) +
         (missing.empty() ? "" : "   not yet:" + missing);
}

}  // namespace vlp
