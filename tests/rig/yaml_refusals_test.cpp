// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "rig/samples.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(ReadYamlFile, RejectsFileOfOtherFormat) {
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "vlp-lamps/1", "vlp-lamps/2")),
            "lamps.yaml:1: format: should be 'vlp-lamps/1', not 'vlp-lamps/2': is it the right "
            "file?");
  EXPECT_THAT(map_refusal(kBoardYaml), HasSubstr("lamps.yaml:1: format: should be 'vlp-lamps/1', "
                                                 "not 'vlp-board/1': is it the right file?"));
  EXPECT_EQ(map_refusal("format:\nlamps: []\n"),
            "lamps.yaml:1: format: should be text, not nothing");
  const TemporaryFolder folder;
  const auto lamps = folder.file("lamps.yaml", kLampsYaml);
  EXPECT_THAT(refusal(read_board, lamps), HasSubstr("should be 'vlp-board/1', not 'vlp-lamps/1'"));
  EXPECT_THAT(refusal(read_calibration, lamps), HasSubstr("should be 'vlp-calibration/1', not "));
}

TEST(ReadYamlFile, RejectsDocumentThatIsNotOneMapping) {
  EXPECT_EQ(map_refusal("- 1\n"),
            "lamps.yaml:1: should be a mapping of keys to values, not a list");
  EXPECT_EQ(map_refusal("lamps\n"),
            "lamps.yaml:1: should be a mapping of keys to values, not 'lamps'");
  EXPECT_EQ(map_refusal(kLampsYaml + "---\n" + kLampsYaml),
            "lamps.yaml:5: a second YAML document begins; the file should contain one");
  EXPECT_EQ(map_refusal("# nothing\n"), "lamps.yaml: contains no YAML document");
  EXPECT_EQ(map_refusal("\n"), "lamps.yaml: contains no YAML document");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\n[a, b]: 1\n"),
            "lamps.yaml:2: a key should be a word");
}

TEST(ReadYamlFile, ReportsLineOfInvalidYaml) {
  const std::string head = "format: vlp-lamps/1\nlamps:\n";
  for (const std::string line : {"  - {id: 1]\n", "  - {id: 1\nx: 1\n", "  - %\n", "  - @\n",
                                 "  - *unknown\n", "  - a: b: c\n", "\t- {id: 1}\n"}) {
    EXPECT_THAT(map_refusal(head + line), testing::ContainsRegex("^lamps.yaml:[3-5]: is not valid"))
        << line;
  }
  EXPECT_THAT(map_refusal(head + "\t- {id: 1}\n"),
              HasSubstr("(there are tabs: YAML is indented with spaces)"));
}

TEST(ReadYamlFile, RejectsAliases) {
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\nlamps:\n  - &lamp {id: 1, position_m: [0, 0, 2]}\n"
                        "  - *lamp\n"),
            "lamps.yaml:4: an alias (*) is not supported: write out the value");
  EXPECT_THAT(map_refusal("format: vlp-lamps/1\nlamps: &a [*a]\n"), HasSubstr(":2: an alias"));
}

TEST(ReadYamlFile, AcceptsWindowsLineEndingsAndByteOrderMark) {
  std::string windows = "\xEF\xBB\xBF";
  for (const char c : kLampsYaml) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const TemporaryFolder folder;
  expect_same(read_lamp_map(folder.file("lamps.yaml", windows)), sample_lamps());
  // The line is counted in the same way.
  EXPECT_EQ(map_refusal(changed(windows, "id: 7", "id: 1")),
            "lamps.yaml:4: lamps[1]: id 1 occurs twice");
}

TEST(ReadYamlFile, RejectsFileWithoutFinalNewline) {
  EXPECT_EQ(map_refusal(kLampsYaml.substr(0, kLampsYaml.size() - 1)),
            "lamps.yaml:4: the last line has no end: is the file cut short? If it is complete, end "
            "it with a newline");
}

TEST(ReadYamlFile, RejectsEmptyBinaryOrNonUtf8File) {
  EXPECT_EQ(map_refusal(""), "lamps.yaml: is empty");
  EXPECT_EQ(map_refusal("\x89PNG\r\n\x1a\n"), "lamps.yaml:2: is not a text file");
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "id: 7", std::string("id: 7\0", 6))),
            "lamps.yaml:4: is not a text file");
  std::string utf16;
  for (const char c : kLampsYaml) utf16 += {c, '\0'};
  EXPECT_EQ(map_refusal("\xFF\xFE" + utf16), "lamps.yaml:1: is not a text file");
  for (const std::string bad :
       {"\xE9 t\xE9", "\xC0\x80", "\xE0\x80\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\x80",
        "\xE2\x82", "\xF8\x88\x80\x80\x80", "\xFF"}) {
    EXPECT_EQ(map_refusal(changed(kLampsYaml, "lamps:\n", "lamps:  # " + bad + "\n")),
              "lamps.yaml:2: is not UTF-8 text: save it in that encoding");
  }
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "lamps:\n", "lamps:  # \u00e9 \u20ac \U0001F4A1\n")),
            "");
}

TEST(ReadYamlFile, RejectsMissingFileAndFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "folder.yaml");
  std::filesystem::create_symlink("folder/missing", folder / "dangling");
  const std::string missing = "cannot be opened: No such file or directory";
  EXPECT_EQ(refusal(read_lamp_map, folder / "missing.yaml"), "missing.yaml: " + missing);
  EXPECT_EQ(refusal(read_lamp_map, folder / "folder.yaml"), "folder.yaml: is a folder, not a file");
  EXPECT_EQ(refusal(read_lamp_map, folder / "dangling"), "dangling: " + missing);
  EXPECT_EQ(refusal(read_lamp_map, ""), ": " + missing);
}

TEST(ReadYamlFile, ErrorIsOneLineOfFewerThan300Characters) {
  const auto refusal_of_lamp = [](const std::string& key) {
    return map_refusal("format: vlp-lamps/1\nlamps:\n  - {id: 1, position_m: [0, 0, 2], " + key +
                       "}\n");
  };
  const std::string long_word(1000, 'x');
  for (const std::string& found :
       {refusal_of_lamp("\"a\\nb\\e[2J\": 1"), refusal_of_lamp("duty: \"a\\nb\\e[2J\""),
        refusal_of_lamp(long_word + ": 1"), refusal_of_lamp("duty: " + long_word),
        map_refusal("format: " + long_word + "\n"),
        map_refusal("format: vlp-lamps/1\n" + long_word + ": 1\n")}) {
    EXPECT_THAT(found, StartsWith("lamps.yaml:"));
    EXPECT_THAT(found, Not(testing::ContainsRegex("[\n\r\x1b]")));
    EXPECT_LT(found.size(), 300U);
  }
  // A long word is not cut within a character.
  EXPECT_THAT(refusal_of_lamp("duty: " + std::string(39, 'x') + "\u00e9\u00e9"),
              HasSubstr("not '" + std::string(39, 'x') + "...'"));
}

}  // namespace
}  // namespace vlp
