// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_step.h"

#include <algorithm>
#include <utility>

#include "calibration/intrinsics/common_curve.h"
#include "geometry/median.h"

namespace vlp {
namespace {

std::size_t part_of(double pixel, int size_px, std::size_t parts) {
  const double share = std::clamp(pixel / size_px, 0.0, 0.999);
  return static_cast<std::size_t>(share * static_cast<double>(parts));
}

}  // namespace

int UnitStep::used() const {
  return static_cast<int>(std::count_if(images.begin(), images.end(), [](const auto& image) {
    return image.second.refused.empty();
  }));
}

std::vector<BoardView> views_of(const UnitStep& boards, const Board& board) {
  std::vector<BoardView> views;
  for (const auto& [name, image] : boards.images) {
    if (image.refused.empty()) views.push_back(*image.view);
  }
  take_common_curve(views, board);
  return views;
}

std::vector<Frame> frames_of(const UnitStep& step) {
  std::vector<Frame> frames;
  for (const auto& [name, image] : step.images) {
    if (image.refused.empty()) frames.push_back({name, image.lamps});
  }
  return frames;
}

double board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px) {
  constexpr std::size_t cols = 8, rows = 6;
  std::array<bool, cols * rows> covered{};
  for (const auto& [name, image] : step.images) {
    if (!image.refused.empty() || !image.view) continue;
    for (const SeenTag& tag : image.view->seen.tags) {
      for (const auto& corner : tag.corners_px) {
        const std::size_t col = part_of(corner.x(), imager_px[0], cols);
        covered[part_of(corner.y(), imager_px[1], rows) * cols + col] = true;
      }
    }
  }
  const auto there = static_cast<double>(std::count(covered.begin(), covered.end(), true));
  return there / static_cast<double>(covered.size());
}

std::optional<double> typical_blur_px(const UnitStep& boards) {
  std::vector<double> blurs_px;
  for (const auto& [name, image] : boards.images) {
    const bool counts = image.refused.empty() || !boards.enough;
    if (counts && image.blur_px) blurs_px.push_back(*image.blur_px);
  }
  if (blurs_px.empty()) return std::nullopt;
  return upper_median(std::move(blurs_px));
}

}  // namespace vlp
