// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/selection.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vlp {
namespace {

/// Returns the corners of the board, or the lamps by their ids, sorted by index.
std::vector<PointDetection> points_in(const Observation& image) {
  if (image.board) return collect_corners(image.board->seen);
  std::vector<PointDetection> points;
  for (const Detection& lamp : collect_lamps(image)) {
    points.push_back({static_cast<std::size_t>(lamp.lamp), lamp.pixel});
  }
  std::sort(points.begin(), points.end(),
            [](const PointDetection& a, const PointDetection& b) { return a.index < b.index; });
  return points;
}

bool are_equal(const std::vector<PointDetection>& a, const std::vector<PointDetection>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PointDetection& one, const PointDetection& two) {
                      return one.index == two.index && one.pixel == two.pixel;
                    });
}

bool are_close(const std::vector<PointDetection>& a, const std::vector<PointDetection>& b,
               double max_distance_px) {
  constexpr double min_shared_fraction = 0.7;
  double sum_px2 = 0, shared = 0;
  auto other = b.begin();
  for (const PointDetection& point : a) {
    while (other != b.end() && other->index < point.index) ++other;
    if (other == b.end()) break;
    if (other->index != point.index) continue;
    ++shared;
    sum_px2 += (point.pixel - other->pixel).squaredNorm();
  }
  const auto larger = static_cast<double>(std::max(a.size(), b.size()));
  return shared >= min_shared_fraction * larger && std::sqrt(sum_px2 / shared) <= max_distance_px;
}

}  // namespace

int min_lamps(ImageUse use) { return use == ImageUse::turn || use == ImageUse::places ? 2 : 0; }

void Selection::add(Observation& image) {
  if (!image.is_kept() || use_ == ImageUse::fixes) return;
  std::vector<PointDetection> points = points_in(image);
  if (points.empty()) return;
  for (const Kept& kept : kept_) {
    if (!are_equal(points, kept.points)) continue;
    return image.reject(RejectionReason::same_image, "is the same image as " + kept.name);
  }
  if (use_ != ImageUse::places) {
    for (const Kept& kept : kept_) {
      if (!are_close(points, kept.points, same_view_fraction_ * image.size_px[0])) continue;
      return image.reject(RejectionReason::same_view,
                          "shows the same view as " + kept.name + ": views count once");
    }
  }
  kept_.push_back({image.name(), std::move(points)});
}

void Selection::keep(const Observation& image) {
  if (use_ != ImageUse::fixes) kept_.push_back({image.name(), points_in(image)});
}

void reject_repeated(std::vector<Observation>& images, ImageUse use,
                     const FrontendOptions& options) {
  Selection selection(use, options);
  for (Observation& image : images) selection.add(image);
}

}  // namespace vlp
