// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Passes random names to each function that accepts an id or a file name. No file outside the
/// folder is touched, and nothing is forged on a terminal, in a report, a table or a record.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "captures/csv_reader.h"
#include "captures/id.h"
#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "rig/yaml_documents.h"
#include "station/records/publish_run.h"
#include "station/records/records.h"
#include "station/records/run_record.h"
#include "station/records/spool.h"
#include "support/program.h"
#include "support/random.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr int kNames = 100'000;
constexpr std::size_t kMaxBytes = 4096;

std::string utf8(std::size_t code) {
  const auto byte = [](std::size_t value) { return static_cast<char>(value); };
  if (code < 0x80) return {byte(code)};
  if (code < 0x800) return {byte(0xc0 | code >> 6), byte(0x80 | (code & 0x3f))};
  if (code < 0x10000) {
    return {byte(0xe0 | code >> 12), byte(0x80 | (code >> 6 & 0x3f)), byte(0x80 | (code & 0x3f))};
  }
  return {byte(0xf0 | code >> 18), byte(0x80 | (code >> 12 & 0x3f)),
          byte(0x80 | (code >> 6 & 0x3f)), byte(0x80 | (code & 0x3f))};
}

/// Returns a part of a name: a letter, a Unicode character, including surrogates, a byte, or a
/// separating or escaping character.
std::string random_part(Random& random) {
  static const std::array<std::string, 40> parts{"/",
                                                 "..",
                                                 "../",
                                                 ".",
                                                 "\\",
                                                 std::string(1, '\0'),
                                                 "\n",
                                                 "\r",
                                                 "\t",
                                                 "\x1b[",
                                                 "\x1b]0;",
                                                 "\x7f",
                                                 "\xc2\x9b",
                                                 "\u202e",
                                                 "\u2066",
                                                 "\u2028",
                                                 "\u200f",
                                                 "\u061c",
                                                 "\ufeff",
                                                 "\"",
                                                 "'",
                                                 ",",
                                                 ";",
                                                 "=",
                                                 "<script>",
                                                 "<h1>PASS</h1>",
                                                 "&lt;",
                                                 "-->",
                                                 "]]>",
                                                 "%s",
                                                 "{}",
                                                 "${HOME}",
                                                 "`id`",
                                                 "\nPASS",
                                                 "\n20261121T134501Z",
                                                 ": ",
                                                 "#",
                                                 "|",
                                                 "*",
                                                 " "};
  switch (random.index(8)) {
    case 0:
      return parts[random.index(parts.size())];
    case 1:
      return {static_cast<char>(random.index(256))};
    case 2:
      return utf8(random.index(0x110000));
    default:
      return {static_cast<char>('a' + random.index(26))};
  }
}

/// Returns a name of 0 to 4096 bytes; short ones are as frequent as long ones.
std::string random_name(Random& random) {
  const auto bytes = static_cast<std::size_t>(std::exp2(random.uniform(0, 12.001))) - 1;
  std::string name;
  while (name.size() < bytes) name += random_part(random);
  name.resize(std::min(name.size(), kMaxBytes));
  return name;
}

/// Returns true if a text is UTF-8 according to another implementation.
bool is_utf8(const std::string& text) {
  try {
    return !nlohmann::json(text).dump().empty();
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

/// Returns true if a terminal shows a text as one line, in the order of its characters.
bool is_harmless(const std::string& text) {
  static const std::array<std::string, 14> marks{"\u061c", "\u200e", "\u200f", "\u2028", "\u2029",
                                                 "\u202a", "\u202b", "\u202c", "\u202d", "\u202e",
                                                 "\u2066", "\u2067", "\u2068", "\u2069"};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 0x20 || byte == 0x7f) return false;
    if (byte == 0xc2 && static_cast<unsigned char>(text[i + 1]) < 0xa0) return false;
  }
  return is_utf8(text) && std::ranges::none_of(marks, [&](const std::string& mark) {
           return text.find(mark) != std::string::npos;
         });
}

/// Returns a run all of whose texts are such names.
RunRecord run_with(const std::string& name, int number) {
  RunRecord run;
  run.run = "20261121T134501Z-" + std::to_string(1'000'000 + number);
  run.kind = "unit";
  run.station = run.camera = run.operator_name = run.shift = name;
  run.begun_utc = run.ended_utc = "2026-11-21T13:45:01Z";
  run.verdict = "FAIL";
  run.causes = name.substr(0, name.find('\n')) + "\n";
  run.program = "vlp-station 0";
  run.libraries = "none";
  run.config_sha256 = std::string(64, 'a');
  run.images = {{"boards", name, std::string(64, 'b'), name}};
  run.events = {{"20261121T134501Z-" + std::to_string(number), kVoided, name, name}};
  return run;
}

