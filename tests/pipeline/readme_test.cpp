// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The README's commands of our programs work as typed, in the order in which they stand there.
#include <gmock/gmock.h>

#include <fstream>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// The indented command lines that begin with one of our programs or cp, joined where a backslash
/// says so.
std::vector<std::string> commands_in(const std::string& file) {
  std::vector<std::string> commands;
  std::ifstream readme(file);
  bool continues = false;
  for (std::string line; std::getline(readme, line);) {
    if (continues) {
      commands.back() += line;
    } else if (line.starts_with("    build/bin/vlp-") || line.starts_with("    cp ")) {
      commands.push_back(line.substr(4));
    } else {
      continue;
    }
    continues = line.ends_with('\\');
    if (continues) commands.back().pop_back();
  }
  return commands;
}

TEST(Readme, ItsCommandsWorkAsTyped) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "hundreds of images; the programs' own tests run under the sanitizers";
#endif
  const auto commands = commands_in(VLP_SOURCE_DIR "/README.md");
  ASSERT_GT(commands.size(), 10U);
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "build");
  std::filesystem::create_directories(folder / "out");
  std::filesystem::create_directory_symlink(VLP_PROGRAMS_DIR, folder / "build/bin");
  for (const char* name : {"datasets", "scripts"}) {
    std::filesystem::create_directory_symlink(std::string(VLP_SOURCE_DIR "/") + name,
                                              folder / name);
  }
  for (const auto& command : commands) {
    const auto result = run_program("cd '" + (folder / "").string() + "' && " + command);
    EXPECT_EQ(result.exit_code, 0) << command << "\n" << result.errors;
  }
}

}  // namespace
}  // namespace vlp
