// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A station that is killed at any moment, or has no room, loses nothing.
#include <sys/mount.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "captures/digest.h"
#include "small_station.h"
#include "support/postgres_server.h"
#include "support/random.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A number from the environment, for trials that take longer than a test may.
int read_environment_number(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atoi(text);
}

class VlpStationKilled : public SmallStation {
 protected:
  /// Puts `count` more images of the unit where they arrive, in the order of the steps; other
  /// images once a run has ended.
  void arrive(std::size_t count) const {
    if (!fs::exists(captures("b"))) {
      take_again();
      prepare("b");
    }
    for (const char* step : {"boards", "rotation", "dispersion", "check"}) {
      for (const auto& image : images(step)) {
        const auto there = captures("b") / step / image.filename();
        if (count == 0 || fs::exists(there)) continue;
        drop(image, there.parent_path());
        --count;
      }
    }
  }
  /// Returns the records of the runs of the camera, with calibration and images.
  nlohmann::json kept() const {
    const auto file = folder / "kept.json";
    const auto exported = records("export --camera-id b -o " + file.string());
    EXPECT_EQ(exported.exit_code, 0) << exported.errors;
    return nlohmann::json::parse(TemporaryFolder::read_content(file));
  }
  void kill_repeatedly(int kills) const;
  void expect_all_there() const;
};

void VlpStationKilled::kill_repeatedly(int kills) const {
  Random random(static_cast<unsigned>(read_environment_number("VLP_STATION_SEED", 1)));
  for (int i = 0; i < kills; ++i) {
    arrive(static_cast<std::size_t>(random.uniform(0, 60)));
    const double wait_s = random.uniform(0, 2.5);
    run_program("(exec " + run("b", "-q --idle-s 60") + ") & sleep " + std::to_string(wait_s) +
                "; kill -9 $! 2>&-; wait");
  }
  arrive(1000);
  const auto last = run_program(run("b", "-q --idle-s 60"));
  EXPECT_EQ(last.exit_code, 0) << last.errors;
}

/// Every unit that came to its end has its record, its files, and all of its images, as they were.
void VlpStationKilled::expect_all_there() const {
  const auto runs = kept();
  std::size_t put_away = 0;
  for (const auto& entry : fs::directory_iterator(folder / "station/captures")) {
    if (entry.path().filename().string().starts_with("b.")) ++put_away;
  }
  EXPECT_EQ(put_away, runs.size());
  EXPECT_GE(runs.size(), 1u);
  for (const auto& run : runs) {
    const std::string name = run["run"], calibration = run["calibration"];
    EXPECT_EQ(run["verdict"], "PASS") << run["causes"];
    EXPECT_EQ(run["images"].size(), 48u);
    for (const auto& image : run["images"]) {
      const auto file = folder / "station/captures" / ("b." + name) / std::string(image["step"]) /
                        std::string(image["image"]);
      EXPECT_EQ(hash_file(file), image["sha256"].get<std::string>()) << file;
    }
    const auto results = folder / "station/results/b" / name;
    EXPECT_EQ(TemporaryFolder::read_content(results / "calibration.yaml"), calibration);
    EXPECT_THAT(TemporaryFolder::read_content(results / "report.html"), HasSubstr("</html>"));
  }
  // Nothing else is there: no calibration without a record.
  std::size_t results = 0;
  for (const auto& entry : fs::directory_iterator(folder / "station/results/b")) {
    if (entry.is_directory()) ++results;
  }
  EXPECT_EQ(results, runs.size());
}

// As often as VLP_STATION_KILLS says.
TEST_F(VlpStationKilled, ResumesUnitAfterKillsWithSqlite) {
  render();
  kill_repeatedly(read_environment_number("VLP_STATION_KILLS", 4));
  expect_all_there();
}

TEST_F(VlpStationKilled, ResumesUnitAfterKillsWithPostgres) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  change("station.yaml", "records: records.db", "records: \"" + server.uri() + "\"");
  render();
  kill_repeatedly(read_environment_number("VLP_STATION_KILLS", 3));
  expect_all_there();
}

/// Killed between record and end: the same command says what the verdict was, and nothing is done
/// twice.
TEST_F(VlpStationKilled, RepeatsRecordedVerdictWhenKilledBeforeEnd) {
  prepare("b");
  const auto ended = run_program(run("b", "-q --idle-s 0.2"));
  EXPECT_EQ(ended.exit_code, 3);
  fs::path away;
  for (const auto& entry : fs::directory_iterator(folder / "station/captures")) {
    away = entry.path();
  }
  fs::rename(away, captures("b"));  // as it was before the end
  fs::remove_all(folder / "station/results");
  const auto again = run_program(run("b", "--idle-s 60"));
  EXPECT_EQ(again.exit_code, 3);
  EXPECT_THAT(again.output, HasSubstr("INVALID   camera b"));
  EXPECT_NE(result("b", "report.html"), "");
  EXPECT_TRUE(fs::exists(away));
  EXPECT_FALSE(fs::exists(captures("b")));
  EXPECT_EQ(kept().size(), 1u);
}

