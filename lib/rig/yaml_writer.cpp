// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_writer.h"

#include <cmath>
#include <stdexcept>

#include "rig/yaml_text.h"

namespace vlp {
namespace {

std::string format_finite_number(double value) {
  if (!std::isfinite(value)) throw std::invalid_argument("a number to be saved is not finite");
  return format_shortest_exact_number(value);
}

YAML::Emitter& emit_key(YAML::Emitter& out, std::string_view key) {
  return out << YAML::Key << std::string(key) << YAML::Value;
}

}  // namespace

void emit_yaml_number(YAML::Emitter& out, std::string_view key, double value) {
  emit_key(out, key) << format_finite_number(value);
}

void emit_yaml_integer(YAML::Emitter& out, std::string_view key, int value) {
  emit_key(out, key) << value;
}

void emit_yaml_integers(YAML::Emitter& out, std::string_view key, std::span<const int> values) {
  emit_key(out, key) << YAML::Flow << YAML::BeginSeq;
  for (const int value : values) out << value;
  out << YAML::EndSeq;
}

void emit_yaml_quoted_text(YAML::Emitter& out, std::string_view key, const std::string& value) {
  emit_key(out, key) << YAML::DoubleQuoted << value;
}

void emit_yaml_plain_word(YAML::Emitter& out, std::string_view key, std::string_view value) {
  emit_key(out, key) << std::string(value);
}

void emit_yaml_numbers(YAML::Emitter& out, std::string_view key, std::span<const double> values) {
  emit_key(out, key);
  emit_yaml_inline_list(out, values);
}

void emit_yaml_numbers(YAML::Emitter& out, std::string_view key,
                       const Eigen::Ref<const Eigen::VectorXd>& values) {
  emit_yaml_numbers(out, key, std::span(values.data(), static_cast<std::size_t>(values.size())));
}

void emit_yaml_inline_list(YAML::Emitter& out, std::span<const double> values) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const double value : values) out << format_finite_number(value);
  out << YAML::EndSeq;
}

}  // namespace vlp