class HostileNames : public testing::Test {
 protected:
  Random random{20261121};
  const TemporaryFolder folder;
};

TEST_F(HostileNames, EscapeForLineReturnsOneHarmlessLine) {
  int as_they_are = 0;
  for (int i = 0; i < kNames; ++i) {
    const std::string name = random_name(random);
    const std::string line = escape_for_line(name);
    ASSERT_TRUE(is_harmless(line)) << line;
    ASSERT_EQ(escape_for_line(line), line);
    if (line == name) ++as_they_are;
    const std::string message = InputError(name, name).what();
    ASSERT_EQ(message.find('\n'), std::string::npos);
    ASSERT_TRUE(is_harmless(escape_for_line(message)));
  }
  EXPECT_GT(as_they_are, kNames / 100) << "some are good";
}

TEST_F(HostileNames, IdAcceptsOnlySinglePathComponents) {
  int accepted = 0;
  const fs::path root = "/results";
  for (int i = 0; i < kNames; ++i) {
    const std::string name = random_name(random);
    if (!Id::is_valid(name)) {
      const std::string refusal = rejection_message([&] { Id(name, "spool/a.json", "camera"); });
      ASSERT_NE(refusal, "");
      ASSERT_LT(refusal.size(), 300U);
      ASSERT_TRUE(is_harmless(refusal));
      continue;
    }
    ++accepted;
    ASSERT_EQ((root / name).lexically_normal().parent_path(), root) << name;
    ASSERT_EQ((root / name).filename(), name);
    ASSERT_TRUE(is_harmless(name));
  }
  EXPECT_GT(accepted, kNames / 100);
}

TEST_F(HostileNames, SharedFolderOpensNoFileOutsideIt) {
  fs::create_directories(folder / "shared");
  const fs::path canary = folder.file("canary", "mine");
  const SharedFolder shared(folder / "shared");
  int made = 0;
  for (int i = 0; i < kNames; ++i) {
    const std::string name = random_name(random);
    try {
      const int file = shared.open_regular_file(name, O_CREAT | O_EXCL | O_WRONLY);
      if (file < 0) continue;  // too long
      ::close(file);
      ++made;
      ASSERT_TRUE(shared.contains(name));
      if (i % 1000 == 0) shared.replace_file(name, name);
      if (i % 10 == 0) shared.rename_file(name, "renamed");
      shared.remove_file(name);
      if (Id::is_valid(name)) shared.open_or_create({name, "test", "camera"});
    } catch (const InputError&) {
      continue;
    }
  }
  EXPECT_GT(made, kNames / 10);
  std::vector<std::string> outside;
  for (const auto& entry : fs::directory_iterator(folder / "")) {
    outside.push_back(entry.path().filename().string());
  }
  EXPECT_THAT(outside, testing::UnorderedElementsAre("shared", "canary"));
  EXPECT_EQ(TemporaryFolder::read_content(canary), "mine");
}

TEST_F(HostileNames, SharedFolderFollowsNoLinkOutOfIt) {
  fs::create_directories(folder / "shared");
  fs::create_directories(folder / "outside");
  const fs::path canary = folder.file("outside/canary", "mine");
  const SharedFolder shared(folder / "shared");
  constexpr int every = 100;  // each is synchronized to disk
  int files = 0, folders = 0;
  for (int i = 0; i < kNames / every; ++i) {
    const std::string name = random_name(random);
    const bool is_one_part = name != "." && name != ".." &&
                             name.find_first_of(std::string("/\0", 2)) == std::string::npos;
    const std::string link = (folder / "shared").string() + "/" + name;
    if (!is_one_part || ::symlink(canary.c_str(), link.c_str()) != 0) continue;
    ++files;
    ASSERT_NE(
        rejection_message([&] { ::close(shared.open_regular_file(name, O_WRONLY | O_TRUNC)); }), "")
        << name;
    ASSERT_NE(rejection_message([&] { (void)shared.read_if_exists(name, kMaxBytes); }), "") << name;
    shared.replace_file(name, name);
    ASSERT_FALSE(fs::is_symlink(link)) << name;
    shared.remove_file(name);
    if (!Id::is_valid(name)) continue;
    ++folders;
    ASSERT_EQ(::symlink((folder / "outside").c_str(), link.c_str()), 0);
    const Id id{name, "test", "camera"};
    ASSERT_NE(rejection_message([&] { (void)shared.open_or_create(id); }), "") << name;
    ASSERT_NE(rejection_message([&] { (void)shared.open_if_exists(id); }), "") << name;
    shared.remove_file(name);
    ASSERT_EQ(TemporaryFolder::read_content(canary), "mine") << name;
  }
  EXPECT_GT(files, kNames / every / 10);
  EXPECT_GT(folders, kNames / every / 100);
  EXPECT_EQ(TemporaryFolder::read_content(canary), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "outside"), {}), 1);
}

