// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gates.h"

namespace vlp {

/// What a figure has to be at most.
struct Gate {
  std::string name;
  double limit;
};

/// The figures that there are gates of, with what each needs, a line for each, for people.
std::string gate_descriptions();

/// The gate that "NAME=VALUE" says. Throws std::invalid_argument when the name is not known (and
/// says which are), or the value is not a finite number, is negative, or of `missing` above 1.
Gate gate_of(const std::string& text);

/// Reads `vlp-gates/1`:
///   format: vlp-gates/1
///   gates: {mean_mm: 1, p90_mm: 2, missing: 0}
/// Throws InputError: a name that is not known, a limit that gate_of() would refuse, no gate.
std::vector<Gate> read_gates(const std::filesystem::path& file);

/// In the order of the gates. Throws std::invalid_argument when there is no such figure, because
/// what it needs is not there. Precondition: the names are known.
std::vector<GateResult> check_gates(const std::vector<Gate>& gates, const Evaluation& evaluation);

/// For example "mean_mm is 1.25 mm, at most 1 mm is asked for".
std::string words_of(const GateResult& gate);

}  // namespace vlp
