// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace vlp {

/// Returns true if a file begins with the signature of PNG, JPEG, BMP, TIFF, PBM, PGM or PPM.
bool has_image_signature(std::string_view bytes);

/// Parses width and height in pixels from the header of a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM
/// file. The image is not decoded, because a file of a megabyte can contain gigapixels. Returns
/// std::nullopt for other files, and for files truncated before the size.
std::optional<std::array<std::int64_t, 2>> read_header_size(std::string_view bytes);

}  // namespace vlp
