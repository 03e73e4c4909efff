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

// Not installed: nothing for the shared library to show.
#pragma GCC visibility push(hidden)
namespace vlp {

class YamlMap;

/// Node of a YAML document. It takes a fifth of the memory of a YAML::Node.
struct YamlNode {
  enum class Kind { null, scalar, list, map };
  Kind kind = Kind::null;
  /// Counted from 1; 0 if it is unknown.
  std::size_t line = 0;
  /// Text of a scalar.
  std::string text;
  /// Items of a list; keys and values of a map, by turns.
  std::vector<YamlNode> children;
};

/// Part of a document, which is kept in memory as long as one of its parts is used.
using YamlPart = std::shared_ptr<const YamlNode>;

/// One value of a YAML document that knows where it stands. Each reader throws InputError with
/// file, line and key when the value is of another kind.
class YamlValue {
 public:
  YamlValue(YamlPart node, const std::filesystem::path* file, std::string key, std::size_t line);

  /// A finite number, in [min, max] when given; `unit` is for the message.
  double number() const;
  double number_within(double min, double max, std::string_view unit) const;
  int integer_within(int min, int max) const;
  bool boolean() const;
  std::string text() const;
  /// Exactly `count` numbers.
  std::vector<double> numbers(std::size_t count) const;
  std::vector<YamlValue> list() const;
  YamlMap map() const;

  InputError error(const std::string& problem) const;
  /// A word that is not among those that are known.
  InputError unknown(const std::string& known) const;

 private:
  YamlPart node_;
  const std::filesystem::path* file_;
  std::string key_;
  std::size_t line_;
};

/// A mapping: ask for every key that it may have, then call finish(). `file` outlives it.
class YamlMap {
 public:
  YamlMap(const YamlPart& node, const std::filesystem::path* file, std::string key);

  bool has(const std::string& key) const;
  YamlValue required(const std::string& key);
  std::optional<YamlValue> optional(const std::string& key);
  /// Throws InputError for the first key that nobody asked for.
  void finish() const;

  /// About the mapping as a whole.
  InputError error(const std::string& problem) const;

 private:
  InputError error(std::size_t line, const std::string& problem) const;

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

/// Parses the text of a YAML file, which may be other than a mapping, by yaml-cpp. Throws
/// InputError as read_yaml().
YAML::Node parse_yaml(const std::filesystem::path& file, const std::string& text);

/// Longest YAML file that is parsed: yaml-cpp needs 500 times as much memory for a YAML::Node.
inline constexpr std::size_t kMaxYamlBytes = std::size_t{1} << 20;

/// A YAML file that is a mapping. Throws InputError when it cannot be read or parsed, is longer
/// than 1 MiB, is not UTF-8, holds aliases or a second document, or is nested more than 20 levels
/// deep.
YamlMap read_yaml(const std::filesystem::path& file);
/// One whose first key is `format: NAME/VERSION`; throws InputError for other formats, too.
YamlMap read_yaml(const std::filesystem::path& file, const std::string& format);
void require_format(YamlMap& map, const std::string& format);

}  // namespace vlp
#pragma GCC visibility pop
