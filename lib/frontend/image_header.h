// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace vlp {

/// Returns true if a file begins as a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM does.
bool has_image_signature(std::string_view bytes);

/// Reads width and height in pixels from the header of a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM file
/// without decoding the image: a file of a megabyte can hold gigapixels. Returns std::nullopt for
/// any other file, or if it is cut short before its size.
std::optional<std::array<std::int64_t, 2>> size_in_header(std::string_view bytes);

}  // namespace vlp
