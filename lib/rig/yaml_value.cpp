// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>

#include "rig/yaml_reader.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

template <typename Number>
std::optional<Number> parsed(const YAML::Node& node) {
  if (!node.IsScalar()) return std::nullopt;
  const std::string& text = node.Scalar();
  const char* begin = text.data() + (text.starts_with('+') && !text.starts_with("+-") ? 1 : 0);
  Number value{};
  const auto [end, failure] = std::from_chars(begin, text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

YamlValue::YamlValue(const YAML::Node& node, const std::filesystem::path* file, std::string key,
                     std::size_t line)
    : node_(node), file_(file), key_(std::move(key)), line_(line) {}

double YamlValue::number() const {
  const auto value = parsed<double>(node_);
  if (!value || !std::isfinite(*value)) {
    throw error("should be a finite number, not " + shown(node_));
  }
  return *value;
}

double YamlValue::number_within(double min, double max, std::string_view unit) const {
  const double value = number();
  if (value < min || value > max) {
    throw error(shortest(value) + " " + std::string(unit) + " is not within " + shortest(min) +
                " and " + shortest(max) + " " + std::string(unit) + ": is it in the right unit?");
  }
  return value;
}

int YamlValue::integer_within(int min, int max) const {
  const auto value = parsed<int>(node_);
  if (!value || *value < min || *value > max) {
    throw error("should be a whole number within " + std::to_string(min) + " and " +
                std::to_string(max) + ", not " + shown(node_));
  }
  return *value;
}

bool YamlValue::boolean() const {
  if (node_.IsScalar() && node_.Scalar() == "true") return true;
  if (node_.IsScalar() && node_.Scalar() == "false") return false;
  throw error("should be true or false, not " + shown(node_));
}

std::string YamlValue::text() const {
  if (!node_.IsScalar()) throw error("should be text, not " + shown(node_));
  return node_.Scalar();
}

std::vector<double> YamlValue::numbers(std::size_t count) const {
  std::vector<double> values;
  for (const YamlValue& item : list()) values.push_back(item.number());
  if (values.size() != count) {
    throw error("should be " + std::to_string(count) + " numbers, not " +
                std::to_string(values.size()));
  }
  return values;
}

std::vector<YamlValue> YamlValue::list() const {
  if (!node_.IsSequence()) throw error("should be a list, not " + shown(node_));
  std::vector<YamlValue> items;
  for (const auto& item : node_) {
    items.emplace_back(item, file_, key_ + "[" + std::to_string(items.size()) + "]",
                       line_of(item.Mark()));
  }
  return items;
}

YamlMap YamlValue::map() const {
  if (!node_.IsMap()) throw error("should be a mapping of keys to values, not " + shown(node_));
  return {node_, file_, key_};
}

InputError YamlValue::error(const std::string& problem) const {
  return {*file_, line_, key_, problem};
}

InputError YamlValue::unknown(const std::string& known) const {
  return error(shown(node_) + " is unknown; " + known);
}

}  // namespace vlp
