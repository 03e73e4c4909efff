// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/csv_writer.h"

#include <csv.h>

#include <charconv>

namespace vlp {
namespace {

std::string quote_csv_field(std::string_view field) {
  std::string text(2 * field.size() + 2, '\0');
  text.resize(csv_write(text.data(), text.size(), field.data(), field.size()));
  return text;
}

bool is_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0;
  const auto [end, failure] = std::from_chars(field.data(), field.data() + field.size(), value);
  return failure == std::errc() && end == field.data() + field.size();
}

}  // namespace

void CsvWriter::write_csv_row(std::initializer_list<std::string_view> fields) {
  write_csv_fields({fields.begin(), fields.size()});
}

void CsvWriter::write_csv_row(const std::vector<std::string>& fields) {
  const std::vector<std::string_view> views(fields.begin(), fields.end());
  write_csv_fields(views);
}

void CsvWriter::write_csv_fields(std::span<const std::string_view> fields) {
  const char* separator = "";
  for (const std::string_view field : fields) {
    buffer_ += separator;
    separator = ",";
    if (is_like_formula(field) && !is_number(field)) {
      const std::string text = "'" + std::string(field);
      buffer_ += quote_csv_field(std::string_view(text));
      continue;
    }
    const bool plain = field.find_first_of(",\"\r\n") == std::string_view::npos &&
                       !field.starts_with(' ') && !field.ends_with(' ');
    buffer_ += plain ? std::string(field) : quote_csv_field(field);
  }
  buffer_ += '\n';
  constexpr std::size_t flush_bytes = 1 << 16;
  if (buffer_.size() >= flush_bytes) flush_csv_buffer();
}

void CsvWriter::flush_csv_buffer() {
  file_.write(buffer_);
  buffer_.clear();
}

void CsvWriter::save_file() {
  flush_csv_buffer();
  file_.save_file();
}

void CsvWriter::save_without_fsync() {
  flush_csv_buffer();
  file_.save_without_fsync();
}

}  // namespace vlp
