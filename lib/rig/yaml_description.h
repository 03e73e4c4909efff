// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>
#include <string_view>
#include <type_traits>

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// A type in a YAML file is described once, for its reader and its writer:
///
///   template <typename Io>
///   void describe(Io& io, Described<Io, Dispersion> dispersion) {
///     io.required("radius_m", dispersion.radius_m, Range{0, 10, "m"});
///     io.optional("captures", dispersion.captures).check(dispersion.captures > 0, "is 0");
///   }
///
/// The functions of `io` are those of YamlMap, which reads, and of YamlWriter. A type that is only
/// read has a describe(YamlMap&, T&). Further arguments of required() and optional() are limits of
/// a value, or are passed on to describe() of a mapping. describe() is found by its arguments:
/// declare it in the namespace of the type, in a source file as static.

/// Reference to the described object: to a constant if it is written, otherwise to a variable.
template <typename Io, typename T>
using Described = std::conditional_t<Io::is_reader, T&, const T&>;

/// Valid numbers, from `min` to `max`; `unit` is for messages.
struct Range {
  double min, max;
  std::string_view unit = {};
};

/// Range of an id or of a count.
inline constexpr Range kAnyIndex{0, std::numeric_limits<int>::max()};

/// Words for the values of an enumeration, in its order from 0. Messages list them, with
/// `separator` in between, after `introduction`.
struct Words {
  std::span<const std::string_view> names;
  std::string_view introduction, separator = ", ";
};

/// Valid angles, from `min` to `max` degrees. The file is in degrees, the described value in rad.
struct DegreeRange {
  double min, max;
  std::string_view unit = "degrees";
};

/// Text that is written without quotes.
struct PlainText {};

/// True if a mapping in a list is written on several lines.
template <typename T>
inline constexpr bool kSpansLines = false;

}  // namespace vlp
#pragma GCC visibility pop
