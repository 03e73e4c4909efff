// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace vlp {

/// Width and height in pixels as the header of a PNG, JPEG, BMP, TIFF or PGM file states them, read
/// without decoding the image: a file of a megabyte can hold gigapixels. Nothing for what is none
/// of these, or is cut short before it says so.
std::optional<std::array<std::int64_t, 2>> size_in_header(std::string_view bytes);

}  // namespace vlp
