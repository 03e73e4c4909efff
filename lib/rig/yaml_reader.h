// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "input_error.h"

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

  /// Returns a finite number. read_yaml_number_within() also throws InputError if it is outside
  /// [min, max]; `unit` is for the message.
  double read_yaml_number() const;
  double read_yaml_number_within(double min, double max, std::string_view unit) const;
  int read_yaml_integer_within(int min, int max) const;
  bool read_yaml_boolean() const;
  std::string read_yaml_string() const;
  /// Returns a list of exactly `count` finite numbers. read_yaml_numbers_within() also checks each
  /// one as read_yaml_number_within() does.
  std::vector<double> read_yaml_numbers(std::size_t count) const;
  std::vector<double> read_yaml_numbers_within(std::size_t count, double min, double max,
                                               std::string_view unit) const;
  std::vector<YamlValue> read_yaml_list() const;
  YamlMap read_yaml_mapping() const;
  /// Applies `read`, a function of a YamlMap&, to a mapping and returns its result. Throws
  /// InputError if the mapping has a key that `read` has not read.
  template <typename Read>
  auto convert_yaml_mapping(const Read& read) const;
  /// Applies `read` as convert_yaml_mapping() does to each item of a list of mappings. Returns the
  /// results in the order of the list.
  template <typename Read>
  auto convert_yaml_mapping_list(const Read& read) const;

  InputError make_yaml_error(const std::string& problem) const;
  /// Returns the error for a word that is not among the valid ones, `known`.
  InputError make_unknown_yaml_word_error(const std::string& known) const;

 private:
  YamlPart node_;
  const std::filesystem::path* file_;
  std::string key_;
  std::size_t line_;
};

/// A mapping. The caller reads every valid key, then calls check_all_yaml_keys_read(). `file` must
/// outlive it.
class YamlMap {
 public:
  YamlMap(const YamlPart& node, const std::filesystem::path* file, std::string key);

  bool has_yaml_key(const std::string& key) const;
  YamlValue get_required_yaml_value(const std::string& key);
  std::optional<YamlValue> get_optional_yaml_value(const std::string& key);
  /// Return the value of a key by YamlValue::read_yaml_number_within() or convert_yaml_mapping();
  /// std::nullopt if the mapping lacks the key.
  std::optional<double> get_optional_yaml_number(const std::string& key, double min, double max,
                                                 std::string_view unit);
  template <typename Read>
  auto convert_optional_yaml_mapping(const std::string& key, const Read& read) {
    const auto value = get_optional_yaml_value(key);
    return value ? std::optional(value->convert_yaml_mapping(read)) : std::nullopt;
  }
  /// Returns the list of a key by YamlValue::convert_yaml_mapping_list(); an empty list if the
  /// mapping lacks the key.
  template <typename Read>
  auto convert_yaml_mapping_list_or_empty(const std::string& key, const Read& read) {
    const auto value = get_optional_yaml_value(key);
    return value ? value->convert_yaml_mapping_list(read)
                 : decltype(value->convert_yaml_mapping_list(read))();
  }
  /// Checks that all keys of the mapping were read. Throws InputError for the first one that was
  /// not.
  void check_all_yaml_keys_read() const;

  /// Returns an error with `problem`, file, line and key of the mapping, to be thrown.
  InputError make_yaml_error(const std::string& problem) const;

 private:
  InputError make_yaml_error(std::size_t line, const std::string& problem) const;

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

template <typename Read>
auto YamlValue::convert_yaml_mapping(const Read& read) const {
  YamlMap keys = read_yaml_mapping();
  auto result = read(keys);
  keys.check_all_yaml_keys_read();
  return result;
}

template <typename Read>
auto YamlValue::convert_yaml_mapping_list(const Read& read) const {
  std::vector<decltype(convert_yaml_mapping(read))> results;
  for (const YamlValue& item : read_yaml_list()) results.push_back(item.convert_yaml_mapping(read));
  return results;
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
void check_yaml_file_format(YamlMap& map, const std::string& format);

}  // namespace vlp
#pragma GCC visibility pop
