// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {

/// vlp-intrinsics, in a folder of its own.
class VlpIntrinsics : public testing::Test {
 protected:
  ProgramResult calibrate(const std::string& images, const std::string& board,
                          const std::string& options = "") const {
    return run_program("vlp-intrinsics " + images + " --board " + board + " -o " +
                       (folder / "camera.yaml").string() + " " + options);
  }
  std::string content(const char* name) const {
    return TemporaryFolder::read_content(folder / name);
  }
  const TemporaryFolder folder;
};

}  // namespace vlp
