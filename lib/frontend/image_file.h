// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>

namespace vlp {

/// Throws InputError if an image has more than `max_mpx` megapixels.
void check_size(const std::filesystem::path& file, std::int64_t width, std::int64_t height,
                double max_mpx);

/// Reads an image as grey levels of 8 or 16 bits: PNG, JPEG, BMP, TIFF, PBM, PGM or PPM by its
/// content.
/// Colour is converted. An orientation stated in the file is ignored, because the readout does not
/// turn with it. Throws InputError for a file of another kind and, before decoding, for one with
/// more than `max_mpx` megapixels or longer than such an image can be, at most 2 GiB.
cv::Mat read_image(const std::filesystem::path& file,
                   double max_mpx = std::numeric_limits<double>::infinity());

}  // namespace vlp
