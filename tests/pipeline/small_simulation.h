// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <map>
#include <string>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {

/// 16 captures of four lamps, at rest, and 8 of a board, of 160 x 120 px: about 0.1 s.
extern const std::string kSmallScene;

/// The files below a folder: name and content. Those that a killed program leaves, whose names
/// begin with a dot, are left out.
using Files = std::map<std::string, std::string>;
Files files_below(const std::filesystem::path& folder);

/// The names alone, of the images among them.
std::vector<std::string> find_images(const Files& files);

/// Tests of vlp-simulate with the small scene, as it is or changed.
class SmallSimulation : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::filesystem::path scene = folder.file("scene.yaml", kSmallScene);
  std::filesystem::path output = folder / "output";

  /// Changes the scene, replacing the first `from`.
  void change_scene(const std::string& from, const std::string& to);

  std::string command(const std::string& options = "") const {
    return "vlp-simulate " + scene.string() + " -o " + output.string() + " " + options;
  }
  ProgramResult simulate(const std::string& options = "") const {
    return run_program(command(options));
  }
  /// Returns the files of an undisturbed run into another folder.
  Files undisturbed(const std::string& options = "") const;
};

}  // namespace vlp
