// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/numpy_archive.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace vlp {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename Number>
std::string little_endian(Number value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string uint16_bytes(std::size_t value) {
  return little_endian(static_cast<std::uint16_t>(value));
}
std::string uint32_bytes(std::size_t value) {
  return little_endian(static_cast<std::uint32_t>(value));
}

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

template <typename Number>
std::string_view view_bytes(std::span<const Number> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

}  // namespace

void NumpyArchive::add_npz_array(std::string_view name, const Shape& shape,
                                 std::span<const double> values) {
  add_npz_data(name, "<f8", shape, view_bytes(values));
}

void NumpyArchive::add_npz_array(std::string_view name, const Shape& shape,
                                 std::span<const std::int32_t> values) {
  add_npz_data(name, "<i4", shape, view_bytes(values));
}

void NumpyArchive::add_npz_array(std::string_view name, bool value) {
  add_npz_data(name, "|b1", {}, std::string(1, value ? '\1' : '\0'));
}

void NumpyArchive::add_npz_array(std::string_view name, std::string_view text) {
  std::string wide;
  for (const char c : text) wide += uint32_bytes(static_cast<unsigned char>(c));
  if (text.empty()) wide = uint32_bytes(0);
  add_npz_data(name, "<U" + std::to_string(std::max<std::size_t>(1, text.size())), {}, wide);
}

void NumpyArchive::add_npz_data(std::string_view name, std::string_view type, const Shape& shape,
                                std::string_view data) {
  std::string header = "{'descr': '";
  header.append(type).append("', 'fortran_order': False, 'shape': (");
  for (const std::size_t size : shape) header.append(std::to_string(size)).append(",");
  header += "), }";
  constexpr std::size_t preamble = 10, alignment = 64;
  while ((preamble + header.size() + 1) % alignment != 0) header += ' ';
  header += '\n';
  std::string content("\x93NUMPY\x01\x00", 8);
  content.append(uint16_bytes(header.size())).append(header).append(data);
  add_zip_file(std::string(name) + ".npy", content);
}

void NumpyArchive::add_zip_file(const std::string& name, const std::string& content) {
  constexpr std::size_t version = 20, first_of_1980 = 0x21;
  std::string common = uint16_bytes(version);
  common.append(uint16_bytes(0))
      .append(uint16_bytes(0))
      .append(uint16_bytes(0))
      .append(uint16_bytes(first_of_1980));
  common.append(uint32_bytes(crc32(content)))
      .append(uint32_bytes(content.size()))
      .append(uint32_bytes(content.size()));
  common.append(uint16_bytes(name.size())).append(uint16_bytes(0));
  directory_.append("PK\x01\x02").append(uint16_bytes(version)).append(common);
  directory_.append(uint16_bytes(0))
      .append(uint16_bytes(0))
      .append(uint16_bytes(0))
      .append(uint32_bytes(0));
  directory_.append(uint32_bytes(files_.size())).append(name);
  files_.append("PK\x03\x04").append(common).append(name).append(content);
  ++count_;
}

std::string NumpyArchive::serialize() const {
  std::string end = "PK\x05\x06";
  end.append(uint16_bytes(0))
      .append(uint16_bytes(0))
      .append(uint16_bytes(count_))
      .append(uint16_bytes(count_));
  end.append(uint32_bytes(directory_.size()))
      .append(uint32_bytes(files_.size()))
      .append(uint16_bytes(0));
  return files_ + directory_ + end;
}

std::string encode_base85(std::string_view bytes) {
  constexpr std::string_view digits =
      "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
  static_assert(digits.size() == 85);
  std::string text;
  text.reserve(bytes.size() * 5 / 4 + 5);
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    const std::size_t count = std::min<std::size_t>(4, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      word = (word << 8) | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    std::string group(5, '0');
    for (std::size_t k = 5; k-- > 0; word /= 85) group[k] = digits[word % 85];
    text.append(group, 0, count + 1);
  }
  return text;
}

}  // namespace vlp
