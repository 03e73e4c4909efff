// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/annotate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "codecs/codecs.h"
#include "frontend/lights_table.h"
#include "rig/file.h"

namespace vlp {
namespace {

/// Number of fractional bits of OpenCV's drawing coordinates.
constexpr int kShift = 8;

cv::Scalar choose_color(LightKind kind) {
  switch (kind) {
    case LightKind::lamp:
      return {80, 255, 80};
    case LightKind::cut:
      return {0, 220, 255};
    case LightKind::unknown:
      return {60, 60, 255};
    case LightKind::steady:
      return {255, 160, 60};
    case LightKind::formless:
      return {170, 170, 170};
  }
  return {};
}

std::string make_label(const Light& light) {
  switch (light.kind) {
    case LightKind::lamp:
      return std::to_string(*light.lamp);
    case LightKind::cut:
      return std::to_string(*light.lamp) + " cut";
    case LightKind::unknown:
    case LightKind::steady:
    case LightKind::formless:
      return fmt::format("{}: {}", to_string(light.kind), to_string(light.reason));
  }
  return {};
}

cv::Point fine(const Eigen::Vector2d& pixel) {
  constexpr double unit = 1 << kShift;
  return {static_cast<int>(std::lround(pixel.x() * unit)),
          static_cast<int>(std::lround(pixel.y() * unit))};
}

/// Converts an image to color and brightens it, so that dark surroundings are visible.
cv::Mat brightened(const cv::Mat& image) {
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
void write_label(cv::Mat& picture, const Light& light, double size) {
  const std::string label = make_label(light);
  const int thickness = static_cast<int>(std::lround(size));
  const double scale = 0.5 * size;
  const cv::Size box = cv::getTextSize(label, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, nullptr);
  const int gap = static_cast<int>(3 * size);
  int left = static_cast<int>(light.high.x()) + gap;
  if (left + box.width > picture.cols) left = static_cast<int>(light.low.x()) - gap - box.width;
  const int bottom = std::clamp(static_cast<int>(light.pixel.y()) + box.height / 2, box.height,
                                std::max(box.height, picture.rows - 1));
  cv::putText(picture, label, {std::max(0, left), bottom}, cv::FONT_HERSHEY_SIMPLEX, scale,
              choose_color(light.kind), thickness, cv::LINE_AA);
}

}  // namespace

cv::Mat render_annotated(const cv::Mat& image, const std::vector<Light>& lights, Readout readout) {
  cv::Mat picture = brightened(image);
  const double size = std::max(1.0, picture.cols / 1000.0);  // of letters and crosses
  const int thickness = static_cast<int>(std::lround(size));
  for (const Light& light : lights) {
    const cv::Scalar color = choose_color(light.kind);
    for (const EdgePoint& edge : light.outline) {
      const Eigen::Vector2d at =
          readout == Readout::rows ? edge.pixel : Eigen::Vector2d(edge.pixel.reverse());
      cv::circle(picture, fine(at), fine({size, 0}).x, color, cv::FILLED, cv::LINE_AA, kShift);
    }
    const Eigen::Vector2d across(6 * size, 0), along(0, 6 * size);
    cv::line(picture, fine(light.pixel - across), fine(light.pixel + across), color, thickness,
             cv::LINE_AA, kShift);
    cv::line(picture, fine(light.pixel - along), fine(light.pixel + along), color, thickness,
             cv::LINE_AA, kShift);
    write_label(picture, light, size);
  }
  return picture;
}

void write_annotated(const std::filesystem::path& folder, const std::filesystem::path& image_file,
                     const cv::Mat& picture) {
  std::filesystem::path file = folder / image_file.filename();
  file += ".png";
  write_file(file, codecs().encode(".png", picture, {}));
}

}  // namespace vlp
