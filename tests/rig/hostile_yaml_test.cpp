// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "rig/samples.h"

// Files that exhaust memory, stack or time of a reader, by intent or by accident.
namespace vlp {
namespace {

using testing::HasSubstr;

const std::string kHead = "format: vlp-lamps/1\nlamps: ";
constexpr std::size_t kMaxBytes = 1 << 20;

/// Returns the message for a map whose lamps are `value`.
std::string refusal_of_lamps(const std::string& value) { return map_refusal(kHead + value + "\n"); }

std::string repeated(const std::string& text, std::size_t count) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

TEST(ReadYamlFile, RejectsNestingOf100000Levels) {
  constexpr std::size_t levels = 100000;
  const std::string deep = ": is nested too deep: is it the right file?";
  for (const std::string open : {"[", "{", "{a: ", "- ", "? ", "[{a: ", "[a, "}) {
    SCOPED_TRACE(open);
    const std::string nest = repeated(open, levels);
    EXPECT_EQ(refusal_of_lamps("\n  " + nest), "lamps.yaml:3" + deep);
    EXPECT_EQ(map_refusal(nest + "\n"), "lamps.yaml:1" + deep);
  }
  EXPECT_EQ(refusal_of_lamps(repeated("[", levels) + repeated("]", levels)), "lamps.yaml:2" + deep);
  std::string indented = kHead + "\n";
  for (std::size_t level = 1; level < 1000; ++level) indented += std::string(level, ' ') + "a:\n";
  EXPECT_THAT(map_refusal(indented), HasSubstr(deep));
}

TEST(ReadYamlFile, RejectsAliasesOfExponentialExpansion) {
  std::string bomb = "a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string alias = "*a" + std::to_string(i - 1);
    const std::string name = "a" + std::to_string(i);
    bomb.append(name).append(": &").append(name).append(" [").append(alias);
    bomb.append(repeated(", " + alias, 8)).append("]\n");
  }
  EXPECT_THAT(map_refusal("format: vlp-lamps/1\n" + bomb + "lamps: *a9\n"),
              HasSubstr("lamps.yaml:3: an alias (*) is not supported"));
}

// All keys are valid, but the file would need 400 GB.
TEST(ReadYamlFile, RejectsHistoryOfManyAliases) {
  std::string text = changed(kCalibrationYaml, "history:\n  - part", "history:\n  - &a\n    part");
  text = changed(text, "    inputs:\n",
                 "    inputs:\n" + repeated("      - {file: a, sha256: b}\n", 15000));
  text =
      changed(text, "  - part: dispersion", repeated("  - *a\n", 60000) + "  - part: dispersion");
  const TemporaryFolder folder;
  EXPECT_THAT(refusal(read_calibration, folder.file("calibration.yaml", text)),
              HasSubstr(": an alias (*) is not supported: write out the value"));
}

TEST(ReadYamlFile, RejectsFileAboveOneMebibyte) {
  std::string content = kLampsYaml + "#";
  content += std::string(kMaxBytes - content.size() - 1, 'x') + "\n";
  ASSERT_EQ(content.size(), kMaxBytes);
  EXPECT_EQ(map_refusal(content), "");
  const std::string refused = "lamps.yaml: is longer than 1 MiB: is it the right file?";
  EXPECT_EQ(map_refusal(content + "\n"), refused);

  const TemporaryFolder folder;
  const auto file = folder.file("lamps.yaml", kLampsYaml);
  std::filesystem::resize_file(file, 100'000'000);  // sparse
  EXPECT_EQ(refusal(read_lamp_map, file), refused);
}

TEST(ReadYamlFile, RejectsDeviceFile) {
  EXPECT_EQ(refusal(read_lamp_map, "/dev/zero"), "zero: is a pipe or a device, not a file");
}

TEST(ReadYamlFile, RejectsLampListOfManySmallNodesOrHugeScalar) {
  for (const std::string piece : {"1,", "[],", "{},", "&a 1,", "a: 1,", "'',", "? ,"}) {
    const std::string list = repeated(piece, 100'000 / piece.size()).append("]");
    EXPECT_THAT(refusal_of_lamps("[" + list), testing::StartsWith("lamps.yaml:2: "));
  }
  for (const std::string line :
       {"- a\n", "k: 1\n", "---\n", "#\n", "%A\n", "? \n", ": \n", "...\n"}) {
    const std::string lines = repeated(line, 100'000 / line.size());
    EXPECT_THAT(refusal_of_lamps("\n" + lines), testing::StartsWith("lamps.yaml:"));
  }
  EXPECT_THAT(refusal_of_lamps("'" + std::string(kMaxBytes - 100, 'a') + "'"),
              HasSubstr("lamps.yaml:2: lamps: should be a list, not 'aaaa"));
}

TEST(ReadLampMap, AcceptsTenThousandLamps) {
  std::string yaml = kHead + "\n";
  for (int id = 0; id < 10000; ++id) {
    yaml += "  - {id: " + std::to_string(id) + ", position_m: [" + std::to_string(id % 100) + ", " +
            std::to_string(id / 100) + ", 2.1]}\n";
  }
  const TemporaryFolder folder;
  EXPECT_EQ(read_lamp_map(folder.file("lamps.yaml", yaml)).lamps.size(), 10000U);
}

}  // namespace
}  // namespace vlp
