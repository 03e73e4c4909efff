// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "../geometry/angles.h"
#include "input_error.h"
#include "yaml_description.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

class YamlMap;

/// Node of a YAML document. It takes a fifth of the memory of a YAML::Node.
struct YamlNode {
  enum class Kind { null, scalar, list, map };
  Kind kind = Kind::null;
  /// Line of the file at which the node begins, counted from 1; 0 if unknown.
  std::size_t line = 0;
  /// Text of a scalar; empty for other nodes.
  std::string text;
  /// Items of a list; keys and values of a map, alternating.
  std::vector<YamlNode> children;
};

/// Part of a document. The document stays in memory as long as one of its parts is used.
using YamlPart = std::shared_ptr<const YamlNode>;

/// A value of a YAML document with its position in the file. Each reader throws InputError with
/// file, line and key if the value has another type.
class YamlValue {
 public:
  YamlValue(YamlPart node, const std::filesystem::path* file, std::string key, std::size_t line);

  /// Return a finite number; an integer. Throw InputError if it is outside the range, too.
  double read_number() const;
  double read_number(const Range& range) const;
  int read_integer(const Range& range) const;
  bool read_boolean() const;
  std::string read_text() const;
  /// Returns the index of the value's word. Throws InputError for other words.
  std::size_t read_word(const Words& words) const;
  /// Returns a list of exactly `count` finite numbers.
  std::vector<double> read_numbers(std::size_t count) const;
  std::vector<YamlValue> read_list() const;
  YamlMap read_mapping() const;

  InputError make_error(const std::string& problem) const;
  /// Returns the error for a word that is not among the valid ones, `known`.
  InputError make_word_error(const std::string& known) const;

 private:
  YamlPart node_;
  const std::filesystem::path* file_;
  std::string key_;
  std::size_t line_;
};

/// A value that a description has read, for further checks of it. They pass if the file lacks the
/// value.
class YamlField {
 public:
  YamlField(std::optional<YamlValue> value) : value_(std::move(value)) {}

  /// Returns true if the file has the value.
  explicit operator bool() const { return value_.has_value(); }
  /// Throws InputError with `problem` at the value if it is not valid.
  void check(bool is_valid, std::string_view problem) const;
  /// Throws InputError if a number is outside the range.
  void check_range(const Range& range) const;
  /// Returns an item of a list. @pre The list has it.
  YamlField item(std::size_t index) const;

 private:
  std::optional<YamlValue> value_;
};

/// A mapping. The caller reads every valid key, then calls check_all_keys_read(). `file` must
/// outlive it.
class YamlMap {
 public:
  static constexpr bool is_reader = true;

  YamlMap(const YamlPart& node, const std::filesystem::path* file, std::string key);

  bool has(const std::string& key) const;
  /// Returns the value of a key. Throws InputError if the mapping lacks it.
  YamlValue require(const std::string& key);
  std::optional<YamlValue> find(const std::string& key);
  /// Read the value of a key into `target` by read_value(). optional() leaves `target` unchanged if
  /// the mapping lacks the key.
  template <typename T, typename... Limits>
  YamlField required(const std::string& key, T&& target, const Limits&... limits) {
    YamlValue value = require(key);
    read_value(value, target, limits...);
    return {std::move(value)};
  }
  template <typename T, typename... Limits>
  YamlField optional(const std::string& key, T&& target, const Limits&... limits) {
    auto value = find(key);
    if (value) read_value(*value, target, limits...);
    return {std::move(value)};
  }
  /// optional() of a key that is always written.
  template <typename T, typename... Limits>
  YamlField optional_with_default(const std::string& key, T&& target, const Limits&... limits) {
    return optional(key, target, limits...);
  }
  /// required() of a key that a writer writes after the others, so that a truncated file lacks it.
  template <typename T>
  YamlField required_last(const std::string& key, T& target) {
    return required(key, target);
  }
  /// Throws InputError with `problem` if the mapping has a key that is no longer valid.
  void refuse(const std::string& key, std::string_view problem) const { check(!has(key), problem); }
  /// Checks that all keys of the mapping were read. Throws InputError for the first one that was
  /// not.
  void check_all_keys_read() const;

  /// Throws InputError with `problem`, file, line and key of the mapping if it is not valid.
  void check(bool is_valid, std::string_view problem) const;
  /// Returns an error with `problem`, file, line and key of the mapping, to be thrown.
  InputError make_error(const std::string& problem) const;

 private:
  InputError make_error(std::size_t line, const std::string& problem) const;

  struct Entry {
    std::string key;
    std::size_t line;
    YamlPart value;
  };
  const std::filesystem::path* file_;
  std::string prefix_;
  std::size_t line_;
  std::vector<Entry> entries_;
  std::vector<std::string> known_;
};

