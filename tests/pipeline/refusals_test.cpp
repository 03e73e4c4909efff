// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "small_simulation.h"
#include "support/datasets.h"

/// Inputs and options that each program rejects: the exit code, one line that names the cause, and
/// no file written or changed. What each reader rejects is tested beside it.
namespace vlp {
namespace {

namespace fs = std::filesystem;

struct Refusal {
  int exit_code;
  /// Shell commands in a folder with the files of datasets/example, of paper-rig as rig/, with
  /// scene.yaml, and with two fixes. They may write files whose names begin with "bad".
  std::string command;
  std::string words;
};

struct Program {
  std::string name;
  std::vector<Refusal> refusals;
};
void PrintTo(const Program& program, std::ostream* out) { *out << program.name; }

class EachProgram : public testing::TestWithParam<Program> {
 protected:
  EachProgram() {
    for (const auto& entry : fs::directory_iterator(kExample)) {
      fs::copy_file(entry.path(), folder / entry.path().filename());
    }
    fs::copy(kRig, folder / "rig", fs::copy_options::recursive);
    folder.file("scene.yaml", kSmallScene);
    folder.file("fixes.csv",
                "image,status,x_m,y_m,z_m,yaw_rad,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad,lamps,"
                "residual_px\na.png,ok,0.001,0,0,0,,,,,3,0\nb.png,too_few_lamps,,,,,,,,,1,\n");
    folder.file("places.csv", "image,x_m,y_m\na.png,0,0\nb.png,0,0\n");
  }
  Files files() const {
    Files files = files_below(folder / "");
    std::erase_if(files, [](const auto& file) { return file.first.starts_with("bad"); });
    return files;
  }
  const TemporaryFolder folder;
};

TEST_P(EachProgram, NamesCauseInOneLineAndWritesNothing) {
  const Files before = files();
  ASSERT_GT(before.size(), 10U);
  for (const auto& [exit_code, command, words] : GetParam().refusals) {
    SCOPED_TRACE(command);
    const auto result = run_program(
        "L='--lamps lamps.yaml' C='--calibration calibration.yaml' E=\"$L $C\"; "
        "R='--lamps rig/lamps.yaml --calibration rig/true_calibration.yaml'; cd '" +
        (folder / "").string() + "' && " + command);
    EXPECT_EQ(result.exit_code, exit_code) << result.errors;
    EXPECT_EQ(result.output, "");
    const std::string error = GetParam().name + ": error: ";
    const std::string line =
        result.errors.substr(std::min(result.errors.find(error), result.errors.size()));
    EXPECT_THAT(line, testing::HasSubstr(words)) << result.errors;
    EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << line;
    EXPECT_TRUE(files() == before) << "a file was written or changed";
  }
}

const Program kPrograms[] = {
    {"vlp-adjust",
     {{2, "vlp-adjust $E -o o", "SET: missing; give a folder of images or a table"},
      {2, "vlp-adjust turning.csv $E -o new.yaml", "lamps.yaml: lamp 1 has no sd_m"},
      {2,
       "sed '/row_time_s\\|readout/d' calibration.yaml >bad.yaml; vlp-adjust turning.csv $L "
       "--calibration bad.yaml -o o --map-sd-m 0.001 --max-speed-m-per-s 1",
       "a moving camera needs row_time_s and readout"}}},
    {"vlp-board",
     {{2, "vlp-board", "--output is required; see vlp-board --help"},
      {2, "vlp-board -o o.pdf --tag-mm 50", "does not fit on A4"},
      {2, "vlp-board -o o.pdf --paper B5", "there is no paper 'B5'"},
      {2, "vlp-board -o o.pdf --first-id 580", "tag"},
      {2, "vlp-board -o o.pdf --chessboard --tag-mm 20", "--tag-mm"},
      {2, "vlp-board -o o.pdf --charuco --dictionary DICT_4X4_5", "DICT_4X4_5"}}},
    {"vlp-calibrate",
     {{2, "vlp-calibrate", "session is required; see vlp-calibrate --help"},
      {2, "vlp-calibrate a --batch-stdin", "--batch-stdin: excludes all other arguments"}}},
    {"vlp-convert",
     {{2, "vlp-convert -o o", "input is required; see vlp-convert --help"},
      {2, "vlp-convert calibration.yaml --to kalibr -o o", "LENSMODEL_OPENCV4 or OPENCV_FISHEYE"},
      {2, "vlp-convert calibration.yaml --board rig/board.yaml --to lamps -o o",
       "needs corners of a board"},
      {2,
       "(echo image,tag,corner,u_px,v_px; for i in 0 1 2 3; do echo a.png,0,$i,$i,$i; done) "
       ">bad.csv; "
       "vlp-convert bad.csv --board rig/board.yaml --to lamps -o o",
       "too few corners to estimate the sigma_px of those without sd_px; give --sigma-px"}}},
    {"vlp-detect",
     {{2, "vlp-detect $E -o o", "images is required; see vlp-detect --help"},
      {2, "vlp-detect none $R -o o", "none: is not a folder of images"},
      {2, "mkdir bad-empty; vlp-detect bad-empty $R -o o", "bad-empty: contains no image"},
      {2, "mkdir bad; echo no >bad/1.png; vlp-detect bad $R -o o", "none of its 1 images can be"},
      {2, "vlp-detect rig/sample $R -o rig/sample/0001.png", "0001.png: is also an input"},
      {2, "vlp-detect rig/sample $R -o o.csv --lights ./o.csv", "--output and --lights are the"},
      {2, "vlp-detect rig/sample $R -o o --annotate rig/sample", "contains the images"},
      {2, "vlp-detect rig/sample $R -o o --threads 0", "--threads"},
      {2, "vlp-detect rig/sample $R -o o --every 2", "--every: there is no video; leave it out"},
      {2,
       "sed 's/{id/{room: hall, id/' rig/lamps.yaml >bad.yaml; vlp-detect rig/sample --lamps "
       "bad.yaml "
       "--calibration rig/true_calibration.yaml -o o --room attic",
       "bad.yaml: has no lamp with 'room: attic'"},
      {2, "vlp-detect rig/sample --lamps rig/lamps.yaml -o o", "--row-time-s"},
      {2,
       "sed -E 's/, frequency_hz: [0-9.e+]+//' rig/lamps.yaml >bad.yaml; vlp-detect rig/sample "
       "--lamps bad.yaml --calibration rig/true_calibration.yaml -o o",
       "bad.yaml: no lamp has a frequency_hz, which is needed to identify lamps"},
      {2, "echo no >bad.mp4; vlp-detect bad.mp4 $R -o o", "bad.mp4: cannot be opened as a video"},
      {3, "vlp-detect rig/sample-boards $R -o o", "no lamp was identified wholly in view"},
      {3, "vlp-detect rig/sample $R -o o --readout columns",
       "the readout is along columns in --readout, but the images show stripes along rows; correct "
       "it"}}},
    {"vlp-dispersion",
     {{2, "vlp-dispersion $E -o o", "images is required; see vlp-dispersion --help"},
      {2, "vlp-dispersion station.csv $E -o o", "the positions of the captures are unknown"},
      {2, "vlp-dispersion station.csv $E -o o --reference-point 100 -50", "frame of the lamp map"},
      {3, "head -5 station.csv >bad.csv; vlp-dispersion bad.csv $E -o o --reference-point 0.1 0",
       "add captures"}}},
    {"vlp-evaluate",
     {{2, "vlp-evaluate --truth places.csv", "fixes is required; see vlp-evaluate --help"},
      {2, "vlp-evaluate fixes.csv", "--truth"},
      {2, "vlp-evaluate fixes.csv --line 0 0 0 0", "start and end"},
      {2, "vlp-evaluate fixes.csv --truth places.csv --gate mean=1", "the gates are: mean_mm"},
      {2, "vlp-evaluate fixes.csv --truth places.csv --gate missing_fraction=50", "fraction"},
      {2, "vlp-evaluate fixes.csv --truth places.csv --junit bad.xml", "--junit"},
      {2, "vlp-evaluate fixes.csv --truth places.csv --json places.csv", "is also an input"},
      {2, "vlp-evaluate fixes.csv --truth places.csv --json a --report ./a", "are the same file"},
      {2, "vlp-evaluate fixes.csv --truth places.csv --report a --picture fixes.csv",
       "is neither an SVG nor a PNG"},
      {2, "sed s/a.png/c.png/ fixes.csv >bad.csv; vlp-evaluate bad.csv --truth places.csv",
       "bad.csv:2: image: 'c.png' is not in places.csv"},
      {3, "grep -v ok fixes.csv >bad.csv; vlp-evaluate bad.csv --truth places.csv --json o",
       "none of 2 captures has a fix"}}},
    {"vlp-intrinsics",
     {{2, "vlp-intrinsics --board b -o o", "images is required; see vlp-intrinsics --help"},
      {2, "vlp-intrinsics rig/none.png --board rig/board.yaml -o o", "none.png"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --gate mean=3", "mean"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --lens FISHEYE", "--lens"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --held-out 1", "--held-"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --warp maybe", "--warp"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --plot p.gif", "--plot"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --ros a --mrcal ./a",
       "--mrcal"},
      {2, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o --kalibr k",
       "Kalibr has no lens model like LENSMODEL_OPENCV8"},
      {2,
       "sed 's/first_id: 0/first_id: 100/' rig/board.yaml >bad.yaml; vlp-intrinsics "
       "rig/sample-boards --board bad.yaml -o o",
       "with other ids than those of the board, 100 to 129"},
      {2,
       "echo '# filename x y level' >bad.vnl; vlp-intrinsics bad.vnl --board rig/board.yaml -o o",
       "a file of corners has no image size; give --imager-px"},
      {2,
       "echo '# filename x y level' >bad.vnl; vlp-intrinsics bad.vnl --board rig/board.yaml -o o "
       "--imager-px 800 600 --threads 2",
       "--threads: only for images, and bad.vnl is a file of corners; leave it out"},
      {3, "vlp-intrinsics rig/sample --board rig/board.yaml -o o", "no tag of tag36h11 is visible"},
      {3, "vlp-intrinsics rig/sample-boards --board rig/board.yaml -o o",
       "1 views with the board: fewer than three"}}},
    {"vlp-limits",
     {{2, "vlp-limits $E --height-m 0", "--noise-px is required; see vlp-limits --help"},
      {2, "vlp-limits $E --height-m inf --noise-px 1", "--height-m"},
      {2, "vlp-limits $E --height-m 0 --noise-px 1 --floor-m 1 0 0 1", "x_min <= x_max"},
      {2, "vlp-limits $E --height-m 0 --noise-px 1 --step-m 1e-9", "more than ten million places"},
      {2, "vlp-limits $E --height-m 0 --noise-px 1 --map m --picture a.jpg", ".png or .svg"},
      {2, "vlp-limits $E --height-m 0 --noise-px 1 --map a.svg --picture ./a.svg",
       "--map and --picture are the same file"},
      {2,
       "sed '/row_time_s\\|readout/d' calibration.yaml >bad.yaml; vlp-limits $L "
       "--calibration bad.yaml --height-m 0 --noise-px 1 --max-speed-m-per-s 2",
       "a moving camera needs row_time_s and readout"},
      {2, "vlp-limits $E --height-m 0 --noise-px 1 --from-calibration", "has no uncertainties"},
      {2, "vlp-limits $E --height-m 0 --noise-px 1 >/dev/full", "stdout cannot be written"},
      {3, "vlp-limits $E --height-m 0 --noise-px 1 --floor-m 50 51 50 51",
       "two lamps are visible from no position"}}},
    {"vlp-locate",
     {{2, "vlp-locate $E -o o", "images is required; see vlp-locate --help"},
      {2, "vlp-locate --nonsense", "unknown: --nonsense; see vlp-locate --help"},
      {2, "vlp-locate detections.csv --lamps no.yaml $C -o o",
       "no.yaml: cannot be opened: No such file or directory"},
      {2, "vlp-locate detections.csv $E -o /no/such/folder/fixes.csv",
       "fixes.csv: cannot be written"},
      {2,
       "sed 's/1.6]/1600]/' lamps.yaml >bad.yaml; vlp-locate detections.csv --lamps bad.yaml "
       "$C -o fixes.csv",
       "bad.yaml:3: lamps[0].position_m[2]: 1600 m"},
      {2,
       "sed s/520,/.nan,/ calibration.yaml >bad.yaml; vlp-locate detections.csv $L "
       "--calibration bad.yaml -o fixes.csv",
       "camera.intrinsics[0]: "},
      {2, "sed 3s/,2,/,two,/ detections.csv >bad.csv; vlp-locate bad.csv $E -o fixes.csv",
       "bad.csv:3: lamp: "},
      {2, "sed 1s/u_px/u/ detections.csv >bad.csv; vlp-locate bad.csv $E -o fixes.csv",
       "bad.csv:1: u_px: "},
      {2, "vlp-locate detections.csv $E -o o --correction dispersion", "has no dispersion"},
      {2, "vlp-locate detections.csv $E -o o --poses p", "give --roll-pitch-sd-deg"},
      {2, "vlp-locate detections.csv $E -o o --one-lamp", "--captures"},
      {2, "vlp-locate detections.csv $E -o o --classifier lamps.yaml", "is no folder of images"},
      {2, "vlp-locate drive.avi $R -o o", "is a video; use vlp-detect"}}},
    {"vlp-rotation",
     {{2, "vlp-rotation $E -o o", "images is required; see vlp-rotation --help"},
      {2, "vlp-rotation turning.csv $E -o o --method guess", "--method"},
      {2, "vlp-rotation turning.csv $E -o o --refine-map m", "--refine-map needs --method lamps"},
      {2, "vlp-rotation turning.csv $E -o o --plot lamps.yaml", "is also an input and would be"},
      {2,
       "sed 's/id: /id: 1/' lamps.yaml >bad.yaml; vlp-rotation turning.csv --lamps bad.yaml "
       "$C -o o",
       "bad.yaml: "},
      {2,
       "sed -E 's/m: \\[(-?)/m: [-\\1/; s/--//' lamps.yaml >bad.yaml; vlp-rotation turning.csv "
       "--lamps bad.yaml $C -o o",
       "bad.yaml: the lamp map seems to be mirrored"},
      {3, "head -5 turning.csv >bad.csv; vlp-rotation bad.csv $E -o o", "add captures"},
      {3, "head -5 turning.csv >bad.csv; vlp-rotation bad.csv $E -o o --method lamps",
       "add captures"}}},
    {"vlp-simulate",
     {{2, "vlp-simulate -o o", "scene is required; see vlp-simulate --help"},
      {2, "vlp-simulate no.yaml -o o", "no.yaml: cannot be opened: No such file"},
      {2, "vlp-simulate scene.yaml -o o --seed -1", "see vlp-simulate --help"},
      {2, "vlp-simulate scene.yaml -o o --only boards,../boards", "no captures called '../boards'"},
      {2, "vlp-simulate scene.yaml -o fixes.csv/o", "cannot be made: Not a directory"},
      {2, "vlp-simulate scene.yaml -o .", "scene.yaml: is also an input and would be overwritten"},
      {2, "vlp-simulate scene.yaml -o rig", "contains captures of another scene, seed or version"},
      {2, "vlp-simulate scene.yaml -o rig/sample", "is not empty and contains no captures of this"},
      {2, "vlp-simulate scene.yaml -o o --archive 2", "the scene has no key 'archive'"},
      {2, "vlp-simulate scene.yaml -o o --archive 2 --only boards", "--only"},
      {2, "sed 's/bits: 8/bits: 12/' scene.yaml >bad.yaml; vlp-simulate bad.yaml -o o -q",
       "bad.yaml:12: sensor.bits: should be 8 or 16"},
      {2,
       "sed 's/border_bits: 1/border_bits: 2/; s/tag36h11/tagStandard41h12/' scene.yaml >bad.yaml; "
       "vlp-simulate bad.yaml -o o",
       "tags of tagStandard41h12 have no border of two black bits"}}},
    {"vlp-station",
     {{2, "vlp-station", "a command is missing; the commands are: run, verify,"},
      {2, "vlp-station diff run-1 run-2", "there is no command 'diff'; the commands are: run, ver"},
      {2, "vlp-station --oprator Ann", "unknown: --oprator"},
      {2, "vlp-station run", "--station is required; see vlp-station --help"},
      {2, "vlp-station void 1 --operator o", "--reason is required; see vlp-station --help"},
      {2,
       "cp -r " VLP_SOURCE_DIR "/datasets/station bad; vlp-station run --station bad/station.yaml "
       "--camera-id 1 --batch rig",
       "has none of the folders boards, rotation, dispersion, check"},
      {2, "vlp-station list --records typo.db", "typo.db: there are no records"}}},
    {"vlp-train",
     {{2, "vlp-train --lamps l", "folders is required; see vlp-train --help"},
      {2, "vlp-train rig/sample --lamps rig/lamps.yaml", "--output"},
      {2, "vlp-train rig/sample-boards --lamps rig/lamps.yaml -o o", "detections.csv is missing"},
      {2, "vlp-train --row-time rig/sample --lamps rig/lamps.yaml -o o", "add --calibration"},
      {3, "vlp-train rig/sample --lamps rig/lamps.yaml --labels true_detections.csv -o o",
       "too few labeled lights of lamps 1 (has 2), 2 (has 2)"}}},
};

INSTANTIATE_TEST_SUITE_P(Refusals, EachProgram, testing::ValuesIn(kPrograms),
                         [](const auto& instance) { return instance.param.name.substr(4); });

}  // namespace
}  // namespace vlp
