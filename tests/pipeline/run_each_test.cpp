// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/datasets.h"
#include "support/program.h"
#include "support/schema.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using nlohmann::json;

class RunEachLine : public testing::Test {
 protected:
  ProgramResult run(const std::string& lines) const {
    std::ofstream(folder / "lines") << lines;
    return run_program(
        fmt::format("vlp-calibrate --batch-stdin <'{}'", (folder / "lines").string()));
  }
  /// Returns the request for a session, with results next to it.
  std::string line(const std::string& session, int limit_s = 100) const {
    const std::string at = (folder / session).string();
    return json{{"arguments", {at, "-o", at + "-results"}}, {"limit_s", limit_s}}.dump() + "\n";
  }
  std::vector<json> answers(const std::string& output) const {
    std::vector<json> all;
    std::istringstream lines(output);
    for (std::string answer; std::getline(lines, answer);) {
      const auto file = folder / fmt::format("answer-{}.json", all.size());
      std::ofstream(file) << answer;
      EXPECT_EQ(problems_by_schema("answer", {file}), "");
      all.push_back(json::parse(answer));
    }
    return all;
  }

  TemporaryFolder folder;
};

TEST_F(RunEachLine, RunsNextLineAfterKillingRunAtTimeLimit) {
  // Images of 200 million pixels, which take no room on the disk.
  const auto session = folder / "endless";
  std::filesystem::create_directories(session / "rotation");
  std::filesystem::create_directories(session / "boards");
  for (const char* name : {"lamps.yaml", "board.yaml"}) {
    std::filesystem::copy_file(kRig + "/" + name, session / name);
  }
  const auto image = session / "boards/0.pgm";
  std::ofstream(image) << "P5\n20000 10000\n255\n";
  std::filesystem::resize_file(image, 200'000'019);
  for (int i = 1; i < 100; ++i) {
    std::filesystem::create_hard_link(image, session / "boards" / (std::to_string(i) + ".pgm"));
  }
  const auto [code, output, errors] = run(line("endless", 1) + line("nowhere"));
  EXPECT_EQ(code, 0);
  const auto all = answers(output);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].at("exit_code"), -SIGALRM) << output;
  EXPECT_EQ(all[1].at("exit_code"), 2);
}

TEST_F(RunEachLine, RejectsInvalidLine) {
  for (const std::string bad :
       {"x", R"({"arguments": "a", "limit_s": 1})", R"({"arguments": ["a"], "limit_s": 0})",
        R"({"arguments": ["a"], "limit_s": 4294967297})"}) {
    const auto [code, output, errors] = run(line("nowhere") + bad + "\n" + line("nowhere"));
    EXPECT_EQ(code, 2);
    EXPECT_EQ(answers(output).size(), 1U);
    EXPECT_EQ(
        errors,
        "vlp-calibrate: error: stdin: a line is not {\"arguments\": [\"...\"], \"limit_s\": 1 to "
        "86400}: " +
            bad + "\n");
  }
  EXPECT_LT(run(std::string(100'000, 'x') + "\n").errors.size(), 500U);
}

}  // namespace
}  // namespace vlp