/// A function that reads a value into a T.
template <typename Read, typename T>
concept ReaderOf = std::invocable<Read, const YamlValue&, T&>;
template <typename T, typename... Context>
concept ReadWithLimits = (!ReaderOf<Context, T> && ...);

/// Read a value into `target`. Limits of a list apply to each item. A mapping is read by
/// describe(). In place of limits, a function of a YamlValue, or of a YamlMap&, and of `target` may
/// be given.
/// @throws InputError if the value is invalid, or if a mapping has a key that was not read
inline void read_value(const YamlValue& value, double& target) { target = value.read_number(); }
inline void read_value(const YamlValue& value, double& target, const Range& range) {
  target = value.read_number(range);
}
inline void read_value(const YamlValue& value, double& target, const DegreeRange& range) {
  target = rad_from_deg(value.read_number({range.min, range.max, range.unit}));
}
inline void read_value(const YamlValue& value, int& target, const Range& range = kAnyIndex) {
  target = value.read_integer(range);
}
inline void read_value(const YamlValue& value, bool& target) { target = value.read_boolean(); }
inline void read_value(const YamlValue& value, std::string& target, PlainText = {}) {
  target = value.read_text();
}
inline void read_value(const YamlValue& value, std::string& target, const Words& words) {
  target = words.names[value.read_word(words)];
}
inline void read_value(const YamlValue& value, std::vector<double>& target, std::size_t count) {
  target = value.read_numbers(count);
}
template <typename Enumeration>
requires std::is_enum_v<Enumeration> || std::is_same_v<Enumeration, bool>
void read_value(const YamlValue& value, Enumeration& target, const Words& words) {
  target = static_cast<Enumeration>(value.read_word(words));
}
template <int N, typename... Limits>
requires ReadWithLimits<Eigen::Matrix<double, N, 1>, Limits...>
void read_value(const YamlValue& value, Eigen::Matrix<double, N, 1>& target,
                const Limits&... limits) {
  value.read_numbers(N);
  for (Eigen::Index i = 0; const YamlValue& item : value.read_list())
    read_value(item, target[i++], limits...);
}
template <typename... Limits>
requires ReadWithLimits<std::pair<double, double>, Limits...>
void read_value(const YamlValue& value, std::pair<double, double>& target,
                const Limits&... limits) {
  Eigen::Vector2d numbers;
  read_value(value, numbers, limits...);
  target = {numbers[0], numbers[1]};
}
template <typename T, typename Read>
requires ReaderOf<Read, T>
void read_value(const YamlValue& value, T& target, const Read& read) { read(value, target); }
template <typename T, typename... Context>
requires ReadWithLimits<std::optional<T>, Context...>
void read_value(const YamlValue& value, std::optional<T>& target, const Context&... context) {
  read_value(value, target.emplace(), context...);
}
template <typename T, typename... Context>
requires ReadWithLimits<std::vector<T>, Context...>
void read_value(const YamlValue& value, std::vector<T>& target, const Context&... context) {
  target.clear();
  for (const YamlValue& item : value.read_list())
    read_value(item, target.emplace_back(), context...);
}
template <typename T, typename... Context>
void read_value(const YamlValue& value, T& target, const Context&... context) {
  YamlMap map = value.read_mapping();
  if constexpr (sizeof...(Context) == 1 && (std::invocable<Context, YamlMap&, T&> && ...)) {
    (context(map, target), ...);
  } else {
    describe(map, target, context...);
  }
  map.check_all_keys_read();
}

/// Parses the text of a YAML file, which may be other than a mapping, by yaml-cpp. Throws
/// InputError as read_yaml_file().
YAML::Node parse_yaml_text(const std::filesystem::path& file, const std::string& text);

/// Maximum size of a YAML file that is parsed: yaml-cpp needs 500 times as much memory for a
/// YAML::Node.
inline constexpr std::size_t kMaxYamlBytes = std::size_t{1} << 20;

/// Reads a YAML file that is a mapping.
/// @throws InputError if it cannot be read or parsed, is longer than 1 MiB or is not UTF-8; if it
///     contains aliases or a second document, or is nested more than 20 levels deep
YamlMap read_yaml_file(const std::filesystem::path& file);
/// Reads a YAML file with the first key `format: NAME/VERSION`. Throws InputError for other
/// formats, too.
YamlMap read_yaml_file(const std::filesystem::path& file, const std::string& format);
/// Checks that the key `format` of a mapping has this value. Throws InputError otherwise.
void check_yaml_format(YamlMap& map, const std::string& format);
/// Reads a file of a described type. Throws InputError as read_yaml_file() and read_value().
template <typename T>
T read_yaml_document(const std::filesystem::path& file, const std::string& format) {
  YamlMap map = read_yaml_file(file, format);
  T document{};
  describe(map, document);
  map.check_all_keys_read();
  return document;
}

}  // namespace vlp
#pragma GCC visibility pop
