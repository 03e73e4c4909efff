// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Shared positioning library for robots: exported symbols, layout of types, dependencies.
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

/// The headers that are installed, from lib.
std::vector<std::string> headers() {
  std::vector<std::string> names;
  std::istringstream list(VLP_PUBLIC_HEADERS);
  for (std::string name; std::getline(list, name, ' ');) names.push_back(name);
  return names;
}

std::string read_header(const std::string& header) {
  return TemporaryFolder::read_content(std::filesystem::path(VLP_SOURCE_DIR "/lib") / header);
}

/// The words of the headers that are installed.
std::set<std::string> words_of_headers() {
  std::set<std::string> words;
  const std::regex word("[A-Za-z_][A-Za-z0-9_]*");
  for (const std::string& header : headers()) {
    const std::string text = read_header(header);
    for (std::sregex_iterator at(text.begin(), text.end(), word), end; at != end; ++at) {
      words.insert(at->str());
    }
  }
  return words;
}

/// "vlp::Positioner::compute_position_fix(...)": Positioner, compute_position_fix.
std::vector<std::string> names_in(const std::string& symbol) {
  std::vector<std::string> names;
  std::istringstream parts(symbol.substr(0, symbol.find_first_of("(<[")));
  for (std::string name; std::getline(parts, name, ':');) {
    if (!name.empty() && name != "vlp") names.push_back(name.substr(name.front() == '~' ? 1 : 0));
  }
  return names;
}

TEST(SharedLibrary, ExportsOnlySymbolsDeclaredInPublicHeaders) {
  const auto shown = run_program("nm -D --defined-only --demangle '" VLP_SHARED_LIBRARY "'");
  ASSERT_EQ(shown.exit_code, 0) << shown.errors;
  const std::set<std::string> words = words_of_headers();
  std::istringstream lines(shown.output);
  std::set<std::string> functions;
  for (std::string line; std::getline(lines, line);) {
    std::string symbol = line.substr(line.find(' ') + 3);
    // A weak function could be a user's own, compiled otherwise.
    EXPECT_NE(line[line.find(' ') + 1], 'W') << line;
    if (symbol.starts_with("vlp_")) {
      EXPECT_TRUE(words.contains(symbol)) << line;
      functions.insert(symbol);
      continue;
    }
    symbol = std::regex_replace(symbol, std::regex("^(typeinfo|typeinfo name|vtable) for "), "");
    ASSERT_TRUE(symbol.starts_with("vlp::")) << line;
    EXPECT_THAT(symbol, testing::Not(testing::HasSubstr("YAML"))) << line;
    for (const std::string& name : names_in(symbol)) {
      EXPECT_TRUE(words.contains(name)) << name << " is in no header: " << line;
    }
    functions.insert(symbol.substr(0, symbol.find('(')));
  }
  for (const char* function :
       {"vlp::Positioner::compute_position_fix", "vlp::read_calibration", "vlp::read_lamp_map",
        "vlp::describe_fix_status", "vlp::InputError::InputError",
        "vlp::LampDetector::LampDetector", "vlp::LampDetector::detect_lamps", "vlp_open",
        "vlp_detect", "vlp_locate"}) {
    EXPECT_THAT(functions, testing::Contains(function));
  }
}

TEST(SharedLibrary, ExportsAllFunctionsOfVlpHeader) {
  const auto shown = run_program("nm -D --defined-only '" VLP_SHARED_LIBRARY "'");
  const std::string text = read_header("positioning/vlp.h");
  const std::regex function(
      "\n[a-z_0-9]+\\*? \\*?(vlp_[a-z_]+)\\(|\nconst char\\* (vlp_[a-z_]+)\\(");
  std::size_t functions = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), function), end; at != end; ++at) {
    const std::string name = (*at)[1].matched ? (*at)[1] : (*at)[2];
    EXPECT_THAT(shown.output, testing::HasSubstr(" T " + name + "\n"));
    ++functions;
  }
  EXPECT_EQ(functions, 12U);
}

/// Alignment of Eigen's matrices follows the widest vector instructions: matrices of a multiple of
/// 32 bytes change with AVX, of 64 bytes with AVX-512.
TEST(SharedLibrary, PublicTypesHaveSameLayoutForAllProcessors) {
  const std::regex matrix("Eigen::(?:Matrix<double, ([0-9]+), ([0-9]+)>|(Matrix|Vector)([24])d)");
  for (const std::string& header : headers()) {
    const std::string text = read_header(header);
    if (!header.ends_with("types.h")) {
      for (std::sregex_iterator at(text.begin(), text.end(), matrix), end; at != end; ++at) {
        const auto& found = *at;
        const int size = found[1].matched       ? std::stoi(found[1]) * std::stoi(found[2])
                         : found[3] == "Matrix" ? std::stoi(found[4]) * std::stoi(found[4])
                                                : std::stoi(found[4]);
        EXPECT_NE(size % 4, 0) << header << ": " << found.str() << " wants Eigen::DontAlign";
      }
    }
  }
  // The compiler's own account of every class of the headers, for an old processor and a new one.
  const TemporaryFolder folder;
  folder.file("empty.cpp", "");
  const std::string begin = "cd '" + (folder / "").string() + "' && c++ -std=c++20 -fsyntax-only ";
  if (run_program(begin + "-fdump-lang-class=classes empty.cpp").exit_code != 0) {
    GTEST_SKIP() << "c++ has no -fdump-lang-class";
  }
#if defined(__x86_64__)
  const std::vector<std::string> processors = {"", "-mavx512f -mfma"};
#else
  const std::vector<std::string> processors = {""};
#endif
  std::string all;
  for (const std::string& header : headers()) all.append("#include \"" + header + "\"\n");
  const auto source = folder.file("all.cpp", all);
  std::string first;
  for (const std::string& processor : processors) {
    const auto result =
        run_program(begin + "-I'" VLP_SOURCE_DIR "/lib' -isystem '" VLP_EIGEN_DIR "' " + processor +
                    " -fdump-lang-class=classes all.cpp && " + "grep -A 2 '^Class vlp' classes");
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    if (first.empty()) first = result.output;
    EXPECT_EQ(result.output, first) << processor;
  }
  for (const char* type : {"vlp::Fix", "vlp::Calibration", "vlp::Sensors", "vlp_fix"}) {
    EXPECT_THAT(first, testing::HasSubstr(std::string("Class ") + type + "\n"));
  }
}

TEST(SharedLibrary, LinksNeitherOpencvNorOtherCalibrationLibraries) {
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
