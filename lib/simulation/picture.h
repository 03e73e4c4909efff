// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "simulation/scene.h"

namespace vlp {

/// 255 or 65535.
double white_dn(const Sensor& sensor);

/// Which of the filters of Bayer is before a pixel: 0 blue, 1 green, 2 red, as in colour images.
int filter_at(int line, int place);

/// The share of a pixel's light that its filter passes.
double passed_share(const Bayer& bayer, int line, int place);

/// The three colours of levels behind a mosaic of filters, balanced.
std::vector<cv::Mat1f> colours_of(const Bayer& bayer, const Sensor& sensor,
                                  const cv::Mat1f& levels);

/// The tone curve of Picture.
double coded_level(const Picture& picture, const Sensor& sensor, double level_dn);

/// Tone curve and sharpening of Picture, on levels before they are rounded. Where the image ends it
/// is continued.
void develop(const Picture& picture, const Sensor& sensor, cv::Mat1f& levels);

/// How the names of the images end.
std::string image_ending(const std::optional<Picture>& picture);

/// The image as a file: JPEG, or PNG, of which every level comes back.
std::vector<unsigned char> encoded(const cv::Mat& image, const std::optional<Picture>& picture);

}  // namespace vlp
