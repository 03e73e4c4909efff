// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/csv_reader.h"

#include <csv.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <unordered_set>

#include "captures/csv_writer.h"
#include "rig/file.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Returns the text of a cell for a message, cut to 300 bytes.
std::string quote_cell(std::string_view text) {
  constexpr std::size_t max_bytes = 300;
  return "'" + truncate_text(text, max_bytes) + "'";
}

}  // namespace

/// Parser of a table by libcsv, which calls back for each field and each row. It is fed line by
/// line, so that a row has its line number.
struct CsvParsing {
  CsvTable& table;
  csv_parser parser{};
  std::size_t line = 0;
  std::size_t row_line = 0;  // line at which the row's first field ends
  std::size_t row_fields = 0;
  bool in_header = true;
  std::optional<InputError> error;

  explicit CsvParsing(CsvTable& into) : table(into) {
    csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI);
  }
  ~CsvParsing() { csv_free(&parser); }
  CsvParsing(const CsvParsing&) = delete;
  CsvParsing& operator=(const CsvParsing&) = delete;

  static void on_field(void* data, std::size_t size, void* self) {
    static_cast<CsvParsing*>(self)->add_field({static_cast<const char*>(data), size});
  }
  static void on_row(int, void* self) { static_cast<CsvParsing*>(self)->row(); }

  void add_field(std::string_view text) {
    if (row_fields++ == 0) row_line = line;
    if (text.starts_with('\'') && is_like_formula(text)) text.remove_prefix(1);
    if (in_header) {
      table.header_.emplace_back(text);
    } else {
      table.fields_ += text;
      table.ends_.push_back(table.fields_.size());
    }
  }

  void row() {
    if (!in_header) table.lines_.push_back(row_line);
    if (row_fields != table.header_.size() && !error) {
      // [FILE-4] `cut short` | file written incompletely or edited; decimal comma in a table |
      //   write it again
      error = InputError(table.file_, row_line, "",
                         "has " + std::to_string(row_fields) + " fields, the header has " +
                             std::to_string(table.header_.size()) + ": is the row cut short?");
    }
    row_fields = 0;
    in_header = false;
  }

  void parse(std::string_view content) {
    while (!content.empty() && !error) {
      const std::string_view text = content.substr(0, content.find('\n') + 1);
      content.remove_prefix(text.size());
      ++line;
      if (csv_parse(&parser, text.data(), text.size(), on_field, on_row, this) != text.size()) {
        error = InputError(table.file_, line, "", "a quote is not allowed here");
      }
    }
    if (!error && csv_fini(&parser, on_field, on_row, this) != 0) {
      error = InputError(table.file_, row_fields > 0 ? row_line : row_line + 1, "",
                         "a quote is not closed");
    }
    if (error) throw *error;
  }
};

CsvTable::CsvTable(const std::filesystem::path& file) : file_(file) {
  constexpr std::size_t max_bytes = std::size_t{2} << 30;
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  const std::string content = read_text_file(file, max_bytes);
  std::string_view text = content;
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  fields_.reserve(text.size());
  CsvParsing(*this).parse(text);
  std::unordered_set<std::string_view> names;
  for (const std::string& name : header_) {
    if (!names.insert(name).second) throw InputError(file_, 1, name, "this column occurs twice");
  }
}

CsvTable::Column CsvTable::require_column(std::string_view name) const {
  if (const auto column = find_column(name)) return *column;
  constexpr std::size_t max_names_bytes = 500;  // all columns of the program's tables
  std::string names;
  for (const std::string& have : header_) names += (names.empty() ? "" : ", ") + have;
  throw InputError(
      file_, 1, std::string(name),
      "this column is missing; the columns are: " + truncate_text(names, max_names_bytes));
}

std::optional<CsvTable::Column> CsvTable::find_column(std::string_view name) const {
  const auto found = std::find(header_.begin(), header_.end(), name);
  if (found == header_.end()) return std::nullopt;
  return Column{static_cast<std::size_t>(found - header_.begin())};
}

std::string_view CsvTable::get_cell_text(std::size_t row, Column column) const {
  const std::size_t field = row * header_.size() + column.index;
  const std::size_t begin = field == 0 ? 0 : ends_[field - 1];
  return std::string_view(fields_).substr(begin, ends_[field] - begin);
}

double CsvTable::get_cell_number(std::size_t row, Column column) const {
  const auto value = parse_number<double>(get_cell_text(row, column));
  if (!value || !std::isfinite(*value)) {
    throw make_cell_error(
        row, column, "should be a finite number, not " + quote_cell(get_cell_text(row, column)));
  }
  return *value;
}

double CsvTable::get_coordinate_m(std::size_t row, Column column) const {
  const double value_m = get_cell_number(row, column);
  if (std::abs(value_m) > kMaxCoordinate_m) {
    // [FILE-3] `within 1,000 km, in meters`
    throw make_cell_error(
        row, column,
        "should be within 1,000 km, in meters, not " + quote_cell(get_cell_text(row, column)));
  }
  return value_m;
}

int CsvTable::get_cell_integer(std::size_t row, Column column) const {
  const auto value = parse_number<int>(get_cell_text(row, column));
  if (!value) {
    throw make_cell_error(
        row, column, "should be a whole number, not " + quote_cell(get_cell_text(row, column)));
  }
  return *value;
}

std::optional<double> CsvTable::get_optional_number(std::size_t row,
                                                    std::optional<Column> column) const {
  if (!column || get_cell_text(row, *column).empty()) return std::nullopt;
  return get_cell_number(row, *column);
}

InputError CsvTable::make_cell_error(std::size_t row, Column column,
                                     const std::string& problem) const {
  return {file_, lines_[row], header_[column.index], problem};
}

std::string_view read_unique_name(const CsvTable& csv, std::size_t row, CsvTable::Column column,
                                  NameIndex& names) {
  const std::string_view name = csv.get_cell_text(row, column);
  if (name.empty()) throw csv.make_cell_error(row, column, "is empty");
  if (!names.insert_unique_name(name)) {
    throw csv.make_cell_error(row, column, "'" + std::string(name) + "' occurs twice");
  }
  return name;
}

}  // namespace vlp
