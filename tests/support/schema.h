// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/program.h"

namespace vlp {

/// Returns the violations of datasets/schemas/NAME.schema.json in JSON files. Without violations,
/// returns the changes that the schema would not detect (schema_check.py); empty if there are none.
inline std::string problems_by_schema(const std::string& name,
                                      const std::vector<std::filesystem::path>& files) {
  std::string command = VLP_SOURCE_DIR "/tests/support/schema_check.py " + name;
  for (const auto& file : files) command.append(" '").append(file.string()).append("'");
  const auto [code, problems, errors] = run_program(command);
  return code == 0 ? "" : problems + errors + "schema_check.py ended with " + std::to_string(code);
}

}  // namespace vlp
