// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tests of images that arrive, are overwritten and are removed.
#include <gmock/gmock.h>

#include "station/unit/unit.h"
#include "station/unit/unit_verdict.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// One view completes the boards but does not determine a lens.
struct UnitImages : testing::Test {
  UnitImages() {
    config.completion.board_views = 1;
    config.completion.board_coverage = 0;
  }
  /// Adds the only view, or an invalid file, under this name.
  void add_image(const std::string& name, bool is_valid) {
    const auto file = folder / name;
    if (is_valid) {
      fs::copy_file(VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png", file,
                    fs::copy_options::overwrite_existing);
    } else {
      folder.file(name, "no image");
    }
    unit.add_step_images(StationStep::boards, {file});
  }
  const UnitStep& boards() const { return unit.step_state(StationStep::boards); }
  std::string refusal(const std::string& name) const {
    return boards().images.at(name).rejection_message();
  }

  StationConfig config = read_station_config(VLP_SOURCE_DIR "/datasets/station/station.yaml");
  TemporaryFolder folder;
  Unit unit{config, "unit", {"test", "0"}, 1};
};

TEST_F(UnitImages, UsesDuplicateImageWhenFirstIsRemoved) {
  add_image("a.png", true);
  add_image("b.png", true);
  EXPECT_EQ(refusal("a.png"), "");
  EXPECT_EQ(refusal("b.png"), "is the same image as a.png");
  unit.remove_deleted(StationStep::boards, "a.png");
  EXPECT_EQ(refusal("b.png"), "");
  add_image("a.png", true);
  EXPECT_EQ(refusal("a.png"), "is the same image as b.png");
}

TEST_F(UnitImages, OverwrittenImageReplacesOldOneAndDiscardsStepResult) {
  add_image("a.png", true);
  unit.solve_completed(false);
  ASSERT_TRUE(boards().result);  // a problem: one view makes no lens
  add_image("b.png", true);
  EXPECT_TRUE(boards().result) << "an image that is not used changes nothing";
  add_image("a.png", false);
  EXPECT_FALSE(boards().result);
  EXPECT_THAT(refusal("a.png"), HasSubstr("cannot be read"));
  EXPECT_EQ(refusal("b.png"), "");
}

TEST_F(UnitImages, DiscardedUnreadableImagesStillCountAsRefused) {
  add_image("a.png", true);
  for (const char* name : {"b.png", "c.png"}) {
    add_image(name, false);
    fs::remove(folder / name);
    unit.mark_image_discarded(StationStep::boards, name);
  }
  EXPECT_EQ(boards().num_consecutive_rejections, 0);
  add_image("d.png", true);
  unit.mark_image_discarded(StationStep::boards, "d.png");  // same pose: no fault
  EXPECT_FALSE(boards().images.contains("d.png"));
  unit.remove_deleted(StationStep::boards, "a.png");
  unit.solve_completed(true);
  EXPECT_THAT(list_failure_causes(unit),
              ElementsAre(testing::Field(&Cause::text, AllOf(HasSubstr("boards (0/1)"),
                                                             HasSubstr("2 of 2 images refused")))));
}

TEST_F(UnitImages, RejectsFolderAndMissingFileAsUnreadableImage) {
  fs::create_directory(folder / "a.png");
  unit.add_step_images(StationStep::boards, {folder / "a.png", folder / "gone.png"});
  EXPECT_EQ(refusal("a.png"), "cannot be read as an image");
  EXPECT_EQ(refusal("gone.png"), "cannot be read as an image");
}

}  // namespace
}  // namespace vlp
