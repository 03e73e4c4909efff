// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics on files of corners instead of images, against the same from images and against
/// mrcal's own tool.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/projection_difference.h"
#include "pipeline/intrinsics_program.h"
#include "rig/calibration.h"
#include "support/datasets.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

class VlpIntrinsicsCornerFiles : public VlpIntrinsics {
 protected:
  Lens read_lens(const char* name) const {
    const Camera camera = read_calibration(folder / name).camera;
    return Lens(camera.lens_model, camera.intrinsics);
  }
};

constexpr const char* kSize = "--imager-px 800 600";

TEST_F(VlpIntrinsicsCornerFiles, TablesYieldSameLensAsImagesAndAsSolveOfMrcal) {
  const std::string rig = (folder / "rig").string(), board = rig + "/board.yaml";
  ASSERT_EQ(run_program("vlp-simulate -q " VLP_SOURCE_DIR
                        "/datasets/paper-rig/scene.yaml --only boards -o " +
                        rig)
                .exit_code,
            0);
  const std::string table = (folder / "corners.csv").string();
  const std::string views = rig + "/boards/00[01]?.png";
  ASSERT_EQ(calibrate(views, board, "--warp on --corners " + table).exit_code, 0);
  const std::string model = content("camera.cameramodel"), corners = content("camera.corners.vnl");
  const Camera from_images = read_calibration(folder / "camera.yaml").camera;

  const auto again = calibrate(table, board, std::string("--warp on ") + kSize);
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(read_calibration(folder / "camera.yaml").camera.intrinsics, from_images.intrinsics);
  EXPECT_EQ(content("camera.cameramodel"), model);
  EXPECT_EQ(content("camera.corners.vnl"), corners);

  // mrcal's table has the corners without the shift of their edges.
  const Lens lens = read_lens("camera.yaml");
  fs::create_directory(folder / "mrcal");
  fs::copy(folder / "camera.corners.vnl", folder / "mrcal/corners.vnl");
  const std::string vnl = (folder / "mrcal/corners.vnl").string();
  const auto solved = calibrate(vnl, board, std::string("--warp on ") + kSize);
  ASSERT_EQ(solved.exit_code, 0) << solved.errors;
  const Lens here = read_lens("camera.yaml");
  const std::array imager_px{800, 600};
  const auto one = [](const auto&) { return 1; };
  EXPECT_LT(compare_projections(lens, here, imager_px, one)->worst_px, 1e-3);
  EXPECT_EQ(read_calibration(folder / "camera.yaml").intrinsics_report->outliers, 0);
  const IntrinsicsReport report = *read_calibration(folder / "camera.yaml").intrinsics_report;

  if (run_program("command -v mrcal-calibrate-cameras").exit_code != 0) {
    GTEST_SKIP() << "no mrcal-calibrate-cameras here";
  }
  // By chance mrcal's own start has the pose of a view wrong, for one focal length or another.
  constexpr double right_px = 0.1;
  double theirs_px = INFINITY;
  for (const char* focal : {"500", "480", "520", "560", "440", "620"}) {
    const auto mrcal = run_program(
        "cd " + (folder / "mrcal").string() +
        " && rm -f camera-0.cameramodel && mrcal-calibrate-cameras --corners-cache corners.vnl "
        "--corners-cache-has-weights --lensmodel LENSMODEL_OPENCV8 --object-spacing 0.02 "
        "--object-width-n 12 "
        "--object-height-n 10 --imagersize 800 600 --skip-outlier-rejection --outdir . --focal " +
        focal + " '*.png'");
    const std::string before = "## RMS error: ";
    const auto at = mrcal.errors.rfind(before);
    ASSERT_NE(at, std::string::npos) << mrcal.errors;
    theirs_px = std::stod(mrcal.errors.substr(at + before.size()));
    if (theirs_px > right_px) continue;
    ASSERT_EQ(mrcal.exit_code, 0) << mrcal.errors;
    break;
  }
  ASSERT_LT(theirs_px, right_px);
  const Camera found = read_any_camera(folder / "mrcal/camera-0.cameramodel").camera;
  const Lens theirs(found.lens_model, found.intrinsics);
  EXPECT_LT(compare_projections(theirs, here, imager_px, one)->worst_px, 0.01);
  // mrcal counts the corners that are not seen, too, and its regularization, a tenth of the squares
  // of corners that are known to 0.01 px.
  constexpr double points = 12 * 10;
  const double over =
      theirs_px / (std::sqrt(report.corners / (report.views * points)) * report.rms_px);
  EXPECT_GT(over, 0.999);
  EXPECT_LT(over, 1.06);
}

}  // namespace
}  // namespace vlp
