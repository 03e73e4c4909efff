// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace vlp {

/// Computes the SHA-256 of a text, in hexadecimal digits.
std::string hash_text(std::string_view text);

/// Computes the SHA-256 of a file's content. Returns 64 lower-case hexadecimal digits.
/// @throws InputError if the file cannot be read
std::string hash_file(const std::filesystem::path& file);

}  // namespace vlp
