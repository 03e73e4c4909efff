// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/program.h"

namespace vlp {

/// In what files of JSON are not as datasets/schemas/NAME.schema.json says, or, where they are,
/// what it would not notice if it were wrong (schema_check.py); empty when there is nothing.
inline std::string problems_by_schema(const std::string& name,
                                      const std::vector<std::filesystem::path>& files) {
  std::string command = VLP_SOURCE_DIR "/tests/support/schema_check.py " + name;
  for (const auto& file : files) command.append(" '").append(file.string()).append("'");
  const auto [code, problems, errors] = run_program(command);
  return code == 0 ? "" : problems + errors + "schema_check.py ended with " + std::to_string(code);
}

}  // namespace vlp
