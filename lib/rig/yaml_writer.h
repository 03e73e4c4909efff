// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "../geometry/angles.h"
#include "yaml_description.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Result of YamlWriter in place of YamlField: nothing is checked when a value is written.
struct WrittenField {
  void check(bool, std::string_view) const {}
  void check_range(const Range&) const {}
  WrittenField item(std::size_t) const { return {}; }
};

/// Writer of the keys of a described type to the current map of a YAML document, in the order of
/// the description. The functions are those of YamlMap.
class YamlWriter {
 public:
  static constexpr bool is_reader = false;

  explicit YamlWriter(YAML::Emitter& out) : out_(out) {}

  template <typename T, typename... Limits>
  WrittenField required(std::string_view key, const T& value, const Limits&... limits) {
    out_ << YAML::Key << std::string(key) << YAML::Value;
    write_value(*this, value, limits...);
    return {};
  }
  /// Writes a value unless it is std::nullopt, an empty list or equal to T().
  template <typename T, typename... Limits>
  WrittenField optional(std::string_view key, const std::optional<T>& value,
                        const Limits&... limits) {
    return value ? required(key, *value, limits...) : WrittenField();
  }
  template <typename T, typename... Limits>
  WrittenField optional(std::string_view key, const std::vector<T>& value,
                        const Limits&... limits) {
    return value.empty() ? WrittenField() : required(key, value, limits...);
  }
  template <typename T, typename... Limits>
  WrittenField optional(std::string_view key, const T& value, const Limits&... limits) {
    return value == T() ? WrittenField() : required(key, value, limits...);
  }
  template <typename T, typename... Limits>
  WrittenField optional_with_default(std::string_view key, const T& value,
                                     const Limits&... limits) {
    return required(key, value, limits...);
  }
  template <typename T>
  void required_last(std::string_view key, const T& value) {
    last_.emplace_back([this, key, &value] { required(key, value); });
  }
  void refuse(std::string_view, std::string_view) const {}
  /// Writes a part of a value to the document.
  template <typename T>
  YamlWriter& operator<<(const T& part) {
    out_ << part;
    return *this;
  }
  YAML::Emitter& begin_map() { return out_ << YAML::BeginMap; }
  /// Writes the values of required_last() and ends the map.
  void end_map() {
    for (const auto& write : last_) write();
    out_ << YAML::EndMap;
  }

 private:
  YAML::Emitter& out_;
  std::vector<std::function<void()>> last_;
};

/// Write a value. Numbers have the shortest text that parses to the same double;
/// std::invalid_argument if not finite. Text is quoted, so that a camera called 007 remains text.
/// Lists are on one line, those of mappings on a line for each (kSpansLines).
void write_value(YamlWriter& out, double value);
inline void write_value(YamlWriter& out, double value, const Range&) { write_value(out, value); }
inline void write_value(YamlWriter& out, double value_rad, const DegreeRange&) {
  write_value(out, deg_from_rad(value_rad));
}
inline void write_value(YamlWriter& out, int value) { out << value; }
inline void write_value(YamlWriter& out, int value, const Range&) { out << value; }
inline void write_value(YamlWriter& out, bool value) { out << value; }
inline void write_value(YamlWriter& out, const std::string& value) {
  out << YAML::DoubleQuoted << value;
}
inline void write_value(YamlWriter& out, const std::string& value, PlainText) { out << value; }
inline void write_value(YamlWriter& out, const std::string& value, const Words&) { out << value; }
template <typename Enumeration>
requires std::is_enum_v<Enumeration> || std::is_same_v<Enumeration, bool>
void write_value(YamlWriter& out, Enumeration value, const Words& words) {
  out << std::string(words.names[static_cast<std::size_t>(value)]);
}
template <typename List, typename... Limits>
void write_list(YamlWriter& out, const List& values, const Limits&... limits) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const auto& value : values) write_value(out, value, limits...);
  out << YAML::EndSeq;
}
template <typename T, std::size_t N, typename... Limits>
void write_value(YamlWriter& out, const std::array<T, N>& values, const Limits&... limits) {
  write_list(out, values, limits...);
}
template <int N, typename... Limits>
void write_value(YamlWriter& out, const Eigen::Matrix<double, N, 1>& values,
                 const Limits&... limits) {
  write_list(out, values, limits...);
}
inline void write_value(YamlWriter& out, const std::vector<double>& values, std::size_t) {
  write_list(out, values);
}
template <typename T, typename... Context>
void write_value(YamlWriter& out, const std::vector<T>& values, const Context&... context) {
  if constexpr (requires(YamlWriter & io) { describe(io, values.front(), context...); }) {
    out << YAML::BeginSeq;
    for (const T& value : values) {
      if (!kSpansLines<T>) out << YAML::Flow;
      write_value(out, value, context...);
    }
    out << YAML::EndSeq;
  } else {
    write_list(out, values, context...);
  }
}
template <typename T, typename... Context>
void write_value(YamlWriter& out, const T& value, const Context&... context) {
  YamlWriter writer(out.begin_map());
  describe(writer, value, context...);
  writer.end_map();
}

/// Formats a document of a described type; its first key is `format`.
template <typename T>
std::string format_document(const std::string& format, const T& value) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  YamlWriter writer(out);
  writer.required("format", format, PlainText());
  describe(writer, value);
  writer.end_map();
  out << YAML::Newline;
  return out.c_str();
}

}  // namespace vlp
#pragma GCC visibility pop
