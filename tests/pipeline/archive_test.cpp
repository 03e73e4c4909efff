// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-simulate --archive as its users call it.
#include <set>

#include "small_simulation.h"
#include "support/csv_cells.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Four sessions render in about 0.2 s: two captures of a board, four of lamps.
class VlpSimulateArchive : public SmallSimulation {
 protected:
  VlpSimulateArchive() {
    change_scene("captures:",
                 "archive: {sessions_per_camera: 2, focal_fraction: 0.01, principal_point_px: 1, "
                 "distortion_fraction: 0.05, tilt_deg: 1, lever_arm_m: 0.003, map_error_m: 0.001, "
                 "fault_fraction: 0.5, damage_fraction: 0.25}\ncaptures:");
    change_scene("folder: lamps", "folder: rotation");
    change_scene("count: 8", "count: 2");
    change_scene("heights_m: [0, 0.3], turn: {count: 2", "heights_m: [0], turn: {count: 1");
  }
  Files archive(int sessions, const std::string& options = "") {
    const auto result = simulate("--archive " + std::to_string(sessions) + " " + options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return files_below(output);
  }
};

TEST_F(VlpSimulateArchive, RendersOnlyMissingSessionsWhenExtendedOrInterrupted) {
  const Files four = archive(4), ten = archive(10);
  for (const auto& [name, content] : four) {
    if (name != "archive.csv") {
      EXPECT_TRUE(ten.at(name) == content) << name;
    }
  }
  EXPECT_TRUE(ten.at("archive.csv").starts_with(four.at("archive.csv")));
  EXPECT_GT(ten.size(), 2 * four.size());
  // As a run leaves it that is killed after it damaged session 6 and before that was in its place.
  for (const char* session : {"camera-00003/session-02", "camera-00001/session-01"}) {
    std::string name = session;
    name[name.find('/')] = '-';
    fs::create_directories(output / ".unfinished");
    fs::rename(output / session, output / ".unfinished" / name);
  }
  fs::remove(output / ".unfinished/camera-00001-session-01/boards/0001.png");
  EXPECT_EQ(simulate("--archive 10 --threads 3").output,
            "rendered 2 sessions, 8 existed; in " + output.string() + "\n");
  EXPECT_TRUE(files_below(output) == ten);
}

TEST_F(VlpSimulateArchive, DamagesSessionsAsListedInTable) {
  const Files files = archive(32);
  const CsvTable table(output / "archive.csv");
  ASSERT_EQ(table.num_rows(), 32U);
  std::set<std::string> kinds;
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    const auto cell = [&](const char* column) { return read_text(table, row, column); };
    const fs::path session = output / cell("camera") / cell("session");
    const fs::path target = session / cell("damaged");
    const std::string damage = cell("damage"), cut = session / "rotation/0000.png";
    SCOPED_TRACE(session.string() + " " + damage);
    kinds.insert(damage);
    EXPECT_EQ(fs::exists(target), damage != "missing");
    if (damage == "empty") {
      EXPECT_TRUE(fs::is_empty(target));
    }
    if (damage == "cut-images") {
      EXPECT_EQ(fs::file_size(target / "0000.png"), 600U);
    }
    if (damage == "wrong-board") {
      EXPECT_THAT(TemporaryFolder::read_content(target), HasSubstr("tag25h9"));
    }
    if (damage.empty()) {
      EXPECT_EQ(fs::file_size(cut) == 600, cell("fault") == "cut-image");
    }
  }
  EXPECT_EQ(kinds.size(), 5U) << "four kinds and none";
}

}  // namespace
}  // namespace vlp
