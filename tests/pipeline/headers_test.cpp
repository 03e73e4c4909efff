// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Rules for all headers of lib/: types are named once, folders include each other in one
/// direction.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace vlp {
namespace {

namespace fs = std::filesystem;

const fs::path kLib = VLP_SOURCE_DIR "/lib";

std::string read_text(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// For each folder or sub-folder of lib/ the others that it includes, each with a file that does.
using FolderIncludes = std::map<std::string, std::map<std::string, std::string>>;

FolderIncludes read_folder_includes() {
  const std::regex include("(?:^|\n)#include \"([^\"]+)\"");
  FolderIncludes includes;
  for (const auto& entry : fs::recursive_directory_iterator(kLib)) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    const std::string text = read_text(entry.path());
    const fs::path folder = entry.path().parent_path();
    for (std::sregex_iterator at(text.begin(), text.end(), include), end; at != end; ++at) {
      const std::string name = (*at)[1];
      const fs::path header = fs::exists(folder / name) ? folder / name : kLib / name;
      EXPECT_TRUE(fs::exists(header)) << entry.path() << " includes " << name;
      const fs::path other = header.lexically_normal().parent_path();
      if (other == folder) continue;
      includes[fs::relative(folder, kLib)][fs::relative(other, kLib)] = entry.path().filename();
    }
  }
  return includes;
}

/// Folders of lib/ in the order in which they are built.
std::vector<std::string> read_build_order() {
  const std::string text = read_text(kLib / "CMakeLists.txt");
  const std::regex folder("\n *add_subdirectory\\((\\w+)\\)");
  std::vector<std::string> order;
  for (std::sregex_iterator at(text.begin(), text.end(), folder), end; at != end; ++at) {
    order.push_back((*at)[1]);
  }
  return order;
}

/// Two of a name in one namespace are undefined behavior where both are linked.
TEST(Headers, DefineEachTypeNameOnce) {
  const std::regex type("(?:^|\n)(?:struct|class|enum class|enum) (\\w+)[^;{\n]*\\{");
  std::map<std::string, std::set<std::string>> headers;
  for (const auto& entry : fs::recursive_directory_iterator(kLib)) {
    if (entry.path().extension() != ".h") continue;
    const std::string text = read_text(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), type), end; at != end; ++at) {
      headers[(*at)[1]].insert(entry.path().string());
    }
  }
  EXPECT_GT(headers.size(), 200U);
  for (const auto& [name, files] : headers) {
    EXPECT_EQ(files.size(), 1U) << name << ": " << testing::PrintToString(files);
  }
}

TEST(Headers, IncludeNoFolderThatIsBuiltLater) {
  const std::vector<std::string> order = read_build_order();
  const FolderIncludes includes = read_folder_includes();
  ASSERT_GT(order.size(), 10U);
  ASSERT_GT(includes.size(), 20U);
  const auto position = [&](const fs::path& folder) {
    return std::find(order.begin(), order.end(), *folder.begin()) - order.begin();
  };
  for (const auto& [folder, others] : includes) {
    EXPECT_LT(position(folder), std::ssize(order)) << folder;
    for (const auto& [other, file] : others) {
      EXPECT_LE(position(other), position(folder))
          << folder << "/" << file << " includes " << other;
    }
  }
}

/// Folders at the bottom (that include no other) and at the top (that no other includes) are
/// removed until none is left, or those in a cycle and between cycles.
TEST(Headers, IncludeSubfoldersWithoutCycle) {
  FolderIncludes remaining = read_folder_includes();
  ASSERT_GT(remaining.size(), 20U);
  const auto is_at_an_end = [&](const auto& folder) {
    const auto& others = folder.second;
    return std::none_of(others.begin(), others.end(),
                        [&](const auto& other) { return remaining.contains(other.first); }) ||
           std::none_of(remaining.begin(), remaining.end(),
                        [&](const auto& other) { return other.second.contains(folder.first); });
  };
  while (std::erase_if(remaining, is_at_an_end) > 0) {
  }
  std::vector<std::string> cycle;
  for (const auto& [folder, others] : remaining) {
    for (const auto& [other, file] : others) {
      if (remaining.contains(other)) cycle.push_back(folder + "/" + file + " includes " + other);
    }
  }
  EXPECT_THAT(cycle, testing::IsEmpty());
}

}  // namespace
}  // namespace vlp
