// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/retention.h"

#include <gmock/gmock.h>

#include <ctime>

#include "rig/input_error.h"
#include "station/records/spool.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::string utc_days_ago(int days) {
  const std::time_t time = std::time(nullptr) - days * std::time_t{86'400};
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&time))};
}

const std::string kOld = "20200101T000000Z-0123456789abcdef";

class RetentionTest : public testing::Test {
 protected:
  RetentionTest() {
    config.captures = folder / "captures";
    config.results = folder / "results";
    config.retention = {90, 730};
    config.station = "hall";
  }
  void keep(const std::string& run, const std::string& camera, const std::string& ended_utc,
            const std::string& station = "hall") {
    RunRecord record;
    record.run = run;
    record.station = station;
    record.camera = camera;
    record.verdict = "PASS";
    record.ended_utc = ended_utc;
    records.store_run(record);
  }
  fs::path with_file(const std::string& name) const {
    fs::create_directories(folder / name / "check");
    folder.file(name + "/check/0.png", std::string(1000, 'x'));
    return folder / name;
  }
  TemporaryFolder folder;
  Records records{(folder / "records.db").string()};
  StationConfig config{};
};

TEST_F(RetentionTest, ListExpiredFoldersReturnsFoldersOlderThanRetention) {
  keep(kOld, "a.b", "2020-01-01T01:00:00Z");
  const std::string now = make_run_id(), resumed = "20200101T000000Z-fedcba9876543210";
  keep(now, "a.b", get_current_utc());
  keep(resumed, "c", get_current_utc());  // begun long ago, ended now
  const fs::path images = with_file("captures/a.b." + kOld),
                 results = with_file("results/a.b/" + kOld);
  for (const std::string& left :
       {"captures/a.b." + now, "captures/c." + resumed, "results/a.b/" + now,
        std::string("captures/a.b"), std::string("captures/notes"),
        std::string("results/a.b/notes"), "captures/a.b" + kOld, "captures/" + kOld}) {
    with_file(left);
  }
  const fs::path without_record =
      with_file("captures/d." + kOld);  // the record is of another camera
  const RetentionResult found = list_expired_folders(config, records);
  ASSERT_THAT(found.expired, SizeIs(2));
  EXPECT_EQ(found.expired[0].folder, images);
  EXPECT_STREQ(found.expired[0].event_kind, kImagesDeleted);
  EXPECT_EQ(found.expired[0].bytes, 1000U);
  EXPECT_EQ(found.expired[1].folder, results);
  EXPECT_STREQ(found.expired[1].event_kind, kResultsDeleted);
  EXPECT_THAT(found.folders_without_record, ElementsAre(without_record));
  config.retention = {std::nullopt, 30'000};
  EXPECT_THAT(list_expired_folders(config, records).expired, IsEmpty());
}

/// Stations can share folders and records.
TEST_F(RetentionTest, ListExpiredFoldersIgnoresOtherStationsAndSymbolicLinks) {
  const std::string other = "20200101T000000Z-fedcba9876543210";
  keep(kOld, "a", "2020-01-01T01:00:00Z");
  keep(other, "a", "2020-01-01T01:00:00Z", "attic");
  with_file("captures/a." + other);
  with_file("results/a/" + other);
  fs::create_directory_symlink(with_file("elsewhere"), folder / "captures" / ("a." + kOld));
  fs::create_directory_symlink(folder / "nowhere", folder / "results" / "a" / kOld);
  const RetentionResult found = list_expired_folders(config, records);
  EXPECT_THAT(found.expired, IsEmpty());
  EXPECT_THAT(found.folders_without_record, IsEmpty());
}

TEST_F(RetentionTest, DeleteExpiredKeepsTargetsOfSymbolicLinks) {
  keep(kOld, "a", "2020-01-01T01:00:00Z");
  const fs::path images = with_file("captures/a." + kOld), elsewhere = with_file("elsewhere");
  fs::create_directory_symlink(elsewhere, images / "link");
  const RetentionResult found = list_expired_folders(config, records);
  ASSERT_THAT(found.expired, SizeIs(1));
  EXPECT_EQ(found.expired[0].bytes, 1000U);
  Spool spool(folder / "spool", (folder / "records.db").string());
  delete_expired(found.expired[0], config, spool);
  EXPECT_FALSE(fs::exists(images));
  EXPECT_TRUE(fs::exists(elsewhere / "check/0.png"));
  spool.deliver_waiting();
  const auto record = records.find_run_by_id(kOld);
  ASSERT_TRUE(record);
  ASSERT_THAT(record->events, SizeIs(1));
  EXPECT_EQ(record->events[0].kind, kImagesDeleted);
  EXPECT_EQ(record->events[0].text, "kept 90 days, 0.0 MB");
  EXPECT_THROW(delete_expired(found.expired[0], config, spool), InputError) << "it is not there";
}

/// The golden unit's calibration can be among the results of the run that measured it.
TEST_F(RetentionTest, ListExpiredFoldersExcludesFoldersUsedByStation) {
  keep(kOld, "a", "2020-01-01T01:00:00Z");
  const fs::path results = with_file("results/a/" + kOld), images = with_file("captures/a." + kOld);
  config.inputs = {folder.file("station.yaml", ""),
                   folder.file("results/a/" + kOld + "/calibration.yaml", "")};
  const RetentionResult found = list_expired_folders(config, records);
  EXPECT_THAT(found.folders_in_use, ElementsAre(results));
  ASSERT_THAT(found.expired, SizeIs(1));
  EXPECT_EQ(found.expired[0].folder, images);
  // Through a link, and by another name.
  fs::create_symlink(config.inputs[1], folder / "golden.yaml");
  config.inputs[1] = folder / "golden.yaml";
  EXPECT_THAT(list_expired_folders(config, records).folders_in_use, ElementsAre(results));
  config.inputs = {};
  config.spool = images / "spool";
  EXPECT_THAT(list_expired_folders(config, records).folders_in_use, ElementsAre(images));
}

TEST_F(RetentionTest, ListExpiredFoldersExcludesFoldersUsedBySymbolicLink) {
  keep(kOld, "a", "2020-01-01T01:00:00Z");
  const fs::path results = with_file("results/a/" + kOld);
  const auto expect_in_use = [&](const std::string& why) {
    EXPECT_THAT(list_expired_folders(config, records).folders_in_use, ElementsAre(results)) << why;
  };
  fs::create_symlink(folder.file("elsewhere.yaml", ""), results / "golden.yaml");
  config.inputs = {results / "golden.yaml"};
  expect_in_use("the link is in it");
  fs::create_symlink(results / "golden.yaml", folder / "golden.yaml");
  config.inputs = {folder / "golden.yaml"};
  expect_in_use("a link to the link in it");
  fs::create_symlink("loop", folder / "loop");
  config.inputs = {folder / "loop"};
  expect_in_use("cannot be followed");
  config.inputs = {folder / "elsewhere.yaml", folder / "none"};
  ASSERT_THAT(list_expired_folders(config, records).folders_in_use, IsEmpty());
  const std::string script = "results/a/" + kOld + "/hook.py";
  config.hook = Hook{{"python3", script, std::string(5000, 'x')}, folder / ""};
  folder.file(script, "");
  expect_in_use("a script of the hook");
}

TEST_F(RetentionTest, DeleteExpiredThrowsWhenCameraFolderBecameSymbolicLink) {
  keep(kOld, "a", "2020-01-01T01:00:00Z");
  with_file("results/a/" + kOld);
  const fs::path kept = with_file("elsewhere/" + kOld);
  const RetentionResult found = list_expired_folders(config, records);
  ASSERT_THAT(found.expired, SizeIs(1));
  fs::remove_all(folder / "results/a");
  fs::create_directory_symlink(folder / "elsewhere", folder / "results/a");
  Spool spool(folder / "spool", (folder / "records.db").string());
  EXPECT_THAT(rejection_message([&] { delete_expired(found.expired[0], config, spool); }),
              HasSubstr("results/a: is a symbolic link"));
  EXPECT_TRUE(fs::exists(kept / "check/0.png"));
}

TEST_F(RetentionTest, CheckClockThrowsForYearLongGapUntilRunsSpanWeek) {
  const auto refusal = [&] { return rejection_message([&] { check_clock(config, records); }); };
  EXPECT_EQ(refusal(), "") << "no run";
  keep(kOld, "a", "2020-01-01T01:00:00Z");
  keep(make_run_id(), "a", get_current_utc(), "another");
  EXPECT_THAT(refusal(),
              HasSubstr("the newest run ended 2020-01-01T01:00:00Z, more than a year before"));
  // The first run by such a clock does not make it right.
  const std::string today = get_current_utc();
  keep(make_run_id(), "a", today);
  EXPECT_THAT(refusal(), HasSubstr("the runs since " + today + " ended more than a year after"));
  const std::string six_days_ago = utc_days_ago(6);
  keep(make_run_id(), "a", six_days_ago);
  EXPECT_THAT(refusal(), HasSubstr("the runs since " + six_days_ago));
  keep(make_run_id(), "a", utc_days_ago(8));
  EXPECT_EQ(refusal(), "");
}

TEST_F(RetentionTest, CheckClockThrowsWhenRunEndedInFutureUnlessVoided) {
  keep(make_run_id(), "a", utc_days_ago(0));
  EXPECT_EQ(rejection_message([&] { check_clock(config, records); }), "");
  const std::string run = make_run_id(), coming = utc_days_ago(-20 * 366);
  keep(run, "a", coming);
  EXPECT_THAT(rejection_message([&] { check_clock(config, records); }),
              HasSubstr("the newest run ended " + coming + ", after the clock"));
  RunRecord voided_run = *records.find_run_by_id(run);
  voided_run.events.push_back(make_run_event_now(kVoided, "wrong clock", "Ann"));
  records.store_run(voided_run);
  EXPECT_EQ(rejection_message([&] { check_clock(config, records); }), "");
}

}  // namespace
}  // namespace vlp
