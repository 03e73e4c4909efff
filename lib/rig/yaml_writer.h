// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>

// Not installed: nothing for the shared library to show.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Pieces of a YAML::Emitter document. Numbers are written with the fewest digits that read
/// back as the same double (std::invalid_argument when it is not finite); text is quoted, so that a
/// camera called 007 stays text.
void emit_number(YAML::Emitter& out, std::string_view key, double value);
void emit_integer(YAML::Emitter& out, std::string_view key, int value);
void emit_integers(YAML::Emitter& out, std::string_view key, std::span<const int> values);
void emit_text(YAML::Emitter& out, std::string_view key, const std::string& value);
/// A word that needs no quotes: a format, a model, an enumeration.
void emit_word(YAML::Emitter& out, std::string_view key, std::string_view value);
void emit_numbers(YAML::Emitter& out, std::string_view key, std::span<const double> values);
void emit_numbers(YAML::Emitter& out, std::string_view key,
                  const Eigen::Ref<const Eigen::VectorXd>& values);
/// A list inside a list.
void emit_row(YAML::Emitter& out, std::span<const double> values);

}  // namespace vlp
#pragma GCC visibility pop
