// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vlp {

/// Writer of an .npz file: NumPy arrays in an uncompressed ZIP archive (NumPy documentation,
/// "numpy.lib.format", version 1.0; PKWARE's APPNOTE, 4.3). Requires a little-endian machine. The
/// same arrays give the same bytes.
class NumpyArchive {
 public:
  using Shape = std::vector<std::size_t>;

  /// Adds an array of doubles with a name. `values` are in C order (last index fastest). Their
  /// number is the product of `shape`; an empty shape is a scalar.
  void add_npz_array(std::string_view name, const Shape& shape, std::span<const double> values);
  void add_npz_array(std::string_view name, const Shape& shape,
                     std::span<const std::int32_t> values);
  void add_npz_array(std::string_view name, double value) {
    add_npz_array(name, {}, std::span(&value, 1));
  }
  void add_npz_array(std::string_view name, bool value);
  /// Adds an ASCII string. The overload for literals keeps them from being converted to bool.
  void add_npz_array(std::string_view name, std::string_view text);
  void add_npz_array(std::string_view name, const char* text) {
    add_npz_array(name, std::string_view(text));
  }

  /// Returns the complete archive.
  std::string serialize() const;

 private:
  void add_npz_data(std::string_view name, std::string_view type, const Shape& shape,
                    std::string_view data);
  void add_zip_file(const std::string& name, const std::string& content);

  std::string files_, directory_;
  std::uint16_t count_ = 0;
};

/// Encodes bytes as Python's base64.b85encode() does.
std::string encode_base85(std::string_view bytes);

}  // namespace vlp
