// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/publish_run.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

RunRecord passed() {
  RunRecord record;
  record.run = "20261121T134501Z-0001";
  record.camera = "0001";
  record.station = "station-1";
  record.verdict = verdict_name(Verdict::pass);
  record.calibration =
      TemporaryFolder::read_content(fs::path(VLP_SOURCE_DIR) / "datasets/example/calibration.yaml");
  return record;
}

TEST(PublishRunFiles, WritesOnlyMissingFiles) {
  const TemporaryFolder folder;
  const RunRecord record = passed();
  const fs::path results = publish_run_files(record, {}, folder / "results");
  const std::string report = TemporaryFolder::read_content(results / "report.html");
  EXPECT_EQ(TemporaryFolder::read_content(results / "calibration.yaml"), record.calibration);
  // The missing file is written again, the other one stays.
  fs::remove(results / "calibration.yaml");
  folder.file((results / "report.html").string(), "with pictures");
  publish_run_files(record, {}, folder / "results");
  EXPECT_EQ(TemporaryFolder::read_content(results / "calibration.yaml"), record.calibration);
  EXPECT_EQ(TemporaryFolder::read_content(results / "report.html"), "with pictures");
  fs::remove(results / "report.html");
  publish_run_files(record, {}, folder / "results");
  EXPECT_EQ(TemporaryFolder::read_content(results / "report.html"), report);
}

TEST(PublishRunFiles, ReplacesDifferentReportOnRequest) {
  const TemporaryFolder folder;
  const RunRecord record = passed();
  const fs::path results = publish_run_files(record, {}, folder / "results");
  const std::string report = TemporaryFolder::read_content(results / "report.html");
  publish_run_files(record, {}, folder / "results", ExistingReport::replace);
  EXPECT_FALSE(fs::exists(results / "replaced-report.html")) << "it was the record's";
  folder.file((results / "report.html").string(), "planted");
  publish_run_files(record, {}, folder / "results", ExistingReport::replace);
  EXPECT_EQ(TemporaryFolder::read_content(results / "report.html"), report);
  EXPECT_EQ(TemporaryFolder::read_content(results / "replaced-report.html"), "planted");
  folder.file((results / "report.html").string(), "again");
  publish_run_files(record, {}, folder / "results", ExistingReport::replace);
  EXPECT_EQ(TemporaryFolder::read_content(results / "replaced-report.html"), "planted");
  EXPECT_TRUE(rename_voided_files(record, folder / "results"));
  EXPECT_FALSE(fs::exists(results / "replaced-report.html"));
}

TEST(PublishRunFiles, WritesNothingOutsideResultsFolder) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "elsewhere");
  RunRecord record = passed();
  record.camera = "..";
  EXPECT_THAT(rejection_message([&] { publish_run_files(record, {}, folder / "results"); }),
              HasSubstr("'..' is no id of a camera"));
  record.camera = "0001";
  record.run = "../../../x";
  EXPECT_THAT(rejection_message([&] { publish_run_files(record, {}, folder / "results"); }),
              HasSubstr("'../../../x' is no id of a run"));
  EXPECT_THAT(rejection_message([&] { rename_voided_files(passed(), folder / "results"); }), "");
  EXPECT_FALSE(fs::exists(folder / "results"));
  record = passed();
  fs::create_directory(folder / "results");
  fs::create_directory_symlink(folder / "elsewhere", folder / "results/0001");
  const auto expect_link = [&](const auto& action) {
    EXPECT_THAT(rejection_message(action),
                HasSubstr("0001: is a symbolic link, which is not followed"));
  };
  expect_link([&] { publish_run_files(record, {}, folder / "results"); });
  expect_link([&] { rename_voided_files(record, folder / "results"); });
  expect_link([&] { check_results_writable(folder / "results", "0001"); });
  EXPECT_TRUE(fs::is_empty(folder / "elsewhere"));
}

TEST(CheckResultsWritable, RemovesSymbolicLinkOfTestFileAndKeepsItsTarget) {
  const TemporaryFolder folder;
  const fs::path mine = folder.file("mine.txt", "mine");
  fs::create_directories(folder / "results/0001");
  fs::create_symlink(mine, folder / "results/0001/.writable");
  EXPECT_EQ(rejection_message([&] { check_results_writable(folder / "results", "0001"); }), "");
  EXPECT_EQ(TemporaryFolder::read_content(mine), "mine");
  EXPECT_FALSE(fs::is_symlink(folder / "results/0001/.writable"));
}

TEST(PublishRunFiles, ThrowsWhenExistingCalibrationDiffersFromRecord) {
  const TemporaryFolder folder;
  const RunRecord record = passed();
  const fs::path results = publish_run_files(record, {}, folder / "results");
  const auto expect_refused = [&] {
    EXPECT_THAT(rejection_message([&] { publish_run_files(record, {}, folder / "results"); }),
                HasSubstr("calibration.yaml: differs from the record: move it away"));
  };
  const fs::path file = folder.file((results / "calibration.yaml").string(), "another\n");
  expect_refused();
  const std::string long_content(3 * record.calibration.size(), 'x');
  folder.file(file.string(), long_content);
  expect_refused();
  EXPECT_EQ(TemporaryFolder::read_content(file), long_content);
  fs::remove(file);
  fs::create_symlink(folder / "mine.yaml", file);
  expect_refused();
  EXPECT_FALSE(fs::exists(folder / "mine.yaml"));
}

TEST(PublishRunFiles, PrefixesCalibrationFileNameWithFailedOrInvalid) {
  const TemporaryFolder folder;
  RunRecord record = passed();
  record.set_causes({{"the lens is decentered", true}});
  EXPECT_TRUE(fs::exists(publish_run_files(record, {}, folder / "a") / "failed-calibration.yaml"));
  record.set_causes({{"lamp 5 is loose", false}});
  EXPECT_TRUE(fs::exists(publish_run_files(record, {}, folder / "b") / "invalid-calibration.yaml"));
}

TEST(RenameVoidedFiles, PrefixesAllFileNamesWithVoided) {
  const TemporaryFolder folder;
  RunRecord record = passed();
  const fs::path results = publish_run_files(record, {}, folder / "results");
  folder.file((results / "certificate.html").string(), "certificate");
  rename_voided_files(record, folder / "results");
  std::vector<std::string> names;
  for (const auto& file : fs::directory_iterator(results)) {
    names.push_back(file.path().filename().string());
  }
  EXPECT_THAT(names,
              testing::UnorderedElementsAre("voided-calibration.yaml", "voided-certificate.html",
                                            "voided-report.html"));
  // As after a kill before the files are written.
  rename_voided_files(record, folder / "results");
  rename_voided_files(record, folder / "none");
  // A run that is published after it was voided.
  record.events.push_back(make_run_event_now(kVoided, "wrong serial", "Ann"));
  EXPECT_TRUE(fs::exists(publish_run_files(record, {}, folder / "a") / "voided-calibration.yaml"));
  EXPECT_FALSE(fs::exists(folder / "a" / record.camera / record.run / "report.html"));
}

TEST(CheckResultsWritable, ThrowsIfFolderCannotBeCreated) {
  const TemporaryFolder folder;
  EXPECT_EQ(rejection_message([&] { check_results_writable(folder / "results", "0001"); }), "");
  EXPECT_TRUE(fs::is_empty(folder / "results/0001"));
  EXPECT_THAT(rejection_message([&] { check_results_writable(folder.file("file", ""), "0001"); }),
              HasSubstr("file: cannot be made"));
}

}  // namespace
}  // namespace vlp