TEST_F(HostileNames, ParseRunDocumentReturnsEscapedNames) {
  constexpr int every = 20;  // parsing takes long without optimization
  for (int i = 0; i < kNames; ++i) {
    const std::string name = random_name(random), escaped = escape_for_line(name);
    const std::string document = serialize_run(run_with(name, i));
    if (i % every != 0) continue;
    const RunRecord run = parse_run_document(document);
    ASSERT_EQ(run.station, escaped);
    ASSERT_EQ(run.operator_name, escaped);
    ASSERT_EQ(run.images.at(0).name, escaped);
    ASSERT_EQ(serialize_run(run), document);
  }
}

TEST_F(HostileNames, UnitReportContainsNoHtmlTagsFromNames) {
  const auto extract_tags = [](const std::string& page) {
    std::string tags;
    bool is_tag = false;
    for (const char c : page) {
      if (c == '<') is_tag = true;
      if (is_tag) tags += c;
      if (c == '>') is_tag = false;
    }
    return tags;
  };
  const auto report = [](const std::string& name) {
    RunRecord run = run_with(name, 0);
    run.events.clear();
    return make_run_report(escape_run(std::move(run)), {}, {});
  };
  const std::string plain = extract_tags(report("a"));
  ASSERT_GT(plain.size(), 100U);
  constexpr int every = 10;
  for (int i = 0; i < kNames / every; ++i) {
    const std::string name = random_name(random) + "x";  // an empty fact has no row
    const std::string page = report(name);
    ASSERT_TRUE(is_utf8(page));
    ASSERT_EQ(extract_tags(page), plain) << escape_for_line(name);
  }
}

TEST_F(HostileNames, WriteRunsWritesExactlyOneRowPerRun) {
  constexpr int every = 10;
  std::vector<RunRecord> runs;
  runs.reserve(kNames / every);
  for (int i = 0; i < kNames / every; ++i) runs.push_back(run_with(random_name(random), i));
  write_runs(folder / "runs.json", runs);
  const auto json = nlohmann::json::parse(TemporaryFolder::read_content(folder / "runs.json"));
  ASSERT_EQ(json.size(), runs.size());
  for (RunRecord& run : runs) run = escape_run(std::move(run));  // as in records
  write_runs(folder / "runs.csv", runs);
  const CsvTable table(folder / "runs.csv");
  ASSERT_EQ(table.num_rows(), runs.size());
  const auto verdict = table.require_column("verdict"), name = table.require_column("run");
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    ASSERT_EQ(table.get_cell_text(row, verdict), "FAIL");
    ASSERT_EQ(table.get_cell_text(row, name), runs[row].run);
    ASSERT_EQ(json[row].at("verdict"), "FAIL");
  }
}

TEST_F(HostileNames, ReadCalibrationReturnsWrittenCameraId) {
  const fs::path example = fs::path(VLP_SOURCE_DIR) / "datasets/example/calibration.yaml";
  Calibration calibration = read_calibration(example);
  constexpr int every = 50;
  for (int i = 0; i < kNames / every; ++i) {
    const std::string name = "a" + escape_for_line(random_name(random));
    calibration.camera.id = name;
    const auto file = folder.file("calibration.yaml", format_calibration(calibration));
    const Calibration read = read_calibration(file);
    ASSERT_EQ(read.camera.id, name);
    ASSERT_EQ(read.camera.intrinsics, calibration.camera.intrinsics);
  }
}

TEST_F(HostileNames, RecordsListExactlyTheStoredRuns) {
  constexpr int every = 200;
  const std::string where = (folder / "records.db").string();
  {
    Records records(where);
    for (int i = 0; i < kNames / every; ++i) {
      records.store_run(run_with(random_name(random), i));
    }
    EXPECT_EQ(records.list_run_summaries({}).size(), std::size_t{kNames / every});
    EXPECT_THAT(records.check_trail("").problems, testing::IsEmpty());
  }
  const auto listed = run_program("vlp-station list --records " + where);
  ASSERT_EQ(listed.exit_code, 0) << listed.errors;
  std::istringstream lines(listed.output);
  std::string line;
  std::getline(lines, line);
  int runs = 0;
  for (; std::getline(lines, line) && !line.empty(); ++runs) {
    ASSERT_TRUE(line.starts_with("20261121T134501Z-1")) << line;
    ASSERT_TRUE(is_harmless(line)) << line;
  }
  EXPECT_EQ(runs, kNames / every);
}

}  // namespace
}  // namespace vlp