/// The same while the records, which have the run, are away: it is not judged again.
TEST_F(VlpStationKilled, DoesNotJudgeAgainWhileRecordsAreUnavailable) {
  change("station.yaml", "records: records.db", "records: share/records.db");
  const auto share = folder / "station/share", unmounted = folder / "station/unmounted";
  fs::create_directory(share);
  prepare("b");
  EXPECT_EQ(run_program(run("b", "-q --idle-s 0.2")).exit_code, 3);
  for (const auto& entry : fs::directory_iterator(folder / "station/captures")) {
    fs::rename(entry.path(), captures("b"));  // as it was before the end
    break;
  }
  fs::rename(share, unmounted);
  const auto away = run_program(run("b", "--idle-s 0.2"));
  EXPECT_EQ(away.exit_code, 2);
  EXPECT_THAT(away.errors, testing::AllOf(HasSubstr("is stored, but its record cannot be read"),
                                          HasSubstr("share/records.db")));
  EXPECT_TRUE(fs::exists(captures("b")));
  fs::rename(unmounted, share);
  EXPECT_EQ(run_program(run("b", "--idle-s 60")).exit_code, 3);
  EXPECT_FALSE(fs::exists(captures("b")));
  EXPECT_EQ(kept().size(), 1u);
}

/// A hook that was not run to its end is known as such, though its run ended.
TEST_F(VlpStationKilled, ListsHookAsUnfinishedWhenKilledDuringHook) {
  change("station.yaml", "records: records.db",
         "records: records.db\nhook: {command: [sh, hook.sh]}");
  folder.file("station/hook.sh", "echo $$ >pid.new; mv pid.new pid; exec sleep 100\n");
  const std::string pid = (folder / "station/pid").string();
  run_program("(exec " + run("b", "-q --idle-s 0.2") + ") & until [ -s " + pid +
              " ]; do sleep 0.05; done; kill -9 $! $(cat " + pid + "); wait");
  EXPECT_EQ(kept().size(), 1u);
  EXPECT_THAT(records("list").output,
              HasSubstr("1 of them with a hook that failed or did not finish"));
  EXPECT_THAT(records("show").output,
              testing::AllOf(HasSubstr("hook wanted"), testing::Not(HasSubstr("hook failed"))));
  folder.file("station/hook.sh", "echo label 7\n");
  const auto again = records("hook");
  EXPECT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_THAT(again.output, HasSubstr(" b INVALID: done"));
  EXPECT_THAT(records("list").output, testing::Not(HasSubstr("hook")));
}

TEST_F(VlpStationKilled, LeavesNoResultsWithoutRecordWhenDiskIsFull) {
  change("scene.yaml", "count: 16", "count: 8");
  change("station.yaml", "board_views: 16", "board_views: 8");
  render("boards");  // the unit fails, and has a record as long
  const auto small = folder / "station/results";
  fs::create_directory(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=10m") != 0) {
    GTEST_SKIP() << "no small file system can be mounted here";
  }
  change("station.yaml", "records: records.db", "records: results/records.db");
  const std::string fill = (small / "full").string();
  run_program("head -c 12000000 /dev/zero >" + fill + " || true");
  const auto before = run_program(batch("a"));
  EXPECT_EQ(before.exit_code, 2);
  EXPECT_THAT(before.errors, HasSubstr("results"));
  fs::resize_file(fill, 0);
  ASSERT_EQ(run_program(batch("b")).exit_code, 3);
  // Full while the unit is worked on, so that a record fits in part.
  for (const int free_bytes : {4096, 12288}) {
    fs::resize_file(fill, 0);
    const std::string camera = "c" + std::to_string(free_bytes);
    for (const auto& image : images("boards")) {
      fs::create_directories(captures(camera) / "boards");
      drop(image, captures(camera) / "boards");
    }
    const auto full =
        run_program("(until [ -d " + small.string() + "/" + camera +
                    " ]; do sleep 0.05; done; sleep 0.5; head -c 12000000 /dev/zero >" + fill +
                    "; truncate -s -" + std::to_string(free_bytes) + " " + fill + ") & " +
                    run(camera, "--idle-s 3") + "; code=$?; wait; exit $code");
    EXPECT_THAT(full.exit_code, testing::AnyOf(2, 3)) << full.errors;
    EXPECT_THAT(full.output, HasSubstr("INVALID   camera " + camera));
    if (full.exit_code == 2) {
      EXPECT_THAT(full.errors, HasSubstr("results"));
    }
  }
  fs::remove(fill);
  EXPECT_THAT(records("list --camera-id b").output, HasSubstr("1 runs, 0 passed"));
  for (const char* camera : {"a", "b", "c4096", "c12288"}) {
    if (!fs::exists(small / camera)) continue;
    for (const auto& run : fs::directory_iterator(small / camera)) {
      EXPECT_EQ(records("show " + run.path().filename().string()).exit_code, 0)
          << "results without a record";
    }
  }
  for (const auto& entry : fs::recursive_directory_iterator(small)) {
    if (entry.path().filename() != "invalid-calibration.yaml") continue;
    EXPECT_THAT(TemporaryFolder::read_content(entry.path()), HasSubstr("intrinsics: ["));
  }
  ::umount(small.c_str());
}

}  // namespace
}  // namespace vlp
