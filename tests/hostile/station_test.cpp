// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Runs vlp-station and vlp-calibrate with folders that others can write to, and with texts that
/// forge lines. Nothing outside is changed, no file of others is lost, and each problem is reported
/// in one line.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/small_station.h"
#include "station/database_name.h"
#include "station/records/spool.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Station with files of another user next to it.
class HostileStation : public SmallStation {
 public:
  HostileStation() { fs::create_directory(elsewhere); }
  using SmallStation::change;
  using SmallStation::result;

  /// Returns a vlp-station command for this station, killed after 30 s.
  ProgramResult vlp_station(const std::string& command, const std::string& options = "") const {
    return run_program("timeout 30 vlp-station " + command + " --station " +
                       (home / "station.yaml").string() + " " + options);
  }
  /// Runs a unit without images, which is INVALID after idle_s.
  ProgramResult empty_run(const std::string& options = "", const std::string& camera = "0001",
                          const std::string& idle_s = "0.1") const {
    return vlp_station("run", "--camera-id " + camera + " --idle-s " + idle_s + " " + options);
  }
  /// Returns the id of the only run in the records.
  std::string name_of_run() const {
    const std::string listed = vlp_station("list").output;
    const auto at = listed.find("\n20");
    return at == std::string::npos ? "" : listed.substr(at + 1, 33);
  }
  /// Creates a pipe, a link or a file, with its folder.
  fs::path in_folder(const fs::path& name) const {
    fs::create_directories((home / name).parent_path());
    return home / name;
  }
  void link(const fs::path& name, const fs::path& target) const {
    fs::create_symlink(target, in_folder(name));
  }
  void write(const fs::path& name, const std::string& text) const {
    folder.file(in_folder(name).string(), text);
  }
  std::string content(const fs::path& name) const {
    return TemporaryFolder::read_content(home / name);
  }
  /// Runs Python with the station's folder as its first argument.
  void python(const std::string& script) const {
    const auto done =
        run_program("python3 " + folder.file("script.py", script).string() + " " + home.string());
    ASSERT_EQ(done.exit_code, 0) << done.errors;
    fs::remove(folder / "script.py");
  }
  /// Sets the end of the only run to this many days ago, in records and folders.
  void age_run(int days) const {
    python(
        "import os, sqlite3, sys, time\n"
        "db = sqlite3.connect(sys.argv[1] + '/records.db', isolation_level=None)\n"
        "run = db.execute('SELECT run FROM runs').fetchone()[0]\n"
        "past = time.gmtime(time.time() - 86400 * " +
        std::to_string(days) +
        ")\n"
        "old = time.strftime('%Y%m%dT%H%M%SZ', past) + run[16:]\n"
        "ended = time.strftime('%Y-%m-%dT%H:%M:%SZ', past)\n"
        "was = db.execute('SELECT ended_utc FROM runs').fetchone()[0]\n"
        "db.execute('UPDATE runs SET run = ?, ended_utc = ?, '\n"
        "           'document = replace(replace(document, run, ?), ?, ?)',\n"
        "           (old, ended, old, was, ended))\n"
        "for place, name in (('captures', '0001.'), ('results/0001', '')):\n"
        "    os.rename(f'{sys.argv[1]}/{place}/{name}{run}', "
        "f'{sys.argv[1]}/{place}/{name}{old}')\n");
  }
  /// Stores a run in the outbox, and replaces a text of its document.
  void spool(const std::string& from, const std::string& to) const {
    RunRecord run;
    run.run = kSpooledRun;
    run.kind = "unit";
    run.station = "station-1";
    run.camera = "0001";
    run.begun_utc = run.ended_utc = "2026-11-21T13:45:01Z";
    run.verdict = "INVALID";
    run.causes = "no images\n";
    run.calibration = "format: vlp-calibration/1\n";
    std::string text = serialize_run(run);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    spool(run, text.replace(at, from.size(), to));
  }
  /// Stores a run in the outbox with another document.
  void spool(const RunRecord& run, const std::string& document) const {
    Records((home / "spool/outbox.db").string())
        .store_run(run, derive_identity((home / "records.db").string()));
    write("document", document);
    python(
        "import os, sqlite3, sys\n"
        "db = sqlite3.connect(sys.argv[1] + '/spool/outbox.db', isolation_level=None)\n"
        "document = open(sys.argv[1] + '/document').read()\n"
        "db.execute('UPDATE runs SET document = ?', (document,))\n"
        "os.remove(sys.argv[1] + '/document')\n");
  }
  /// Expects that the other user's files, and all files next to the station, are unchanged.
  void expect_nothing_outside() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder / "")) {
      names.insert(entry.path().filename().string());
    }
    EXPECT_THAT(names, testing::ElementsAre("elsewhere", "mine.txt", "station"));
    EXPECT_EQ(TemporaryFolder::read_content(mine), kMine);
    EXPECT_TRUE(fs::is_empty(elsewhere));
  }

  const std::string kMine = "mine\n", kSpooledRun = "20261121T134501Z-0123456789abcdef";
  const fs::path home = folder / "station", elsewhere = folder / "elsewhere",
                 mine = folder.file("mine.txt", kMine);
};

