// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit_image.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "captures/digest.h"
#include "detection/image_file.h"
#include "rig/input_error.h"
#include "station/image_blur.h"

namespace vlp {
namespace {

/// `look` at the image's content, or the reason why there is nothing to be looked at.
template <typename Look>
UnitImage looked_at(const std::filesystem::path& file, const Camera& type, const Look& look) {
  UnitImage result{file, ""};
  try {
    result.sha256 = sha256_of_file(file);
    const cv::Mat image = read_image(file);
    if (image.cols != type.imager_px[0] || image.rows != type.imager_px[1]) {
      result.refused = fmt::format("is {} x {} px, the camera has {} x {}", image.cols, image.rows,
                                   type.imager_px[0], type.imager_px[1]);
      return result;
    }
    look(image, result);
  } catch (const InputError&) {
    result.refused = "cannot be read as an image";
  } catch (const std::exception& error) {
    result.refused = std::string("cannot be used: ") + error.what();
    std::replace(result.refused.begin(), result.refused.end(), '\n', ' ');
  }
  return result;
}

/// Why a board in an image cannot be used; empty when it can.
std::string board_refusal(const SeenBoard& seen, const ImageBlur& blur,
                          const StationConfig& config) {
  constexpr std::size_t least_tags = 4;
  if (seen.tags.size() < least_tags && blur.bright_share < config.refuse.dark_share) {
    return "too dark";
  }
  if (blur.sigma_px > config.refuse.blur_px) {
    return std::isinf(blur.sigma_px) ? "no contrast"
                                     : fmt::format("blurred: {:.1f} px", blur.sigma_px);
  }
  if (seen.tags.empty() && !seen.foreign.empty()) return "tags of another board";
  if (seen.tags.empty()) return "no tags of the board";
  if (seen.tags.size() < least_tags) return fmt::format("only {} tags", seen.tags.size());
  return "";
}

}  // namespace

UnitImage look_at_board(const std::filesystem::path& file, const StationConfig& config,
                        const BoardDetector& detector) {
  return looked_at(file, config.type, [&](const cv::Mat& image, UnitImage& result) {
    const ImageBlur blur = image_blur(image);
    if (std::isfinite(blur.sigma_px)) result.blur_px = blur.sigma_px;
    BoardView view{file.filename().string(), {image.cols, image.rows}, detector.detect(image)};
    result.refused = board_refusal(view.seen, blur, config);
    if (!view.seen.tags.empty() || !view.seen.foreign.empty()) result.view = std::move(view);
  });
}

UnitImage look_at_lamps(const std::filesystem::path& file, const StationConfig& config,
                        const LampDetector& detector) {
  return looked_at(file, config.type, [&](const cv::Mat& image, UnitImage& result) {
    for (const Light& light : detector.detect(image)) {
      result.lights_cut += light.kind == LightKind::cut ? 1 : 0;
      result.lights_unknown += light.kind == LightKind::unknown ? 1 : 0;
      if (light.kind != LightKind::lamp) continue;
      result.lamps.push_back({*light.lamp, light.pixel, light.sigma_px});
    }
    if (result.lamps.size() >= 2) return;
    result.refused = fmt::format("{} of the lamps seen ({} cut by the image's edge, {} unlike any)",
                                 result.lamps.size(), result.lights_cut, result.lights_unknown);
  });
}

bool same_pose(const SeenBoard& a, const SeenBoard& b, double distance_px) {
  double sum = 0;
  int count = 0;
  for (const SeenTag& tag : a.tags) {
    const auto other = std::find_if(b.tags.begin(), b.tags.end(),
                                    [&](const SeenTag& t) { return t.id == tag.id; });
    if (other == b.tags.end()) continue;
    for (std::size_t corner = 0; corner < tag.corners_px.size(); ++corner) {
      sum += (tag.corners_px[corner] - other->corners_px[corner]).norm();
      ++count;
    }
  }
  return count > 0 && sum < distance_px * count;
}

bool same_lamps(const std::vector<Detection>& a, const std::vector<Detection>& b,
                double distance_px) {
  return a.size() == b.size() && std::all_of(a.begin(), a.end(), [&](const Detection& lamp) {
           return std::any_of(b.begin(), b.end(), [&](const Detection& other) {
             return other.lamp == lamp.lamp && (other.pixel - lamp.pixel).norm() < distance_px;
           });
         });
}

}  // namespace vlp
