// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Writers for parts of a YAML::Emitter document. Numbers have the shortest text that parses to the
/// same double; std::invalid_argument if not finite. Text is quoted, so that a camera called 007
/// remains text.
void emit_yaml_number(YAML::Emitter& out, std::string_view key, double value);
void emit_yaml_integer(YAML::Emitter& out, std::string_view key, int value);
void emit_yaml_integers(YAML::Emitter& out, std::string_view key, std::span<const int> values);
void emit_yaml_quoted_text(YAML::Emitter& out, std::string_view key, const std::string& value);
/// Writes `key: value` to the current map, with a word as value that needs no quotes: a format, a
/// model, an enumerator.
void emit_yaml_plain_word(YAML::Emitter& out, std::string_view key, std::string_view value);
void emit_yaml_numbers(YAML::Emitter& out, std::string_view key, std::span<const double> values);
void emit_yaml_numbers(YAML::Emitter& out, std::string_view key,
                       const Eigen::Ref<const Eigen::VectorXd>& values);
/// Writes a list of numbers as an element of the current list, on one line.
void emit_yaml_inline_list(YAML::Emitter& out, std::span<const double> values);

}  // namespace vlp
#pragma GCC visibility pop
