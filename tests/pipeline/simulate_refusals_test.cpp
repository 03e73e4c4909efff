// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Invalid input of vlp-simulate: an error in one line, exit code 2, and no changed file.
#include <algorithm>

#include "small_simulation.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class VlpSimulateErrors : public SmallSimulation {
 protected:
  void expect_refused(const std::string& options, const std::string& message) const {
    const auto result = simulate(options);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors, HasSubstr("vlp-simulate: error: "));
    EXPECT_THAT(result.errors, HasSubstr(message));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_EQ(result.output, "");
  }
  void expect_refused_and_nothing_made(const std::string& options, const std::string& message) {
    expect_refused(options, message);
    EXPECT_FALSE(std::filesystem::exists(output));
  }
};

TEST_F(VlpSimulateErrors, RejectsOutputFolderOfOtherSeedOrScene) {
  ASSERT_EQ(simulate("--only boards").exit_code, 0);
  std::filesystem::remove(output / "boards/0000.png");
  const Files before = files_below(output);
  const std::string message =
      output.string() + ": contains captures of another scene, seed or version";
  expect_refused("--seed 2", message);
  expect_refused("--seed 2 --only lamps", message);
  change_scene("blur_px: 0.5", "blur_px: 0.6");
  expect_refused("", message);
  change_scene("blur_px: 0.6", "blur_px: 0.5");
  EXPECT_TRUE(files_below(output) == before);
  EXPECT_EQ(simulate("--only boards").exit_code, 0) << "it is the same scene again";
}

TEST_F(VlpSimulateErrors, RejectsOutputFolderWithForeignFiles) {
  for (const std::string name : {"notes.txt", "boards/0000.png", "lamps.yaml"}) {
    std::filesystem::create_directories(output / "boards");
    folder.file("output/" + name, "mine\n");
    expect_refused("", output.string() + ": is not empty and contains no captures of this scene");
    EXPECT_EQ(files_below(output), (Files{{name, "mine\n"}}));
    std::filesystem::remove_all(output);
  }
}

TEST_F(VlpSimulateErrors, RejectsOutputThatWouldOverwriteSceneFile) {
  output = folder / "";
  expect_refused("", "scene.yaml: is also an input and would be overwritten");
  EXPECT_EQ(files_below(output).at("scene.yaml"), kSmallScene);
}

TEST_F(VlpSimulateErrors, NamesRequestedCapturesMissingInScene) {
  expect_refused_and_nothing_made("--only nothing", "the scene has no captures called 'nothing'");
  expect_refused_and_nothing_made("--only boards,../boards", "no captures called '../boards'");
}

TEST_F(VlpSimulateErrors, NamesOutputFolderThatCannotBeCreated) {
  output = folder.file("file", "mine\n");
  expect_refused("", output.string() + ": cannot be made: Not a directory");
  output = output / "below";
  expect_refused("", output.string() + ": cannot be made: Not a directory");
  EXPECT_EQ(TemporaryFolder::read_content(folder / "file"), "mine\n");
}

TEST_F(VlpSimulateErrors, NamesLineAndKeyOfInvalidSceneValue) {
  change_scene("bits: 8", "bits: 12");
  expect_refused_and_nothing_made("", scene.string() + ":12: sensor.bits: should be 8 or 16");
  expect_refused_and_nothing_made("--quiet", scene.string() + ":12: sensor.bits: ");
}

TEST_F(VlpSimulateErrors, NamesMissingSceneFile) {
  scene = folder / "no.yaml";
  expect_refused_and_nothing_made("", scene.string() + ": cannot be opened: No such file");
}

TEST_F(VlpSimulateErrors, RejectsInvalidThreadsAndSeeds) {
  for (const std::string options : {"--threads 0", "--threads two", "--seed -1", "--seed 1.5"}) {
    expect_refused_and_nothing_made(options, "see vlp-simulate --help");
  }
}

TEST_F(VlpSimulateErrors, RejectsBoardWithTagsBeyondFamily) {
  const std::string rows = "scene.yaml:21: board.pattern.rows: ",
                    limit = " needs more than the 587 tags of tag36h11",
                    message = rows + "a board of 6 tags from id 582" + limit;
  change_scene("first_id: 0", "first_id: 581");
  EXPECT_EQ(run_program(command("--only boards")).exit_code, 0) << "the last six";
  std::filesystem::remove_all(output);
  change_scene("first_id: 581", "first_id: 582");
  expect_refused_and_nothing_made("", message);
  expect_refused_and_nothing_made("--only lamps", message);
  change_scene("first_id: 582", "first_id: 0");
  change_scene("cols: 3, rows: 2", "cols: 49, rows: 12");
  expect_refused_and_nothing_made("", rows + "a board of 588 tags from id 0" + limit);
}

TEST_F(VlpSimulateErrors, RejectsTwoBitBorderForFamilyWithoutIt) {
  change_scene("border_bits: 1", "border_bits: 2");
  EXPECT_EQ(run_program(command("--only boards")).exit_code, 0);
  std::filesystem::remove_all(output);
  change_scene("family: tag36h11", "family: tagStandard41h12");
  expect_refused_and_nothing_made(
      "", "board.pattern: tags of tagStandard41h12 have no border of two black bits");
}

TEST_F(VlpSimulateErrors, RejectsTagSpacingTooSmallForFamily) {
  change_scene("family: tag36h11", "family: tagStandard41h12");
  EXPECT_EQ(run_program(command("--only boards")).exit_code, 0);
  std::filesystem::remove_all(output);
  change_scene("tag_spacing: 1,", "tag_spacing: 0.3,");
  expect_refused_and_nothing_made(
      "", "board.pattern: the gap between the tags is too small for tagStandard41h12");
}

}  // namespace
}  // namespace vlp
