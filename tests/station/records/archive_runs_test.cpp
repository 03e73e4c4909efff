// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/archive_runs.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "station/records/records.h"
#include "station/statistics/run_metrics.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

/// Results of an archive as written by reprocessing.
class ArchiveRuns : public testing::Test {
 protected:
  ArchiveRuns() {
    row("a,s1,review,2026-03-15,,1.2.3,key");
    row("a,s2,review,2026-03-14T09:30:00,,1.2.3,key");
    row("b,s1,gate,2026-03-16,\"rms_px is 2 px, at most 1 px is required\",1.2.3,key");
    row("b,s2,no result,2026-03-17,rotation: is missing,1.2.3,key");
    row("b,s3,pass,,,1.2.3,key");
    row("b,s4,crashed,2026-03-18,vlp-calibrate ended with exit code -9,1.2.3,key");
    session("sessions/a/s1", 0.1);
    session("sessions/a/s2", 0.3);
    session("sessions/b/s1", 2);
    session("failed/b/s2", {});
    write("archive/sessions/a/s1/calibration.yaml", "format: vlp-calibration/1\n");
  }
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((folder / file).parent_path());
    std::ofstream(folder / file) << text;
  }
  void row(const std::string& line) {
    summary += line + "\n";
    write("archive/summary.csv", summary);
  }
  void session(const std::string& name, std::optional<double> rms_px) {
    std::string metrics;
    if (rms_px) {
      metrics =
          R"({"name": "rms_px", "unit": "px", "limit": 1.0, "direction": "at most", "value": )" +
          std::to_string(*rms_px) + R"(}, {"name": "mean_mm", "unit": "mm", "value": 0.5},)" +
          R"({"name": "residual_ratio", "value": 1.25}, {"name": "repeatability_mm", "value": 0.1})";
    }
    write("archive/" + name + "/session.json",
          R"({"metrics": [)" + metrics +
              R"(], "gates": [{"name": "coverage", "limit": 0.4, "direction": "at least",)"
              R"( "value": null, "passed": false}]})" +
              "\n");
  }

  std::vector<RunRecord> runs() const {
    std::vector<RunRecord> all;
    for (const auto& session : read_reprocessed(folder / "archive").sessions) {
      all.push_back(load_archive_run(session));
    }
    return all;
  }

  TemporaryFolder folder;
  std::string summary = "camera,session,verdict,date,reason,version,key\n";
};

TEST_F(ArchiveRuns, ReturnsDatedSessionsAsRunsInChronologicalOrder) {
  const auto archive = read_reprocessed(folder / "archive");
  EXPECT_EQ(archive.undated, 1U);
  EXPECT_EQ(archive.crashed, 1U);
  const auto runs = this->runs();
  ASSERT_THAT(runs, SizeIs(4));
  EXPECT_EQ(runs[0].ended_utc, "2026-03-14T09:30:00Z");
  EXPECT_EQ(start_utc_of_run_id(runs[0].run), runs[0].ended_utc);
  EXPECT_EQ(runs[1].ended_utc, "2026-03-15T00:00:00Z");
  EXPECT_THAT((std::vector{runs[0].verdict, runs[1].verdict, runs[2].verdict, runs[3].verdict}),
              ElementsAre("PASS", "PASS", "FAIL", "INVALID"));
  EXPECT_EQ(runs[0].station, "archive");
  EXPECT_EQ(read_reprocessed(folder / "archive/").sessions[0].run.station, "archive");
  EXPECT_EQ(runs[0].config_sha256, "key");
  EXPECT_EQ(runs[1].calibration, "format: vlp-calibration/1\n");
  EXPECT_EQ(runs[2].first_cause(), "rms_px is 2 px, at most 1 px is required");
  EXPECT_EQ(runs[3].program, "vlp-calibrate 1.2.3");
  ASSERT_THAT(runs[2].metrics, SizeIs(5));
  EXPECT_EQ(runs[2].metrics[0].value, 2);
  EXPECT_FALSE(runs[2].metrics[0].has_passed_gate());
  EXPECT_EQ(runs[2].metrics[0].direction, Direction::at_most);
  EXPECT_EQ(runs[2].metrics[2].name, "residual_ratio");
  EXPECT_FALSE(runs[2].metrics[2].limit);
  EXPECT_EQ(runs[2].metrics[3].name, "repeatability_mm");  // the present name of scatter_mm
  EXPECT_EQ(runs[2].metrics[4].direction, Direction::at_least);
  EXPECT_FALSE(runs[2].metrics[4].value);
}

TEST_F(ArchiveRuns, StoreRunKeepsOneCopyOfRunsReadTwice) {
  Records records((folder / "records.db").string());
  for (int time = 0; time < 2; ++time) {
    for (const RunRecord& run : runs()) records.store_run(run);
  }
  EXPECT_THAT(records.list_run_summaries({}), SizeIs(4));
  EXPECT_THAT(extract_trend_values(load_metric_values(records, "rms_px", {})),
              ElementsAre(0.3, 0.1, 2));
  EXPECT_THAT(extract_trend_values(load_metric_values(records, "mean_mm", {})),
              ElementsAre(0.5, 0.5, 0.5));
  EXPECT_EQ(find_gate_limit("rms_px", nullptr, records, load_metric_values(records, "rms_px", {})),
            1);
  EXPECT_STREQ(require_run_metric_kind("mean_mm").unit, "mm");
  EXPECT_TRUE(records.check_trail("").problems.empty());
}

TEST_F(ArchiveRuns, ThrowsForInvalidFilesOfArchive) {
  EXPECT_THAT(rejection_message([&] { read_reprocessed(folder / "none"); }),
              HasSubstr("summary.csv: "));
  const std::string in_session = "archive/sessions/a/s1/";
  write(in_session + "session.json", "{\"metrics\": 1}\n");
  EXPECT_THAT(rejection_message([&] { runs(); }), HasSubstr("a/s1/session.json: "));
  write(in_session + "session.json", std::string(1'000'000, '['));
  EXPECT_THAT(rejection_message([&] { runs(); }), HasSubstr("a/s1/session.json: "));
  std::filesystem::remove(folder / (in_session + "session.json"));
  EXPECT_THAT(rejection_message([&] { runs(); }), HasSubstr("a/s1/session.json: "));
  session("sessions/a/s1", 0.1);
  std::filesystem::remove(folder / (in_session + "calibration.yaml"));
  write("secret.yaml", "password: 1\n");
  std::filesystem::create_symlink(folder / "secret.yaml",
                                  folder / (in_session + "calibration.yaml"));
  EXPECT_THAT(rejection_message([&] { runs(); }), HasSubstr("calibration.yaml: "));
}

TEST_F(ArchiveRuns, SkipsAndListsRowsWithInvalidCameraIds) {
  const std::size_t before = read_reprocessed(folder / "archive").sessions.size();
  row("..,s1,pass,2026-03-19,,1.2.3,key");
  const ReprocessedArchive archive = read_reprocessed(folder / "archive");
  EXPECT_EQ(archive.sessions.size(), before);
  ASSERT_EQ(archive.rejected_sessions.size(), 1U);
  EXPECT_THAT(archive.rejected_sessions.front(),
              HasSubstr("summary.csv:8: '..' is no id of a camera"));
}

}  // namespace
}  // namespace vlp