/// Trial and its expected result.
struct StationTrial {
  std::string name;
  /// Prepares the folder and runs the program.
  std::function<ProgramResult(const HostileStation&)> run;
  int exit_code;
  /// Part of the expected stderr.
  std::string message;
  /// Checks the files afterwards.
  std::function<void(const HostileStation&, const ProgramResult&)> check = {};
};

void expect_run_goes_on(const HostileStation& station, const ProgramResult&) {
  EXPECT_THAT(station.vlp_station("list").output,
              HasSubstr("1 runs, 0 passed, 0 failed, 1 invalid"));
}

void expect_empty_records(const HostileStation& station, const ProgramResult&) {
  EXPECT_THAT(station.vlp_station("list").output, Not(HasSubstr("INVALID")));
}

/// Expects that each line of a list is the header, a run by its id, empty or the count.
void expect_no_forged_line(const HostileStation&, const ProgramResult& result) {
  std::istringstream lines(result.output);
  std::size_t num_run_lines = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("20")) ++num_run_lines;
    EXPECT_FALSE(line.starts_with("FORGED")) << line;
  }
  EXPECT_EQ(num_run_lines, 1U) << result.output;
}

const std::vector<StationTrial> kFolderTrials{
    {"StateNamesAFolderOutside",
     [](const HostileStation& s) {
       s.write("captures/0001/.run", "../../../x\n");
       return s.empty_run();
     },
     2, "captures/0001/.run: contains no id of a run: remove it", expect_empty_records},
    {"StateIsALink",
     [](const HostileStation& s) {
       s.link("captures/0001/.run", s.mine);
       return s.empty_run();
     },
     2, "captures/0001/.run: is a symbolic link"},
    {"StateOfAnotherCamera",
     [](const HostileStation& s) {
       s.empty_run("", "0002");
       s.write("captures/0001/.run", s.name_of_run() + "\n");
       return s.empty_run();
     },
     2, "of camera 0002: remove it", expect_run_goes_on},
    {"StateIsAPipe",
     [](const HostileStation& s) {
       ::mkfifo(s.in_folder("captures/0001/.run").c_str(), 0600);
       return s.empty_run();
     },
     2, "captures/0001/.run: is no regular file"},
    {"LockIsALink",
     [](const HostileStation& s) {
       s.link("captures/0001/.lock", s.elsewhere / "lock");
       return s.empty_run();
     },
     2, "captures/0001/.lock: is a symbolic link"},
    {"CapturesOfACameraAreALink",
     [](const HostileStation& s) {
       s.link("captures/0001", s.elsewhere);
       return s.empty_run();
     },
     2, "captures/0001: is a symbolic link"},
    {"CapturesOfAStepAreALink",
     [](const HostileStation& s) {
       s.link("captures/0001/boards", s.elsewhere);
       return s.empty_run();
     },
     2, "captures/0001/boards: is a symbolic link"},
    {"NextFrameOfASourceIsALink",
     [](const HostileStation& s) {
       s.link("captures/0001/boards/frame-000000.png", s.elsewhere / "frame.png");
       const std::string video = (s.home / "boards.avi").string();
       cv::VideoWriter(video, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10,
                       {800, 600})
           .write(cv::Mat::zeros(600, 800, CV_8UC3));
       return s.empty_run("--source boards=" + video, "0001", "5");  // until the frame is decoded
     },
     3, "is not judged",
     [](const HostileStation& s, const ProgramResult&) {
       EXPECT_THAT(s.vlp_station("show").output, HasSubstr("images     1, 0 used"));
     }},
    {"ResultsOfACameraAreALink",
     [](const HostileStation& s) {
       s.link("results/0001", s.elsewhere);
       return s.empty_run();
     },
     2, "results/0001: is a symbolic link"},
    {"ProbeOfTheResultsIsALink",
     [](const HostileStation& s) {
       s.link("results/0001/.writable", s.mine);
       return s.empty_run();
     },
     3, "is not judged", expect_run_goes_on},
    {"ProbeOfTheSpoolIsALink",
     [](const HostileStation& s) {
       s.link("spool/.writable", s.mine);
       return s.empty_run();
     },
     3, "is not judged", expect_run_goes_on},
    {"SpooledRunOfACameraOutside",
     [](const HostileStation& s) {
       s.empty_run();
       s.spool("\"camera\":\"0001\"", "\"camera\":\"../..\"");
       return s.vlp_station("restore " + s.kSpooledRun);
     },
     2, "'../..' is no id of a camera"},
    {"OutboxIsAPipe",
     [](const HostileStation& s) {
       s.empty_run();
       fs::remove(s.home / "spool/outbox.db");
       ::mkfifo(s.in_folder("spool/outbox.db").c_str(), 0600);
       return s.vlp_station("list");
     },
     0, "spool/outbox.db: is no regular file", expect_no_forged_line},
    {"OutboxIsALinkToADevice",
     [](const HostileStation& s) {
       s.empty_run();
       fs::remove(s.home / "spool/outbox.db");
       s.link("spool/outbox.db", "/dev/zero");
       return s.vlp_station("list");
     },
     0, "spool/outbox.db: is no regular file", expect_no_forged_line},
    {"JournalOfTheOutboxIsALink",
     [](const HostileStation& s) {
       s.empty_run();
       s.link("spool/outbox.db-journal", s.mine);
       return s.empty_run();
     },
     2, "spool/outbox.db: the records: "},
    {"SpooledRunIsNestedWithoutEnd",
     [](const HostileStation& s) {
       s.empty_run();
       s.spool("{", std::string(10'000'000, '['));
       return s.vlp_station("list");
     },
     0, "it has more than 16 levels"},
    {"PlantedReportIsReplaced",
     [](const HostileStation& s) {
       s.empty_run();
       const std::string run = s.name_of_run();
       s.write("results/0001/" + run + "/report.html", "<h1>PASS</h1>");
       return s.vlp_station("restore " + run);
     },
     0, "",
     [](const HostileStation& s, const ProgramResult&) {
       EXPECT_THAT(s.result("0001", "report.html"),
                   AllOf(HasSubstr("INVALID"), Not(HasSubstr("<h1>PASS</h1>"))));
       EXPECT_EQ(s.result("0001", "replaced-report.html"), "<h1>PASS</h1>");
     }},
    {"PlantedReportIsALink",
     [](const HostileStation& s) {
       s.empty_run();
       const std::string run = s.name_of_run();
       fs::remove(s.home / "results/0001" / run / "report.html");
       s.link("results/0001/" + run + "/report.html", s.mine);
       return s.vlp_station("restore " + run);
     },
     0, "",
     [](const HostileStation& s, const ProgramResult&) {
       EXPECT_THAT(s.result("0001", "report.html"), HasSubstr("INVALID"));
     }},
    {"ArchiveOfACameraOutside",
     [](const HostileStation& s) {
       s.write("archive/summary.csv",
               "camera,session,verdict,date,reason,version,key\n"
               "../..,s1,pass,2026-03-15,,1.2.3,key\n");
       return run_program("vlp-station import " + (s.home / "archive").string() + " --records " +
                          (s.home / "records.db").string());
     },
     2, "summary.csv:2: '../..' is no id of a camera"},
    {"ArchiveOfASessionOutside",
     [](const HostileStation& s) {
       s.write("archive/summary.csv",
               "camera,session,verdict,date,reason,version,key\n"
               "a,../../x,pass,2026-03-15,,1.2.3,key\n");
       return run_program("vlp-station import " + (s.home / "archive").string() + " --records " +
                          (s.home / "records.db").string());
     },
     2, "summary.csv:2: '../../x' is no id of a session"},
    {"ExpiredFolderHoldsTheGoldenCalibration",
     [](const HostileStation& s) {
       s.empty_run();
       s.age_run(100);
       const std::string name = "results/0001/" + s.name_of_run() + "/invalid-calibration.yaml";
       fs::copy_file(fs::path(VLP_SOURCE_DIR) / "datasets/paper-rig/rendered/true_calibration.yaml",
                     s.home / name);
       s.change("station.yaml", "records: records.db",
                "records: records.db\nretention: {images_days: 1, results_days: 1}\n"
                "golden: {camera_id: golden, calibration: " +
                    name + ", gates: {check_mean_mm: 20}}");
       return s.vlp_station("clean --delete");
     },
     0, "contains a file that station.yaml names: left",
     [](const HostileStation& s, const ProgramResult& result) {
       EXPECT_THAT(result.output, HasSubstr("1 folders, 0.0 MB deleted")) << "its images";
       EXPECT_EQ(s.vlp_station("list").exit_code, 0);
     }},
    {"ClockIsYearsAhead",
     [](const HostileStation& s) {
       s.empty_run();
       s.age_run(400);
       s.change("station.yaml", "records: records.db",
                "records: records.db\nretention: {images_days: 1, results_days: 1}");
       return s.vlp_station("clean --delete");
     },
     2, "more than a year before the clock",
     [](const HostileStation& s, const ProgramResult&) {
       EXPECT_NE(s.result("0001", "report.html"), "");
     }},
    {"ClockWasYearsAheadDuringARun",
     [](const HostileStation& s) {
       s.empty_run();
       s.age_run(-400);
       s.change("station.yaml", "records: records.db",
                "records: records.db\nretention: {images_days: 1, results_days: 1}");
       return s.vlp_station("clean --delete");
     },
     2, "after the clock",
     [](const HostileStation& s, const ProgramResult&) {
       EXPECT_NE(s.result("0001", "report.html"), "");
     }},
    {"ClockGoesBackDuringARun",
     [](const HostileStation& s) {
       s.write("captures/0001/.run", "29990101T000000Z-0123456789abcdef\n");
       return s.empty_run();
     },
     3, "the clock went back"},
};

