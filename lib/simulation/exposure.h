// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "simulation/scene.h"

namespace vlp {

/// Returns the white level of the sensor, 255 or 65535.
double white_level_dn(const Sensor& sensor);

/// Returns the color of a pixel's Bayer filter (RGGB): 0 blue, 1 green, 2 red, the channel order of
/// OpenCV. The pixel is in readout order (line, place), both from 0 and possibly negative.
int bayer_color_at(int line, int place);

/// Returns the fraction of a pixel's light that its filter passes, relative to green.
double bayer_transmission(const Bayer& bayer, int line, int place);

/// Demosaics the gray levels behind a mosaic of filters and balances the three colors.
std::vector<cv::Mat1f> demosaic(const Bayer& bayer, const Sensor& sensor, const cv::Mat1f& levels);

/// Applies the tone curve of ImageProcessing to one gray level, DN.
double apply_tone_curve(const ImageProcessing& processing, const Sensor& sensor, double level_dn);

/// Applies tone curve and sharpening of ImageProcessing to gray levels before rounding. Border
/// pixels are replicated.
void process_gray_levels(const ImageProcessing& processing, const Sensor& sensor,
                         cv::Mat1f& levels);

/// Returns the file name extension of the images: ".jpg" or ".png".
std::string image_extension(const std::optional<ImageProcessing>& processing);

/// Encodes the image as JPEG, or losslessly as PNG.
std::vector<unsigned char> encode_image(const cv::Mat& image,
                                        const std::optional<ImageProcessing>& processing);

/// Simulates a sensor (see Sensor) from the mean number of electrons of each pixel.
///
/// Steps: color filters, shot noise (Poisson), overflow with bloom, read noise (normal), gain and
/// black level. With `processing` also demosaicing, tone curve and sharpening; levels behind color
/// filters are rounded before demosaicing. Last, rounding and the limits of 8 or 16 bits. The
/// result has 8 or 16 bits; behind color filters it has three colors, blue first. The same seed
/// yields the same image.
cv::Mat simulate_sensor_image(const Sensor& sensor, const cv::Mat1f& mean_electrons,
                              std::uint64_t seed,
                              const std::optional<ImageProcessing>& processing = {});

}  // namespace vlp
