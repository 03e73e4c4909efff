// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// What a robot carries.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// The words of the headers that are installed.
std::set<std::string> words_of_headers() {
  std::set<std::string> words;
  const std::regex word("[A-Za-z_][A-Za-z0-9_]*");
  for (const char* folder : {"geometry", "camera", "rig", "positioning"}) {
    const std::filesystem::path all = std::filesystem::path(VLP_SOURCE_DIR "/lib") / folder;
    for (const auto& entry : std::filesystem::directory_iterator(all)) {
      const std::string name = entry.path().filename().string();
      const bool installed = name.ends_with(".h") && !name.starts_with("yaml_") && name != "file.h";
      if (!installed) continue;
      const std::string text = TemporaryFolder::content_of(entry.path());
      for (std::sregex_iterator at(text.begin(), text.end(), word), end; at != end; ++at) {
        words.insert(at->str());
      }
    }
  }
  return words;
}

/// "vlp::Positioner::locate(...)": Positioner, locate.
std::vector<std::string> names_in(const std::string& symbol) {
  std::vector<std::string> names;
  std::istringstream parts(symbol.substr(0, symbol.find_first_of("(<[")));
  for (std::string name; std::getline(parts, name, ':');) {
    if (!name.empty() && name != "vlp") names.push_back(name.substr(name.front() == '~' ? 1 : 0));
  }
  return names;
}

TEST(SharedLibrary, ShowsWhatItsHeadersDeclareAndNothingElse) {
  const auto shown = run_program("nm -D --defined-only --demangle '" VLP_SHARED_LIBRARY "'");
  ASSERT_EQ(shown.exit_code, 0) << shown.errors;
  const std::set<std::string> words = words_of_headers();
  std::istringstream lines(shown.output);
  std::set<std::string> functions;
  for (std::string line; std::getline(lines, line);) {
    std::string symbol = line.substr(line.find(' ') + 3);
    symbol = std::regex_replace(symbol, std::regex("^(typeinfo|typeinfo name|vtable) for "), "");
    ASSERT_TRUE(symbol.starts_with("vlp::")) << line;
    EXPECT_THAT(symbol, testing::Not(testing::HasSubstr("YAML"))) << line;
    for (const std::string& name : names_in(symbol)) {
      EXPECT_TRUE(words.contains(name)) << name << " is in no header: " << line;
    }
    functions.insert(symbol.substr(0, symbol.find('(')));
  }
  for (const char* function : {"vlp::Positioner::locate", "vlp::read_calibration",
                               "vlp::read_lamp_map", "vlp::explanation_of", "vlp::InputError"}) {
    EXPECT_THAT(functions, testing::Contains(function));
  }
}

TEST(SharedLibrary, NeedsNoneOfTheToolboxsLibraries) {
  auto result = run_program("ldd '" VLP_SHARED_LIBRARY "'");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  std::string& needed = result.output;
  ASSERT_THAT(needed, testing::HasSubstr("yaml-cpp"));
  std::transform(needed.begin(), needed.end(), needed.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* library :
       {"opencv", "mrcal", "ceres", "apriltag", "spdlog", "fmt", "libcsv", "cholmod"}) {
    EXPECT_THAT(needed, testing::Not(testing::HasSubstr(library)));
  }
}

}  // namespace
}  // namespace vlp