const std::vector<StationTrial> kTextTrials{
    {"ReasonOfTwoLines",
     [](const HostileStation& s) {
       s.empty_run();
       EXPECT_EQ(s.vlp_station("void " + s.name_of_run() +
                               " --operator \"$(printf 'Ann\\nFORGED')\" --reason \"$(printf "
                               "'x\\nFORGED 2026 PASS')\"")
                     .exit_code,
                 0);
       return s.vlp_station("list");
     },
     0, "", expect_no_forged_line},
    {"ReasonOfTwoLinesIsShown",
     [](const HostileStation& s) {
       s.empty_run();
       s.vlp_station("void " + s.name_of_run() +
                     " --operator Ann --reason \"$(printf 'x\\nFORGED')\"");
       return s.vlp_station("show");
     },
     0, "",
     [](const HostileStation&, const ProgramResult& result) {
       EXPECT_THAT(result.output, AllOf(HasSubstr("x\\x0aFORGED"), Not(HasSubstr("\nFORGED"))));
     }},
    {"SpooledRunWithLinesInItsStation",
     [](const HostileStation& s) {
       s.change("station.yaml", "station: station-1", "station: any");
       s.empty_run();
       s.spool("\"station\":\"station-1\"", "\"station\":\"any\\nFORGED PASS\"");
       return s.vlp_station("list --of-station any");
     },
     0, "",
     [](const HostileStation&, const ProgramResult& result) {
       EXPECT_THAT(result.output, AllOf(HasSubstr("any\\x0aFORGED"), Not(HasSubstr("\nFORGED"))));
     }},
    {"CameraOfACalibrationHasLines",
     [](const HostileStation& s) {
       std::string text = TemporaryFolder::read_content(fs::path(VLP_SOURCE_DIR) /
                                                        "datasets/example/calibration.yaml");
       const std::string id = "id: \"example\"";
       s.write("calibration.yaml",
               text.replace(text.find(id), id.size(), R"(id: "a\nFORGED\e[2J")"));
       return run_program("vlp-convert " + (s.home / "calibration.yaml").string() +
                          " --to ros -o " + (s.home / "ros.yaml").string());
     },
     2, "the camera id contains control characters",
     [](const HostileStation& s, const ProgramResult& result) {
       EXPECT_THAT(result.output + result.errors, Not(HasSubstr("\nFORGED")));
       EXPECT_FALSE(fs::exists(s.home / "ros.yaml"));
     }},
    {"ImagesOfATableHaveLines",
     [](const HostileStation& s) {
       const std::string example = VLP_SOURCE_DIR "/datasets/example/";
       std::string text = TemporaryFolder::read_content(example + "turning.csv");
       const std::string image = "turn_00.png";
       for (auto at = text.find(image); at != std::string::npos; at = text.find(image)) {
         text.replace(at, image.size(), "\"a\nFORGED.png\"");
       }
       s.write("turning.csv", text);
       return run_program("vlp-rotation " + (s.home / "turning.csv").string() + " --lamps " +
                          example + "lamps.yaml --calibration " + example + "calibration.yaml -o " +
                          (s.home / "rotated.yaml").string());
     },
     0, "",
     [](const HostileStation&, const ProgramResult& result) {
       EXPECT_THAT(result.output, AllOf(HasSubstr("a\\x0aFORGED.png"), Not(HasSubstr("\nFORGED"))));
     }},
    {"OperatorIsNoUtf8",
     [](const HostileStation& s) {
       return s.empty_run("--operator \"$(printf 'J\\366rg')\" --shift \"$(printf '\\377')\"");
     },
     3, "is not judged",
     [](const HostileStation& s, const ProgramResult&) {
       const std::string report = s.result("0001", "report.html");
       EXPECT_THAT(report, HasSubstr("J\\xf6rg"));
       EXPECT_NO_THROW(nlohmann::json(report).dump()) << "not UTF-8";
     }},
    {"PatternWithExponentiallyManyWays",
     [](const HostileStation& s) {
       s.change("station.yaml", "records: records.db",
                "records: records.db\nserial_pattern: '(a+)+b'");
       return s.empty_run("", std::string(60, 'a'));
     },
     2, "serial_pattern: the comparison is too slow for"},
    {"RecordsAreTheExport",
     [](const HostileStation& s) {
       s.change("station.yaml", "records: records.db", "records: rec.csv");
       s.empty_run();
       return run_program("vlp-station export --records " + (s.home / "rec.csv").string() + " -o " +
                          (s.home / "rec.csv").string());
     },
     2, "rec.csv: is also an input and would be overwritten", expect_run_goes_on},
    {"RecordsOfTheStationAreTheExport",
     [](const HostileStation& s) {
       s.change("station.yaml", "records: records.db", "records: rec.json");
       s.empty_run();
       return s.vlp_station("export", "-o " + (s.home / "rec.json").string());
     },
     2, "rec.json: is also an input and would be overwritten", expect_run_goes_on},
    {"RecordsAreThePictureOfATrend",
     [](const HostileStation& s) {
       s.change("station.yaml", "records: records.db", "records: rec.svg");
       s.empty_run();
       return s.vlp_station("trend rms_px", "-o " + (s.home / "rec.svg").string());
     },
     2, "rec.svg: is also an input and would be overwritten", expect_run_goes_on},
    {"RecordsInAFolderWithAQuote",
     [](const HostileStation& s) {
       const fs::path quoted = s.home / "a\" db=b.db x=\"";
       fs::create_directory(quoted);
       for (const char* name : {"station.yaml", "camera_type.yaml", "board.yaml", "lamps.yaml"}) {
         fs::copy_file(s.home / name, quoted / name);
       }
       return run_program("cd " + s.elsewhere.string() + " && vlp-station run --station '" +
                          (quoted / "station.yaml").string() + "' --camera-id 0001 --idle-s 0.1");
     },
     2, "the name of a database cannot have a quote"},
};

/// vlp-calibrate with a folder of results that contains the user's own files.
const std::vector<StationTrial> kResultsTrials{
    {"UnmarkedFolderWithFilesOfTheUser",
     [](const HostileStation& s) {
       s.write("results/steps/mine.json", "{}");
       s.write("results/line-a-fixes.csv", "mine");
       fs::create_directory(s.home / "session");
       return run_program("vlp-calibrate " + (s.home / "session").string() + " -o " +
                          (s.home / "results").string());
     },
     2, "lamps.yaml: is missing",
     [](const HostileStation& s, const ProgramResult&) {
       EXPECT_EQ(s.content("results/steps/mine.json"), "{}");
       EXPECT_EQ(s.content("results/line-a-fixes.csv"), "mine");
     }},
    {"DriveOfTwoLines",
     [](const HostileStation& s) {
       fs::create_directories(s.home / "session/line-a\nFORGED");
       for (const char* table : {"captures.csv", "truth.csv"}) {
         s.write(fs::path("session/line-a\nFORGED") / table, "image,x_m,y_m\n");
       }
       for (const char* name : {"lamps.yaml", "board.yaml"})
         s.write(fs::path("session") / name, "");
       fs::create_directories(s.home / "session/boards");
       fs::create_directories(s.home / "session/rotation");
       return run_program("vlp-calibrate " + (s.home / "session").string() + " -o " +
                          (s.home / "results").string());
     },
     2, "'line-a\\x0aFORGED' is no id of a drive"},
    {"StepsAreALink",
     [](const HostileStation& s) {
       s.link("results/steps", s.elsewhere);
       fs::create_directory(s.home / "session");
       return run_program("vlp-calibrate " + (s.home / "session").string() + " -o " +
                          (s.home / "results").string());
     },
     2, "results/steps: is a symbolic link"},
    {"CornersOfTheStepsAreALink",
     [](const HostileStation& s) {
       s.link("results/steps/corners", s.elsewhere);
       fs::create_directory(s.home / "session");
       return run_program("vlp-calibrate " + (s.home / "session").string() + " -o " +
                          (s.home / "results").string());
     },
     2, "steps/corners: is a symbolic link"},
    {"LockOfTheStepsIsALink",
     [](const HostileStation& s) {
       s.link("results/steps/lock", s.elsewhere / "lock");
       fs::create_directory(s.home / "session");
       return run_program("vlp-calibrate " + (s.home / "session").string() + " -o " +
                          (s.home / "results").string());
     },
     2, "steps/lock: is a symbolic link"},
};

/// Measures time and memory of a command with documents of the maximum size, or larger.
TEST_F(HostileStation, ListEndsWithinTimeAndMemoryForHugeDocuments) {
  ASSERT_EQ(empty_run().exit_code, 3);
  RunRecord small;
  small.run = kSpooledRun;
  small.camera = "0001";
  small.verdict = "FAIL";
  constexpr std::size_t images = 100'000, limit_bytes = 16 << 20;
  RunRecord large = small, long_text = small;
  large.images.assign(images, {"boards", "0000.png", std::string(64, 'a'), ""});
  long_text.calibration.assign(limit_bytes - 1000, 'x');
  const std::vector<std::pair<std::string, std::string>> documents{
      {"half a million values", serialize_run(large)},
      {"a text of 16 MiB", serialize_run(long_text)},
      {"16 MiB of levels", std::string(limit_bytes - 1, '[')},
      {"more than 16 MiB", std::string(limit_bytes + 1, 'x')}};
  const auto script =
      folder.file("measure.py",
                  "import os, subprocess, sys\n"
                  "process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)\n"
                  "usage = os.wait4(process.pid, 0)[2]\n"
                  "print(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)\n");
  for (const auto& [name, text] : documents) {
    fs::remove(home / "spool/outbox.db");
    fs::remove(home / "records.db");
    { const Records made((home / "records.db").string()); }
    spool(small, text);
    const auto measured =
        run_program("python3 " + script.string() + " vlp-station list --station " +
                    (home / "station.yaml").string());
    double processor_s = 0, megabytes = 0;
    std::istringstream(measured.output) >> processor_s >> megabytes;
    std::printf("%-21s %5.2f s %5.0f MB\n", name.c_str(), processor_s, megabytes);
    EXPECT_GT(processor_s, 0) << measured.errors;
    EXPECT_LT(processor_s, 10);
    EXPECT_LT(megabytes, 500);
  }
}

class HostileFolder : public HostileStation, public testing::WithParamInterface<StationTrial> {};

TEST_P(HostileFolder, ProgramEndsWithExpectedExitCodeAndWritesNothingOutside) {
  const StationTrial& trial = GetParam();
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult result = trial.run(*this);
  const auto duration = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(result.exit_code, trial.exit_code) << result.output << result.errors;
  EXPECT_THAT(result.errors, HasSubstr(trial.message));
  EXPECT_LT(duration, std::chrono::seconds(20)) << "a program that does not wait takes far less";
  if (trial.check) trial.check(*this, result);
  expect_nothing_outside();
}

std::string name_of_station_trial(const testing::TestParamInfo<StationTrial>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(Folder, HostileFolder, testing::ValuesIn(kFolderTrials),
                         name_of_station_trial);
INSTANTIATE_TEST_SUITE_P(Text, HostileFolder, testing::ValuesIn(kTextTrials),
                         name_of_station_trial);
INSTANTIATE_TEST_SUITE_P(Results, HostileFolder, testing::ValuesIn(kResultsTrials),
                         name_of_station_trial);

}  // namespace
}  // namespace vlp
