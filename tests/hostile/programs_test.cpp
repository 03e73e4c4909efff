// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Runs programs with files, names and outputs controlled by others. Checks the exit of each trial,
/// its time and memory, and the remaining files.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// Result of a program, with its time and memory.
struct Ending {
  int exit_code = -1;
  std::string output, errors;
  /// Processor time of the processes, which hardly depends on what else the machine does.
  double processor_s = 0;
  /// Largest resident size of the processes.
  double max_mib = 0;
};

/// Runs a shell command line in a folder that contains the example's files; kills it after a
/// minute.
Ending run_in(const TemporaryFolder& folder, const std::string& command) {
  const std::string line = "cd '" + (folder / "").string() +
                           "'; PATH='" VLP_PROGRAMS_DIR "':\"$PATH\"; { python3 " VLP_SOURCE_DIR
                           "/tests/hostile/peak_memory.py .peak timeout 60 bash -c '" +
                           command + "'; } >stdout 2>stderr </dev/null";
  const pid_t child = ::fork();
  if (child == 0) ::execl("/bin/bash", "bash", "-c", line.c_str(), nullptr);
  Ending ending;
  int status = 0;
  rusage usage{};
  ::wait4(child, &status, 0, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  ending.processor_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  ending.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  std::ifstream(folder / ".peak") >> ending.max_mib;
  EXPECT_GT(ending.max_mib, 0);
  ending.output = TemporaryFolder::read_content(folder / "stdout");
  ending.errors = TemporaryFolder::read_content(folder / "stderr");
  return ending;
}

void add_example(const TemporaryFolder& folder) {
  for (const char* name : {"lamps.yaml", "calibration.yaml", "detections.csv", "truth.csv"}) {
    folder.file(name, TemporaryFolder::read_content(kExample + name));
  }
  fs::copy_file(kRig + "/board.yaml", folder / "board.yaml");
}

/// Command with bad input, and its expected result.
struct Trial {
  std::string name;     // of the test
  std::string prepare;  // shell commands that make the input
  std::string command;
  int exit_code = 2;
  std::string message = "";  // on stderr
  double max_processor_s = 5, max_mib = 300;
  /// Shell condition on the folder afterwards.
  std::string afterwards = "true";
};

void PrintTo(const Trial& trial, std::ostream* out) { *out << trial.name; }

class HostileFile : public testing::TestWithParam<Trial> {};

TEST_P(HostileFile, ProgramEndsWithinTimeAndMemoryWithExpectedExitCode) {
  const TemporaryFolder folder;
  add_example(folder);
  const Trial& trial = GetParam();
  const Ending prepared = run_in(folder, trial.prepare);
  ASSERT_EQ(prepared.exit_code, 0) << prepared.errors;
  const Ending ending = run_in(folder, trial.command);
  EXPECT_EQ(ending.exit_code, trial.exit_code) << ending.errors.substr(0, 2000);
  EXPECT_THAT(ending.errors, HasSubstr(trial.message));
  EXPECT_GT(ending.processor_s, 0);
  EXPECT_LT(ending.processor_s, trial.max_processor_s);
  EXPECT_LT(ending.max_mib, trial.max_mib);
  if (trial.exit_code != 0) {
    EXPECT_EQ(std::count(ending.errors.begin(), ending.errors.end(), '\n'), 1) << ending.errors;
  }
  const Ending after = run_in(folder, trial.afterwards);
  EXPECT_EQ(after.exit_code, 0) << trial.afterwards << "\n" << ending.output << ending.errors;
}

const std::string kConvert = "vlp-convert calibration.yaml --to ros ";
const std::string kLocate =
    "vlp-locate detections.csv --lamps lamps.yaml --calibration calibration.yaml -o fixes.csv ";
const std::string kLimits =
    "vlp-limits --lamps lamps.yaml --calibration calibration.yaml --height-m 0 --noise-px 0.05 "
    "--tilt-deg 0.01 --lamp-map-mm 0.1 -q --picture limits.svg ";
const std::string kReport =
    "vlp-locate detections.csv --lamps lamps.yaml --calibration calibration.yaml -o fixes.csv -q "
    "&& "
    "vlp-evaluate fixes.csv --truth truth.csv --calibration calibration.yaml --lamps lamps.yaml "
    "--report report.html ";

/// Makes a lamp map: the lamps of the example and others far away, up to `lamps`.
std::string make_lamps(int lamps, const std::string& keys = "") {
  return "for i in $(seq 100 " + std::to_string(99 + lamps) +
         "); do echo \"  - {id: $i, position_m: [$((i % 100 * 3 + 50)), $((i / 100 * 3 + 50)), 3], "
         "diameter_m: 0.15" +
         keys + "}\"; done >>lamps.yaml";
}

/// Makes a table of this many columns and one row.
std::string make_wide_table(int columns) {
  return "{ printf \"image,lamp,u_px,v_px\"; printf \",c%d\" $(seq " + std::to_string(columns) +
         "); echo; printf \"a.png,1,400,300\"; printf \",%d\" $(seq " + std::to_string(columns) +
         "); echo; } >detections.csv";
}

const std::string kDetectImages =
    "vlp-detect images --lamps lamps.yaml --calibration calibration.yaml -o d.csv -q";

/// 30000 x 30000 px behind a marker without a length. Read as a length, the bytes behind the marker
/// lead to a frame header of 16 x 16 px in a segment that is skipped.
const std::string kJpegOfTwoSizes =
    "mkdir images; { printf \"\\xff\\xd8\\xff\\xd0\\xff\\xe1\\xff\\xff\"; "
    "head -c $((0xffe1 - 4)) /dev/zero; "
    "printf \"\\xff\\xc0\\x00\\x0b\\x08\\x00\\x10\\x00\\x10\\x01\\x01\\x11\\x00\"; "
    "head -c $((0xffff - 0xffe1 + 2 - 13)) /dev/zero; "
    "printf \"\\xff\\xc0\\x00\\x0b\\x08\\x75\\x30\\x75\\x30\\x01\\x01\\x11\\x00\"; "
    "printf \"\\xff\\xda\\x00\\x08\\x01\\x01\\x00\\x00\\x3f\\x00\\xff\\xd9\"; } >images/a.png";

/// 30000 x 30000 px by the first tags, which libtiff reads, and 16 x 16 px by the last.
const std::string kTiffOfTwoSizes =
    "mkdir images; { printf \"II*\\x00\\x08\\x00\\x00\\x00\\x04\\x00\"; "
    "for size in \"\\x30\\x75\" \"\\x10\\x00\"; do for tag in \"\\x00\" \"\\x01\"; do "
    "printf \"$tag\\x01\\x04\\x00\\x01\\x00\\x00\\x00$size\\x00\\x00\"; done; done; "
    "head -c 4 /dev/zero; } >images/a.png";

const std::string kCamera =
    "camera_matrix: {rows: 3, cols: 3, data: [500, 0, 400, 0, 500, 300, 0, 0, 1]}\\n"
    "distortion_model: plumb_bob\\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\\n";

/// Makes a camera_info file of ROS.
std::string make_camera(const std::string& width, const std::string& name) {
  return "printf \"image_width: " + width + "\\nimage_height: 600\\ncamera_name: " + name + "\\n" +
         kCamera + "\" >camera.yaml";
}

std::string name_of_trial(const testing::TestParamInfo<Trial>& trial) { return trial.param.name; }

INSTANTIATE_TEST_SUITE_P(Pictures, HostileFile,
                         testing::Values(Trial{"TemporaryFolderIsMissing", "true",
                                               "export TMPDIR=/does/not/exist; " + kReport, 0, "",
                                               30, 300, "grep -q image/svg report.html"},
                                         Trial{"TemporaryFolderIsMissingForThePictureOfLimits",
                                               "true", "export TMPDIR=/does/not/exist; " + kLimits,
                                               0, "", 30, 300, "grep -q \"<svg\" limits.svg"},
                                         Trial{"GnuplotSettingsRunCommands",
                                               "echo \"system(\\\"touch ran\\\")\" >.gnuplot",
                                               "export HOME=$PWD; " + kReport, 0, "", 30, 300,
                                               "! test -e ran"}),
                         name_of_trial);

INSTANTIATE_TEST_SUITE_P(
    Outputs, HostileFile,
    testing::Values(
        Trial{"PipeAsStdoutWhenQuiet", "true", kConvert + "-q -o /dev/stdout | cat >copy", 0, "", 5,
              300, "grep -q camera_matrix copy"},
        Trial{"TableToAPipeWhenQuiet", "true",
              "vlp-locate detections.csv --lamps lamps.yaml --calibration calibration.yaml -q "
              "-o /dev/stdout | cat >copy",
              0, "", 5, 300, "test $(wc -l <copy) = 37"},
        Trial{"StdoutThatIsAppendedTo", "echo old >log", kConvert + "-q -o /dev/stdout >>log", 0,
              "", 5, 300, "test $(head -n 1 log) = old && grep -q camera_matrix log"},
        Trial{"DescriptorOfTheShell", "true", kConvert + "-q -o /dev/fd/7 7>copy", 0, "", 5, 300,
              "grep -q camera_matrix copy"},
        Trial{"PrivateFileIsReplaced", "touch out; chmod 600 out", kConvert + "-q -o out", 0, "", 5,
              300, "test $(stat -c %a out) = 600 && grep -q camera_matrix out"},
        Trial{"FileOfAnotherOwnerIsReplaced",
              "touch out; chmod 640 out; test $(id -u) != 0 || chown 12345:12346 out; "
              "stat -c %u:%g:%a out >before",
              kConvert + "-q -o out", 0, "", 5, 300,
              "test $(stat -c %u:%g:%a out) = $(cat before) && grep -q camera_matrix out"},
        Trial{"FileBeyondTheLimitOfSizes", "true", "ulimit -f 1; " + kLocate + "-q", 2,
              "fixes.csv: cannot be written: File too large", 5, 300, "! ls -A | grep tmp-"},
        Trial{"StdoutIsFull", "true", "vlp-convert calibration.yaml -o out >/dev/full", 2,
              "stdout cannot be written", 5, 300},
        Trial{"PasswordOnTheCommandLine", "true",
              "vlp-station list --records postgresql://u:secret@localhost/vlp", 2,
              "a password on the command line is visible", 5, 300, "! grep secret stderr"}),
    name_of_trial);

INSTANTIATE_TEST_SUITE_P(
    LargeInputs, HostileFile,
    testing::Values(
        Trial{"MapOfThousandLamps", make_lamps(1000), kLocate + "-q", 0, "", 2, 100},
        Trial{"MapOfNineThousandLamps", make_lamps(9000), kLocate + "-q", 0, "", 5, 400},
        Trial{"MapOfNineThousandSurveyedLamps", make_lamps(9000, ", sd_m: 0.001"), kLocate + "-q",
              0, "", 5, 400},
        Trial{"TableOfHundredThousandColumns", make_wide_table(100'000), kLocate + "-q", 3,
              "no frame has a fix", 5, 300},
        Trial{"MissingColumnAmongHundredThousand",
              make_wide_table(100'000) + "; sed -i s/u_px/u/ detections.csv", kLocate, 2,
              "this column is missing", 5, 300, "test $(stat -c %s stderr) -lt 1000"},
        Trial{"SparseImage", "mkdir images; truncate -s 3G images/a.png",
              "vlp-detect images --lamps lamps.yaml --calibration calibration.yaml -o d.csv -q", 2,
              "a.png: is longer than 1586 MiB", 2, 300},
        Trial{"JpegOfTwoSizes", kJpegOfTwoSizes, kDetectImages, 2,
              "a.png: is 30000 x 30000 px, more than the 200 million", 2, 300},
        Trial{"TiffOfTwoSizes", kTiffOfTwoSizes, kDetectImages, 2,
              "a.png: is 30000 x 30000 px, more than the 200 million", 2, 300},
        Trial{"PipeAsVideo", "mkfifo a.avi",
              "vlp-detect a.avi --lamps lamps.yaml --calibration calibration.yaml -o d.csv", 2,
              "a.avi: is a pipe or a device, not a file", 2, 300},
        Trial{"PipeAsImage", "mkdir images; mkfifo images/a.png",
              "vlp-detect images --lamps lamps.yaml --calibration calibration.yaml -o d.csv -q", 2,
              "images: contains no image", 2, 300},
        Trial{"EndlessCamera", "true", "vlp-convert /dev/zero -o out", 2,
              "is a pipe or a device, not a file", 2, 100},
        Trial{"SparseCamera", "truncate -s 3G camera.yaml", "vlp-convert camera.yaml -o out", 2,
              "is longer than 64 MiB", 2, 100},
        Trial{"DeeplyNestedCamera", "head -c 1000000 /dev/zero | tr \"\\\\0\" [ >camera.yaml",
              "vlp-convert camera.yaml -o out", 2, "is nested too deep", 5, 300}),
    name_of_trial);

INSTANTIATE_TEST_SUITE_P(
    Values, HostileFile,
    testing::Values(
        Trial{"ImagerOfTwoBillionPixels", make_camera("2147483647", "a"),
              "vlp-convert camera.yaml --to ros -o out", 2, "the image should be 1 to 1048576 px"},
        Trial{"CameraNameWithEscapes", make_camera("800", "\\\"\\\\\\\\e[2J\\\""),
              "vlp-convert camera.yaml --to ros -o out", 2, "contains control characters"},
        Trial{"CameraNameWithQuotes", make_camera("800", "it\\47\\47s"),
              "vlp-convert camera.yaml --to ros -o out -q && vlp-convert out -o back -q", 0, "", 5,
              300, "grep -q \"id: .it..s\" back"},
        Trial{"CovarianceBeyondAllNumbers",
              "printf \"joint_covariance: {lamps: [], parameters: [zenith_x, zenith_y], \" "
              ">>calibration.yaml;"
              "printf \"rows: [[1e308], [0, 1e308]]}\\n\" >>calibration.yaml",
              kLocate, 2, "beyond 1,000,000"},
        Trial{"FormulaAsImage", "sed -i \"s/spot_00.png/=HYPERLINK(1)/\" detections.csv truth.csv",
              kLocate + "-q && vlp-evaluate fixes.csv --truth truth.csv -q", 0, "", 5, 300,
              "grep -q ^.\\\\?.=HYPERLINK fixes.csv && ! grep -q ^=HYPERLINK fixes.csv"}),
    name_of_trial);

/// Programs with the arguments that can be replaced by any kind of file.
const std::vector<std::string> kReaders{
    "vlp-locate BAD --lamps lamps.yaml --calibration calibration.yaml -o out.csv",
    "vlp-locate detections.csv --lamps BAD --calibration calibration.yaml -o out.csv",
    "vlp-locate detections.csv --lamps lamps.yaml --calibration BAD -o out.csv",
    "vlp-evaluate BAD --truth truth.csv",
    kLocate + "-q && vlp-evaluate fixes.csv --truth BAD",
    "vlp-rotation BAD --lamps lamps.yaml --calibration calibration.yaml -o out.yaml",
    "vlp-dispersion BAD --lamps lamps.yaml --calibration calibration.yaml --reference-point 0 0 -o "
    "out.yaml",
    "vlp-adjust BAD --lamps lamps.yaml --calibration calibration.yaml -o out.yaml",
    "vlp-limits --lamps BAD --calibration calibration.yaml --height-m 0 --noise-px 0.05 "
    "--tilt-deg 0.01 --lamp-map-mm 0.1 --picture out.svg",
    "vlp-limits --lamps lamps.yaml --calibration BAD --height-m 0 --noise-px 0.05 "
    "--tilt-deg 0.01 --lamp-map-mm 0.1 --picture out.svg",
    "vlp-simulate BAD -o out",
    "vlp-convert BAD -o out.yaml",
    "vlp-intrinsics BAD --board board.yaml --row-time-s 3e-5 --readout rows -o out.yaml",
    "vlp-station list --station BAD",
    "vlp-station run --station BAD --camera-id a"};

struct BadFile {
  std::string name, make;
};

void PrintTo(const BadFile& bad, std::ostream* out) { *out << bad.name; }

class EveryReader : public testing::TestWithParam<BadFile> {};

TEST_P(EveryReader, RejectsSpecialFileWithErrorAndWritesNoOutput) {
  std::size_t refused = 0;
  for (const std::string& reader : kReaders) {
    for (const char* ending : {".csv", ".yaml"}) {
      const TemporaryFolder folder;
      add_example(folder);
      const std::string name = std::string("bad") + ending;
      ASSERT_EQ(run_in(folder, "B=" + name + "; " + GetParam().make).exit_code, 0);
      std::string command = reader;
      command.replace(command.find("BAD"), 3, name);
      const Ending ending_of = run_in(folder, "timeout 10 " + command);
      EXPECT_EQ(ending_of.exit_code, 2) << command << "\n" << ending_of.errors;
      EXPECT_THAT(ending_of.errors, HasSubstr(name)) << command;
      EXPECT_LT(ending_of.max_mib, 200) << command;
      for (const char* output : {"out.csv", "out.yaml", "out.svg"}) {
        EXPECT_FALSE(fs::exists(folder / output)) << command;
      }
      ++refused;
    }
  }
  EXPECT_EQ(refused, 2 * kReaders.size());
}

INSTANTIATE_TEST_SUITE_P(
    Files, EveryReader,
    testing::Values(BadFile{"Pipe", "mkfifo $B"}, BadFile{"Device", "ln -s /dev/zero $B"},
                    BadFile{"Terminal", "ln -s /dev/tty $B"}, BadFile{"Folder", "mkdir $B"},
                    BadFile{"Sparse", "truncate -s 3G $B"}, BadFile{"Loop", "ln -s $B $B"},
                    BadFile{"LinkToStdin", "ln -s /dev/stdin $B"}),
    [](const auto& bad) { return bad.param.name; });

TEST(EveryProgram, ReportsErrorWhenHelpCannotBeWritten) {
  std::size_t programs = 0;
  for (const auto& program : fs::directory_iterator(VLP_PROGRAMS_DIR)) {
    const std::string name = program.path().filename();
    if (!name.starts_with("vlp-")) continue;
    ++programs;
    for (const char* option : {"--help", "--version", "--reference man"}) {
      const auto result = run_program(name + " " + option + " >/dev/full");
      EXPECT_EQ(result.exit_code, 2) << name << " " << option;
      EXPECT_THAT(result.errors, HasSubstr("stdout cannot be written")) << name << " " << option;
    }
  }
  EXPECT_GT(programs, 10U);
}

/// Formats whose size is not read from their header are not decoded.
TEST(ImageReadingPrograms, RejectUnsupportedImageFormats) {
  std::size_t formats = 0;
  for (const char* ending : {".webp", ".jp2", ".ras", ".hdr"}) {
    std::vector<unsigned char> bytes;
    const cv::Mat image(512, 512, CV_8UC3, cv::Scalar(90, 90, 90));
    try {
      if (!cv::imencode(ending, image, bytes)) continue;
    } catch (const cv::Exception&) {  // this OpenCV has no such encoder
      continue;
    }
    ++formats;
    const TemporaryFolder folder;
    add_example(folder);
    fs::create_directory(folder / "images");
    folder.file("images/a.png", {bytes.begin(), bytes.end()});
    for (const std::string command :
         {"vlp-detect images --lamps lamps.yaml --calibration calibration.yaml -o d.csv",
          "vlp-locate images --lamps lamps.yaml --calibration calibration.yaml -o f.csv",
          "vlp-intrinsics images --board board.yaml --row-time-s 3e-5 --readout rows -o c.yaml"}) {
      const Ending ending_of = run_in(folder, command);
      EXPECT_THAT(ending_of.exit_code, testing::AnyOf(2, 3)) << command << ending;
      EXPECT_THAT(ending_of.errors, HasSubstr("it is not PNG, JPEG, BMP, TIFF, PBM, PGM or PPM"))
          << command << ending;
    }
  }
  EXPECT_GE(formats, 3U) << "too few encoders";
}

}  // namespace
}  // namespace vlp
