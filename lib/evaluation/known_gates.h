// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "evaluation/evaluation.h"

namespace vlp {

/// A figure that can be a gate.
struct KnownGate {
  const char* name;
  const char* unit;  // empty: none
  const char* what;  // for --help, and what it needs
  /// Nothing where the evaluation has no such figure.
  std::optional<double> (*figure)(const Evaluation&);
};

/// All of them, in the order in which they are told.
std::span<const KnownGate> known_gates();

}  // namespace vlp
