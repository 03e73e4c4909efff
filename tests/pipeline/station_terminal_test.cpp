// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station at a real terminal (tmux), images dropped one by one; the screens are kept in
/// station_screens/ as text.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <regex>
#include <thread>
#include <utility>

#include "small_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// A terminal of 80 x 40, or another size, that a program runs in.
class Tmux {
 public:
  explicit Tmux(const std::string& command, const char* size = "-x 80 -y 40") {
    // A socket's path has 107 characters at most: not in the test's folder.
    EXPECT_NE(::mkdtemp(folder_.data()), nullptr);
    const auto begun =
        run_program(tmux() + "new-session -d " + size + " \"" + command + "; sleep 100\"");
    EXPECT_EQ(begun.exit_code, 0) << begun.errors;
  }
  ~Tmux() {
    run_program(tmux() + "kill-server");
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Tmux(const Tmux&) = delete;
  Tmux& operator=(const Tmux&) = delete;

  void resize(const char* size) const { run_program(tmux() + "resize-window " + size); }
  void type(const std::string& keys) const { run_program(tmux() + "send-keys " + keys); }

  /// Returns the screen without empty lines at the end; `escapes`: with colors.
  std::string screen(const char* escapes = "") const {
    std::string text = run_program(tmux() + "capture-pane -p " + escapes).output;
    while (text.ends_with("\n\n")) text.pop_back();
    return text;
  }
  /// Returns the screen when it contains a text and has not changed for 50 ms, so that it is drawn
  /// completely; the present screen after half a minute.
  std::string screen_with(const std::string& text) const {
    std::string before, shown;
    for (int i = 0; i < 600; ++i) {
      before = std::exchange(shown, screen());
      if (shown == before && shown.find(text) != std::string::npos) return shown;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return shown;
  }

 private:
  std::string tmux() const { return "tmux -f /dev/null -S '" + folder_ + "/socket' "; }
  std::string folder_ = (fs::temp_directory_path() / "vlp-tmux-XXXXXX").string();
};

/// The screen as it is kept. A new one is written where VLP_WRITE_SCREENS is set.
void expect_screen(const std::string& shown, const std::string& name) {
  const fs::path kept = fs::path(VLP_SOURCE_DIR) / "tests/pipeline/station_screens" / name;
  if (std::getenv("VLP_WRITE_SCREENS") != nullptr) std::ofstream(kept) << shown;
  EXPECT_EQ(shown, TemporaryFolder::read_content(kept)) << name;
}

/// Measured figures differ in the last digits from one system to another.
std::string without_figures(const std::string& screen) {
  return std::regex_replace(screen, std::regex(" +[0-9.e-]+ +([<>]=)"), "  N $1");
}

class VlpStationTerminal : public SmallStation {
 protected:
  void drop(const std::string& step, std::size_t first, std::size_t end) const {
    const auto all = images(step);
    for (std::size_t i = first; i < std::min(end, all.size()); ++i) {
      SmallStation::drop(all[i], captures("0001") / step);
      // One by one: each has come before the next.
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
};

TEST_F(VlpStationTerminal, ShowsProgressAndVerdictOfUnit) {
  if (run_program("tmux -V").exit_code != 0) GTEST_SKIP() << "tmux is not installed";
  change("station.yaml", "same_pose_fraction: 0.01", "same_pose_fraction: 0.02");
  render();
  for (const char* step : {"dispersion", "check"}) {
    fs::create_directories(captures("0001") / step);
    fs::copy_file(folder / "unit" / step / "captures.csv",
                  captures("0001") / step / "captures.csv");
  }
  const Tmux tmux("PATH='" VLP_PROGRAMS_DIR "':$PATH NO_COLOR=1 " + run("0001", "--threads 1") +
                  " 2>" + (folder / "log").string());
  expect_screen(tmux.screen_with("Ctrl-C"), "begin.txt");
  drop("boards", 0, 1);
  tmux.screen_with("0000.png: taken");
  fs::copy_file(images("boards")[0], captures("0001") / "boards/again.png");
  expect_screen(tmux.screen_with("again.png: refused"), "same-pose.txt");
  drop("boards", 1, 12);
  expect_screen(tmux.screen_with("boards 12/16"), "boards.txt");
  drop("boards", 12, 16);
  tmux.screen_with("[x] boards");
  drop("rotation", 0, 8);
  expect_screen(tmux.screen_with("rotation 8/12"), "rotation.txt");
  // A step done again replaces that step: an image is taken away, the step is open again.
  fs::remove(captures("0001") / "boards/0003.png");
  expect_screen(tmux.screen_with("boards 15/16"), "redone.txt");
  drop("boards", 3, 4);
  tmux.screen_with("[x] boards");
  drop("rotation", 8, 12);
  tmux.screen_with("[x] rotation");
  drop("dispersion", 0, 12);
  expect_screen(tmux.screen_with("[x] dispersion"), "check.txt");
  drop("check", 0, 7);
  tmux.screen_with("check 7/8");
  const auto begin = std::chrono::steady_clock::now();
  drop("check", 7, 8);
  const std::string verdict = tmux.screen_with("PASS   camera");
  const std::chrono::duration<double> wait = std::chrono::steady_clock::now() - begin;
  // One second is wanted; the rest is for a machine that does other things, too.
  EXPECT_LT(wait.count(), 5);
  expect_screen(without_figures(verdict), "verdict.txt");
  EXPECT_THAT(TemporaryFolder::read_content(folder / "log"), Not(HasSubstr("error")));
}

/// A shift: who measures, then unit after unit by a scanner, which types.
TEST_F(VlpStationTerminal, ShowsUnitsOfShiftWithScannedSerials) {
  if (run_program("tmux -V").exit_code != 0) GTEST_SKIP() << "tmux is not installed";
  change("station.yaml", "records: records.db",
         "records: records.db\nserial_pattern: 'SN-[0-9]{4}'");
  const Tmux tmux("PATH='" VLP_PROGRAMS_DIR "':$PATH NO_COLOR=1 vlp-station run --station " +
                      station.string() + " 2>/dev/null",
                  "-x 80 -y 24");
  tmux.screen_with("Operator");
  tmux.type("Bo BSpace BSpace Ann Enter");
  tmux.screen_with("Shift");
  tmux.type("early Enter");
  expect_screen(tmux.screen_with("Serial"), "shift.txt");
  tmux.type("SN-12 Enter");
  expect_screen(tmux.screen_with("Wrong"), "shift-wrong.txt");
  tmux.type("SN-0001 Enter");
  tmux.screen_with("q: verdict now");
  // The next unit was scanned too early: no key of it counts.
  tmux.type("-l q-SN-0002");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_THAT(tmux.screen(), Not(HasSubstr("INVALID")));
  tmux.resize("-x 45 -y 12");
  tmux.type("-l qq");  // an impatient operator's
  tmux.screen_with("INVALID   camera SN-0001");
  const std::string next = tmux.screen_with("Serial\n");
  // What was there before is broken anew to the width.
  expect_screen(next.substr(std::min(next.find("INVALID"), next.size())), "shift-next.txt");
  tmux.type("q Enter");
  EXPECT_THAT(tmux.screen_with("1 units"), HasSubstr("1 units: 0 passed, 0 failed, 1 invalid"));
  EXPECT_THAT(records("show").output,
              testing::AllOf(HasSubstr("operator   Ann\n"), HasSubstr("shift      early\n")));
}

/// Lines of the screen with this text.
int lines_with(const std::string& screen, const std::string& text) {
  int count = 0;
  for (auto at = screen.find(text); at != std::string::npos; at = screen.find(text, at + 1)) {
    ++count;
  }
  return count;
}

TEST_F(VlpStationTerminal, RedrawsScreenWhenTerminalIsResized) {
  if (run_program("tmux -V").exit_code != 0) GTEST_SKIP() << "tmux is not installed";
  const Tmux tmux("PATH='" VLP_PROGRAMS_DIR "':$PATH " + run("0001", "") + " 2>/dev/null",
                  "-x 80 -y 24");
  const std::string keys = "q: verdict now";
  tmux.screen_with(keys);
  EXPECT_THAT(tmux.screen("-e"), HasSubstr("\x1b[1m")) << "colors";
  tmux.resize("-x 60 -y 12");
  // It draws anew at once: the heading is at the top, the keys at the bottom, once each.
  for (int i = 0; i < 100 && !tmux.screen().starts_with("station-1"); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const std::string small = tmux.screen_with(keys);
  EXPECT_THAT(small, testing::StartsWith("station-1"));
  EXPECT_EQ(lines_with(small, "station-1"), 1) << small;
  EXPECT_EQ(lines_with(small, keys), 1) << small;
  tmux.resize("-x 80 -y 24");
  tmux.screen_with("Next");
  // The verdict is longer than 24 lines. Its end is what counts.
  tmux.type("q");
  EXPECT_THAT(tmux.screen_with("INVALID   camera"), HasSubstr("###  #   #    #    #   #  #####"));
}

}  // namespace
}  // namespace vlp
