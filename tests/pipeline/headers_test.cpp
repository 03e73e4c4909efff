// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// What one program may not hold twice.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Two of a name in one namespace are undefined behaviour where both are linked.
TEST(Headers, NameEachTypeOnce) {
  const std::regex type("(?:^|\n)(?:struct|class|enum class|enum) (\\w+)[^;{\n]*\\{");
  std::map<std::string, std::set<std::string>> headers;
  for (const auto& entry : fs::recursive_directory_iterator(VLP_SOURCE_DIR "/lib")) {
    if (entry.path().extension() != ".h") continue;
    std::ifstream file(entry.path());
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    for (std::sregex_iterator at(text.begin(), text.end(), type), end; at != end; ++at) {
      headers[(*at)[1]].insert(entry.path().string());
    }
  }
  EXPECT_GT(headers.size(), 200U);
  for (const auto& [name, files] : headers) {
    EXPECT_EQ(files.size(), 1U) << name << ": " << testing::PrintToString(files);
  }
}

}  // namespace
}  // namespace vlp
