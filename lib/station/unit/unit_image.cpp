// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_image.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "captures/digest.h"
#include "detection/image_file.h"
#include "detection/mat_view.h"
#include "rig/input_error.h"
#include "station/unit/image_blur.h"
#include "station/unit/image_signal.h"

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
      result.refused = fmt::format("another size: {} x {} px, the camera has {} x {}", image.cols,
                                   image.rows, type.imager_px[0], type.imager_px[1]);
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

/// Share of the pixels of a part of an image of 8 or 16 bits that are at full scale.
double white_share(const cv::Mat& image, cv::Rect part) {
  constexpr double full_8 = 255, full_16 = 65535;
  part &= cv::Rect({}, image.size());
  if (part.empty()) return 0;
  const cv::Mat white = image(part) >= (image.depth() == CV_8U ? full_8 : full_16);
  return cv::countNonZero(white) / static_cast<double>(part.area());
}

/// The box around the tags; all of the image without any.
cv::Rect part_with_tags(const SeenBoard& seen, const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  for (const SeenTag& tag : seen.tags) {
    for (const auto& corner : tag.corners_px) {
      corners.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
    }
  }
  return corners.empty() ? cv::Rect({}, image.size()) : cv::boundingRect(corners);
}

/// More of a board than this at full scale moves its edges.
constexpr double kMostWhite = 0.25;

/// Less than this, in standard deviations of the noise, makes centres of lamps and stripes that are
/// those of the noise, which alone has about 6.
constexpr double kLeastSignal = 12;

/// Why an image in which nothing stands out of the noise is of no use; empty for any other.
std::string exposure_refusal(const cv::Mat& image) {
  constexpr double percent = 100, white = 0.85;
  const ImageSignal signal = image_signal(image);
  if (signal.over_noise >= kLeastSignal) return "";
  if (signal.dark_share > white) {
    return fmt::format("overexposed: all of the image is at {:.0f} % of the full scale or more",
                       percent * signal.dark_share);
  }
  return fmt::format(
      "too dark: the brightest is {:.0f} times the noise over the darkest, {:.0f} wanted",
      signal.over_noise, kLeastSignal);
}

/// Why a board in an image cannot be used; empty when it can.
std::string board_refusal(const SeenBoard& seen, const ImageBlur& blur, double white,
                          const StationConfig& config) {
  constexpr std::size_t least_tags = 4;
  constexpr double percent = 100;
  if (white > kMostWhite) {
    return fmt::format("overexposed: {:.0f} % of the {} is at full scale", percent * white,
                       seen.tags.empty() ? "image" : "board");
  }
  if (seen.tags.size() < least_tags && blur.bright_share < config.refuse.dark_share) {
    return "too dark";
  }
  if (blur.sigma_px > config.refuse.blur_px) {
    return std::isinf(blur.sigma_px) ? "no contrast"
                                     : fmt::format("blurred: {:.1f} px", blur.sigma_px);
  }
  if (seen.tags.empty() && !seen.foreign.empty()) return "tags of another board";
  if (seen.tags.empty()) return "no tags of the board";
  if (seen.tags.size() < least_tags) return fmt::format("too few tags: {}", seen.tags.size());
  return "";
}

}  // namespace

UnitImage look_at_board(const std::filesystem::path& file, const StationConfig& config,
                        const BoardDetector& detector) {
  return looked_at(file, config.type, [&](const cv::Mat& image, UnitImage& result) {
    const ImageBlur blur = image_blur(image);
    if (std::isfinite(blur.sigma_px)) result.blur_px = blur.sigma_px;
    BoardView view{file.filename().string(), {image.cols, image.rows}, detector.detect(image)};
    result.refused = board_refusal(view.seen, blur,
                                   white_share(image, part_with_tags(view.seen, image)), config);
    if (!view.seen.tags.empty() || !view.seen.foreign.empty()) result.view = std::move(view);
  });
}

UnitImage look_at_lamps(const std::filesystem::path& file, const StationConfig& config,
                        const LightDetector& detector) {
  return looked_at(file, config.type, [&](const cv::Mat& image, UnitImage& result) {
    result.refused = exposure_refusal(image);
    if (!result.refused.empty()) return;
    // A lamp fills its box to a share of pi / 4, and is dark for half of the time.
    constexpr double least_white = 0.65;
    int overexposed = 0;
    for (const Light& light : detector.detect(image_view(image))) {
      result.lights_cut += light.kind == LightKind::cut ? 1 : 0;
      result.lights_unknown += light.kind == LightKind::unknown ? 1 : 0;
      const cv::Point low(static_cast<int>(light.low.x()), static_cast<int>(light.low.y()));
      const cv::Point high(static_cast<int>(light.high.x()), static_cast<int>(light.high.y()));
      const bool white = white_share(image, {low, high}) > least_white;
      overexposed += light.kind == LightKind::unknown && white ? 1 : 0;
      if (light.kind == LightKind::unknown && light.reason == LightReason::unknown_period) {
        result.unknown_hz.push_back(1 / (light.stripes.period_lines * *config.type.row_time_s));
      }
      if (light.kind != LightKind::lamp) continue;
      result.lamps.push_back({*light.lamp, light.pixel, light.sigma_px});
    }
    if (result.lamps.size() >= 2) return;
    if (overexposed > 0) {
      result.refused = fmt::format(
          "overexposed: {} of {} lights are at full scale all over, {} of the lamps seen",
          overexposed, result.lights_unknown, result.lamps.size());
      return;
    }
    result.refused =
        fmt::format("too few lamps: {} seen, {} cut by the image's edge, {} lights unlike any",
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
