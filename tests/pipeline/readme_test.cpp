// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Checks of the pages of the tree (*.md): commands run as typed, links and paths have targets.
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <vector>

#include "evaluation/metric.h"
#include "support/program.h"
#include "support/real_data.h"
#include "support/schema.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = VLP_SOURCE_DIR;

/// Folders of the tree; other folders, such as build and out, belong to the user.
constexpr const char* kFolders[] = {"apps", "datasets", "lib", "scripts", "tests"};

/// The files of the tree whose names end like this, in order; those at the top first.
std::vector<fs::path> find_files(const std::vector<std::string>& endings) {
  const auto wanted = [&](const fs::path& file) {
    return std::find(endings.begin(), endings.end(), file.extension()) != endings.end();
  };
  std::vector<fs::path> top, files;
  for (const auto& entry : fs::directory_iterator(kSource)) {
    if (wanted(entry.path())) top.push_back(entry.path());
  }
  for (const char* folder : kFolders) {
    for (const auto& entry : fs::recursive_directory_iterator(kSource / folder)) {
      if (wanted(entry.path())) files.push_back(entry.path());
    }
  }
  std::sort(top.begin(), top.end());
  std::sort(files.begin(), files.end());
  top.insert(top.end(), files.begin(), files.end());
  return top;
}

/// README.md, those of apps, and so on.
std::vector<fs::path> pages() { return find_files({".md"}); }

std::string name_of_page(const fs::path& page) { return page.lexically_relative(kSource).string(); }

std::vector<std::string> lines_in(const fs::path& file) {
  std::vector<std::string> lines;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Command of a page, and its exit code.
struct Command {
  std::string line;
  int exit_code = 0;
};

/// Returns the command lines that begin with one of our programs or a command of kCommands, joined
/// where a backslash says so. Indented ones succeed; those in blocks ```bash miss a gate.
std::vector<Command> commands_in(const fs::path& page) {
  constexpr const char* kCommands[] = {"build/bin/vlp-", "vlp-",  "cp ",
                                       "mkdir -p out/",  "grep ", "scripts/compare_"};
  std::vector<Command> commands;
  bool continues = false, misses_gate = false;
  for (const std::string& line : lines_in(page)) {
    if (line.starts_with("```")) misses_gate = line == "```bash";
    const std::string indent = misses_gate ? "" : "    ";
    if (continues) {
      commands.back().line += line;
    } else if (std::ranges::any_of(kCommands, [&](const char* command) {
                 return line.starts_with(indent + command);
               })) {
      commands.push_back({line.substr(indent.size()), misses_gate ? 1 : 0});
    } else {
      continue;
    }
    continues = line.ends_with('\\');
    if (continues) commands.back().line.pop_back();
  }
  return commands;
}

/// Returns the lines in blocks ```text of a page up to "...", which programs print, as patterns in
/// which the last digit of a fraction may be another one.
std::vector<std::string> printed_patterns(const fs::path& page) {
  std::vector<std::string> patterns;
  bool inside = false;
  for (const std::string& line : lines_in(page)) {
    if (line.starts_with("```")) {
      inside = line == "```text";
    } else if (inside) {
      const std::string text = line.substr(0, line.find(" ..."));
      const std::string escaped = std::regex_replace(text, std::regex("[.()+]"), "\\$&");
      patterns.push_back(std::regex_replace(escaped, std::regex("(\\.\\d*)\\d"), "$1\\d"));
    }
  }
  return patterns;
}

/// Returns the cells of columns "repeat with" that are not empty.
std::vector<std::string> repeat_with_cells(const fs::path& page) {
  std::vector<std::string> cells;
  bool inside = false;
  for (const std::string& line : lines_in(page)) {
    inside = line.starts_with('|') && (inside || line.ends_with("| repeat with |"));
    if (!inside || line.starts_with("|---")) continue;
    const std::string cell = line.substr(line.rfind(" | ", line.size() - 3) + 3);
    if (cell != "|" && cell != "repeat with |") cells.push_back(cell);
  }
  return cells;
}

/// The page without its blocks of code, which may hold anything.
std::string read_prose(const fs::path& page) {
  std::string prose;
  bool code = false;
  for (const std::string& line : lines_in(page)) {
    if (line.starts_with("```")) code = !code;
    if (!code && !line.starts_with("    ")) prose.append(line).append("\n");
  }
  return prose;
}

/// Returns the matches of the first group of a pattern.
std::vector<std::string> matches(const std::string& text, const char* pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), expression), end; at != end; ++at) {
    found.push_back((*at)[1]);
  }
  return found;
}

/// Returns all pages in the order in which their commands are run: apps/README.md is followed by
/// the pages of its folder that it links to, in the order of its links.
std::vector<fs::path> pages_in_reading_order() {
  std::vector<fs::path> ordered;
  const auto add = [&](const fs::path& page) {
    if (std::find(ordered.begin(), ordered.end(), page) == ordered.end()) ordered.push_back(page);
  };
  for (const fs::path& page : pages()) {
    add(page);
    if (name_of_page(page) != "apps/README.md") continue;
    for (const std::string& link : matches(read_prose(page), "\\]\\(([^)#/\\s]+\\.md)")) {
      add(page.parent_path() / link);
    }
  }
  return ordered;
}

std::vector<std::string> find_headings(const fs::path& page) {
  std::vector<std::string> headings;
  for (const std::string& line : lines_in(page)) {
    const auto begin = line.find_first_not_of('#');
    if (line.starts_with('#') && line[begin] == ' ') headings.push_back(line.substr(begin + 1));
  }
  return headings;
}

/// As GitHub makes them: small letters, digits, '-' and '_', blanks as '-'.
std::string make_anchor(const std::string& heading) {
  std::string anchor;
  for (const char letter : heading) {
    const auto code = static_cast<unsigned char>(letter);
    if (std::isalnum(code) != 0 || letter == '-' || letter == '_') {
      anchor += static_cast<char>(std::tolower(code));
    } else if (letter == ' ') {
      anchor += '-';
    }
  }
  return anchor;
}

bool has_anchor(const fs::path& page, const std::string& anchor) {
  const auto headings = find_headings(page);
  return std::any_of(headings.begin(), headings.end(),
                     [&](const std::string& heading) { return make_anchor(heading) == anchor; });
}

/// Returns true if a page may use this path: relative to the top, to its own folder, or to lib.
bool is_there(const fs::path& page, const std::string& path) {
  const fs::path folders[] = {kSource, page.parent_path(), kSource / "lib"};
  return std::any_of(std::begin(folders), std::end(folders),
                     [&](const fs::path& folder) { return fs::exists(folder / path); });
}

/// Every column of a table that the programs wrote stands in the formats.
void expect_formats_to_name_columns(const fs::path& results) {
  const std::string page = read_prose(kSource / "datasets/README.md");
  std::set<std::string> named;
  for (const std::string& code : matches(page, "`([^`]*)`")) {
    for (const std::string& word : matches(code, "([a-z0-9_]+)")) named.insert(word);
  }
  std::size_t tables = 0;
  for (const auto& file : fs::recursive_directory_iterator(results)) {
    if (file.path().extension() != ".csv") continue;
    // What the programs keep for themselves.
    if (file.path().string().find("/steps/") != std::string::npos) continue;
    ++tables;
    for (const std::string& column : matches(lines_in(file).front() + ",", "([^,]+),")) {
      EXPECT_TRUE(named.contains(column)) << file.path() << ": " << column;
    }
  }
  EXPECT_GT(tables, 10U);
}

/// Folder like the source folder after a build, in which the commands of pages run.
class PageCommands : public testing::Test {
 protected:
  PageCommands() {
    fs::create_directories(folder / "build");
    fs::create_directories(folder / "out/recordings");
    fs::create_directory_symlink(VLP_PROGRAMS_DIR, folder / "build/bin");
    for (const char* name : {"datasets", "scripts"}) {
      fs::create_directory_symlink(kSource / name, folder / name);
    }
    // The recordings that scripts/fetch_recordings.sh fetches for the tutorial.
    for (const char* name : {"aprilgrid-mocap", "chessboard-fisheye", "led-1khz-frame"}) {
      const fs::path recording = real_data(name);
      has_recordings = has_recordings && !recording.empty();
      if (has_recordings) {
        fs::create_directory_symlink(recording, folder / "out/recordings" / name);
      }
    }
  }
  /// Runs the commands that were not run before. Returns all that they print.
  std::string run(const fs::path& page, const std::vector<Command>& commands) {
    std::string printed;
    for (const auto& [command, exit_code] : commands) {
      if (!ran.insert(command).second) continue;
      const auto result =
          run_program("cd '" + (folder / "").string() + "' && REAL=out/recordings; " + command);
      EXPECT_EQ(result.exit_code, exit_code) << name_of_page(page) << ": " << command << "\n"
                                             << result.errors;
      programs.insert(command.substr(0, command.find(' ')));
      printed += result.output + result.errors;
    }
    return printed;
  }

  const TemporaryFolder folder;
  bool has_recordings = true;
  std::set<std::string> ran, programs;
};

TEST_F(PageCommands, ExitWithZero) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "hundreds of images; the programs' own tests run under the sanitizers";
#endif
  for (const fs::path& page : pages_in_reading_order()) {
    if (name_of_page(page) == "apps/TUTORIAL.md") continue;
    std::vector<Command> commands = commands_in(page);
    for (const std::string& cell : repeat_with_cells(page)) {
      // Longer ones render images first.
      if (!has_recordings || !cell.starts_with("`build/bin/") || cell.find("&&") < cell.size())
        continue;
      commands.push_back({cell.substr(1, cell.find('`', 1) - 1)});
    }
    run(page, commands);
  }
  for (const auto& program : fs::directory_iterator(VLP_PROGRAMS_DIR)) {
    const std::string name = program.path().filename().string();
    EXPECT_TRUE(programs.contains("build/bin/" + name)) << name << " is shown by no page";
  }
  expect_formats_to_name_columns(folder / "out");
}

TEST_F(PageCommands, PrintValuesStatedInTutorial) {
  if (!has_recordings) GTEST_SKIP() << "no real captures: set VLP_REAL_DATA_DIR";
  const fs::path page = kSource / "apps/TUTORIAL.md";
  const auto collapse = [](const std::string& text) {
    return std::regex_replace(text, std::regex("\\s+"), " ");
  };
  const std::string printed = collapse(run(page, commands_in(page)));
  const std::vector<std::string> patterns = printed_patterns(page);
  EXPECT_GT(patterns.size(), 30U);
  for (const std::string& pattern : patterns) {
    EXPECT_TRUE(std::regex_search(printed, std::regex(collapse(pattern)))) << pattern;
  }
}

/// Names of the programs, such as "vlp-locate".
std::vector<std::string> program_names() {
  std::vector<std::string> names;
  for (const auto& program : fs::directory_iterator(VLP_PROGRAMS_DIR)) {
    names.push_back(program.path().filename().string());
  }
  return names;
}

TEST(DocumentationPages, EachProgramHasLinkedPage) {
  const auto names = program_names();
  ASSERT_THAT(names, testing::Contains("vlp-locate"));
  for (const std::string& name : names) {
    const fs::path page = kSource / "apps" / (name + ".md");
    ASSERT_TRUE(fs::exists(page)) << page;
    EXPECT_THAT(find_headings(page), testing::Contains(name));
    EXPECT_THAT(read_prose(kSource / "apps/README.md"), testing::HasSubstr("(" + name + ".md)"));
    EXPECT_THAT(read_prose(kSource / "README.md"), testing::HasSubstr("(apps/" + name + ".md)"));
  }
}

/// Returns the --help of a program and of its subcommands.
std::string help_with_subcommands(const std::string& program) {
  std::string help = run_program(program + " --help").output;
  const auto list = help.find("\nSubcommands:\n");
  if (list == std::string::npos) return help;
  for (const std::string& command : matches(help.substr(list), "\n  ([a-z-]+) ")) {
    help += run_program(program + " " + command + " --help").output;
  }
  return help;
}

TEST(DocumentationPages, StationPageListsEachCommand) {
  const std::string help = run_program("vlp-station --help").output;
  const auto commands = matches(help.substr(help.find("\nSubcommands:\n")), "\n  ([a-z-]+) ");
  ASSERT_GT(commands.size(), 10U);
  const std::string page = read_prose(kSource / "apps/vlp-station.md");
  for (const std::string& command : commands) {
    EXPECT_THAT(page, testing::ContainsRegex("\n\\|[^|]*`" + command + "[ `]")) << command;
  }
}

/// Returns the options that --help lists, such as "--output", at the beginning of their lines.
std::set<std::string> listed_options(const std::string& help) {
  const auto options = matches(help, "\n  (?:-[a-z],)?(--[a-z][a-z0-9-]*)");
  return {options.begin(), options.end()};
}

/// Returns the options named in a piece of code, such as `--gate mean_mm=0.2` or
/// `vlp-locate FOLDER --captures`, without those of programs that follow.
std::vector<std::string> named_options(const std::string& code) {
  return matches(code, "(?:^|[ |])(--[a-z][a-z0-9-]*)");
}

TEST(DocumentationPages, NamedOptionsExistInHelpOfTheirPrograms) {
  std::set<std::string> names;
  std::map<std::string, std::set<std::string>> options;
  for (const std::string& name : program_names()) {
    names.insert(name);
    options[name] = listed_options(help_with_subcommands(name));
    ASSERT_THAT(options[name], testing::Contains("--help")) << name;
  }
  ASSERT_THAT(options["vlp-station"], testing::Contains("--camera-id")) << "of a subcommand";
  std::size_t checked = 0;
  for (const fs::path& page : pages()) {
    if (page.parent_path() != kSource / "apps" || page.stem() == "MESSAGES") continue;
    const std::string prose = std::regex_replace(read_prose(page), std::regex("\n"), " ");
    for (const std::string& code : matches(prose, "`([^`]+)`")) {
      // On a program's page an option alone is its own; elsewhere only those with a program count.
      const std::string first = code.substr(0, code.find(' '));
      const std::string program = code.starts_with("--") ? page.stem().string() : first;
      if (!names.contains(program)) continue;
      for (const std::string& option : named_options(code)) {
        ++checked;
        EXPECT_THAT(options[program], testing::Contains(option))
            << name_of_page(page) << ": " << program << ": `" << code << "`";
      }
    }
  }
  EXPECT_GT(checked, 50U);
}

/// Each metric has one row in "Choosing gates", marked if its gate is a minimum or not of the
/// camera.
TEST(DocumentationPages, ChoosingGatesPageHasOneRowForEachMetric) {
  std::vector<std::string> defined, kinds;
  for (const std::string& line : lines_in(kSource / "apps/choosing-gates.md")) {
    if (!line.starts_with("| `")) continue;
    const std::string cell = line.substr(0, line.find(" | "));
    const bool at_least = cell.find("\u2265") != std::string::npos;
    const bool of_camera = cell.find("\u2020") == std::string::npos;
    for (const std::string& name : matches(cell, "`([a-z0-9_]+)`")) {
      defined.push_back(name);
      const auto kind = find_metric_kind(name);
      ASSERT_TRUE(kind) << name;
      EXPECT_EQ(kind->direction == Direction::at_least, at_least) << name;
      EXPECT_EQ(kind->is_camera_property, of_camera) << name;
    }
  }
  for (const MetricKind& kind : list_metric_kinds(
           {MetricSource::station, MetricSource::lens, MetricSource::rotation,
            MetricSource::dispersion, MetricSource::evaluation, MetricSource::reference})) {
    kinds.emplace_back(kind.name);
  }
  EXPECT_THAT(defined, testing::UnorderedElementsAreArray(kinds));
}

TEST(DocumentationPages, ReadmeHasAtMost6000Bytes) {
  EXPECT_LE(fs::file_size(kSource / "README.md"), 6000U);
}

TEST(DocumentationPages, CellsOfFormatsHaveAtMost40Words) {
  std::size_t cells = 0;
  for (const std::string& line : lines_in(kSource / "datasets/README.md")) {
    if (!line.starts_with("|")) continue;
    for (const std::string& cell : matches(line, "((?:[^|\\\\]|\\\\.)+)")) {
      ++cells;
      EXPECT_LE(matches(cell, "([^ ]+)").size(), 40U) << cell;
    }
  }
  EXPECT_GT(cells, 200U);
}

TEST(DocumentationPages, LinkedFilesAndSectionsExist) {
  std::size_t links = 0;
  for (const fs::path& page : pages()) {
    for (const std::string& link : matches(read_prose(page), "\\]\\(([^)\\s]+)\\)")) {
      if (link.starts_with("https://")) continue;
      ++links;
      const auto hash = std::min(link.find('#'), link.size());
      const fs::path target = hash == 0 ? page : page.parent_path() / link.substr(0, hash);
      EXPECT_TRUE(fs::exists(target)) << name_of_page(page) << ": " << link;
      if (hash == link.size() || !fs::exists(target)) continue;
      EXPECT_TRUE(has_anchor(target, link.substr(hash + 1))) << name_of_page(page) << ": " << link;
    }
  }
  EXPECT_GT(links, 100U);
}

TEST(DocumentationPages, NamedFilesAndFoldersExist) {
  // A file of source, with a folder, or anything in a folder of the tree; not with * or such.
  const char* path =
      "`([A-Za-z0-9_.-]+/[A-Za-z0-9_./-]*\\.(?:h|cpp|md|py|sh)"
      "|(?:apps|datasets|lib|scripts|tests)/[A-Za-z0-9_./-]*)[` ]";
  std::size_t paths = 0;
  for (const fs::path& page : pages()) {
    if (name_of_page(page) == "CHANGELOG.md") continue;  // of what has been
    for (const std::string& name : matches(read_prose(page), path)) {
      ++paths;
      EXPECT_TRUE(is_there(page, name)) << name_of_page(page) << ": " << name;
    }
  }
  EXPECT_GT(paths, 50U);
}

/// Question of users of calibration and positioning tools, with the section of the pages that
/// answers it and the words of the answer.
struct Question {
  const char *asked, *page, *section, *words;
};
constexpr Question kQuestions[] = {
    {"What is VLP?", "README.md", "VLP: positions from light", "visible light positioning"},
    {"How do I try it with real images?", "apps/TUTORIAL.md", "1. Get the recordings",
     "scripts/fetch_recordings.sh"},
    {"May I use it in a product?", "README.md", "Read on", "Apache-2.0"},
    {"How do I install and remove it?", "apps/README.md", "Install", "apt purge"},
    {"Does it run on Ubuntu, or in Docker?", "apps/README.md", "Install", "Ubuntu and other"},
    {"Which camera do I need?", "apps/ROOM.md", "Camera and exposure", "rolling shutter"},
    {"Which exposure?", "apps/ROOM.md", "Camera and exposure", "0.05 ms"},
    {"Which frequencies have the lamps?", "apps/ROOM.md", "Lamps", "> 1425 Hz"},
    {"How do I survey lamps?", "apps/ROOM.md", "Map of the lamps", "By tape"},
    {"At which scale is a board printed?", "apps/ROOM.md", "Board", "at 100 %"},
    {"How many images of it?", "apps/ROOM.md", "Board", "36 images"},
    {"I have no turntable.", "apps/ROOM.md", "Turn on the spot", "By hand"},
    {"What goes into a session's folder?", "apps/ROOM.md", "The folder", "gates.yaml"},
    {"I have a Kalibr board.", "apps/vlp-intrinsics.md", "vlp-intrinsics", "Kalibr AprilGrid"},
    {"I have a fisheye lens.", "apps/vlp-intrinsics.md", "Lens models", "OPENCV_FISHEYE"},
    {"I have a calibration from ROS.", "apps/vlp-convert.md", "vlp-convert", "--to ros"},
    {"I do not know the row time.", "apps/vlp-train.md", "Row time", "--row-time"},
    {"Which errors do newcomers meet first?", "apps/MESSAGES.md", "First errors", "mkdir -p"},
    {"Why is no lamp found?", "apps/MESSAGES.md", "Lamps in images", "wrong row time"},
    {"Why is there no fix?", "apps/MESSAGES.md", "Fixes", "Hang more lamps"},
    {"My lamp map is not exact.", "apps/vlp-adjust.md", "vlp-adjust", "--refine-map"},
    {"Does it work while driving, or in a hand?", "apps/vlp-locate.md", "Inclination and motion",
     "hand-held camera"},
    {"What do exit codes mean?", "apps/README.md", "Conventions", "Exit code 0: done"},
    {"What is in fixes.csv?", "datasets/README.md", "Fixes", "yaw_sd_rad"},
    {"Where is pixel (0, 0), and how is yaw counted?", "datasets/README.md", "Formats",
     "counter-clockwise"},
    {"How do I read session.json?", "datasets/README.md", "Documents of JSON",
     "session.schema.json"},
    {"How accurate is it?", "tests/ACCURACY.md", "Limits", ""},
    {"Which is the equation of a fix?", "lib/THEORY.md", "The positioning equation", ""},
    {"In which order is the covariance?", "lib/README.md", "On a robot", "x, y, z, roll, pitch"},
    {"How do I use it from Rust, C or ROS 2?", "lib/README.md", "On a robot", "C++17, Rust"},
    {"May several threads use it?", "lib/README.md", "On a robot", "any number of threads"},
    {"How do I call it from Python?", "apps/README.md", "Python", "import vlp"},
    {"What do FAIL and INVALID mean?", "apps/vlp-station.md", "Verdicts", "| INVALID | 3 |"},
    {"How do I guard an accuracy in a CI?", "apps/ci.md", "Accuracy checks in CI",
     "scripts/ci/action.yml"},
    {"How do I set up a station for a new product?", "apps/new-product.md",
     "A new product at the station", "Golden unit"},
    {"Which limits do I set?", "apps/choosing-gates.md", "Gates of a station", "1.67 and 3"},
    {"What is a line delay?", "apps/GLOSSARY.md", "Glossary", "row time"},
    {"How do I run an archive on a cluster?", "scripts/reprocess/README.md", "How it runs",
     "sbatch"},
};

/// The text under a heading, down to the next, as one line.
std::string read_section(const fs::path& page, const std::string& heading) {
  std::string text;
  bool inside = false;
  for (const std::string& line : lines_in(page)) {
    const auto begin = line.find_first_not_of('#');
    if (line.starts_with('#') && begin < line.size() && line[begin] == ' ') {
      inside = line.substr(begin + 1) == heading;
    } else if (inside) {
      text += " " + line;
    }
  }
  return std::regex_replace(text, std::regex(" +"), " ");
}

TEST(DocumentationPages, AnswersToUserQuestionsAreWithinTwoLinksOfReadme) {
  std::set<std::string> reached{"README.md"};
  for (int click = 0; click < 2; ++click) {
    for (const std::string& page : std::set(reached)) {
      for (const std::string& link :
           matches(read_prose(kSource / page), "\\]\\(([^)#\\s]+\\.md)")) {
        reached.insert((fs::path(page).parent_path() / link).lexically_normal().string());
      }
    }
  }
  for (const auto& [asked, page, section, words] : kQuestions) {
    EXPECT_TRUE(reached.contains(page)) << asked << " " << page;
    const std::string text = read_section(kSource / page, section);
    EXPECT_NE(text, "") << asked;
    EXPECT_THAT(text, testing::HasSubstr(words)) << asked;
  }
}

TEST(DocumentationPages, EachSourceThatWritesJsonIsNamedInSchema) {
  std::set<std::string> writers, have_schemas;
  for (const fs::path& file : find_files({".cpp", ".h", ".py", ".sh"})) {
    const std::string name = name_of_page(file);
    if (name.starts_with("tests/") || name.ends_with("/files.py")) continue;  // json_text() itself
    const std::string text = TemporaryFolder::read_content(file);
    const std::regex writes("\\.dump\\(|json_text\\(|json\\.dumps?\\(");
    if (std::regex_search(text, writes)) writers.insert(name);
  }
  const std::string page = read_prose(kSource / "datasets/README.md");
  for (const auto& schema : fs::directory_iterator(kSource / "datasets/schemas")) {
    const std::string text = TemporaryFolder::read_content(schema.path());
    EXPECT_THAT(page, testing::HasSubstr("(schemas/" + schema.path().filename().string() + ")"));
    const auto line = matches(text, "\"\\$comment\": \"(written by [^\"]+)\"");
    ASSERT_EQ(line.size(), 1U) << schema.path();
    for (const std::string& writer : matches(line[0], "(?:by|and) ([^ ]+)")) {
      have_schemas.insert(writer);
    }
    // additionalProperties: false or what they are, of each object.
    EXPECT_EQ(matches(text, "(\"type\": (?:\"object\"|\\[\"object\"))").size(),
              matches(text, "(\"additionalProperties\": [f{])").size())
        << schema.path();
  }
  EXPECT_EQ(writers, have_schemas);
}

/// Returns the names of tests in the sources, such as "Suite.Name", and those of CMake.
std::vector<std::string> test_names() {
  std::vector<std::string> names;
  for (const fs::path& file : find_files({".cpp", ".txt"})) {
    if (!name_of_page(file).starts_with("tests/")) continue;
    const std::string text = TemporaryFolder::read_content(file);
    const std::regex test(
        "\\b(?:TEST(?:_F|_P)?\\(\\s*(\\w+),\\s*(\\w+)\\)|add_test\\(NAME ([\\w.]+))");
    for (std::sregex_iterator at(text.begin(), text.end(), test), end; at != end; ++at) {
      names.push_back((*at)[3].matched ? (*at)[3].str() : (*at)[1].str() + "." + (*at)[2].str());
    }
  }
  return names;
}

bool has_test(const std::vector<std::string>& names, const std::string& expression) {
  const std::regex wanted(expression);
  return std::ranges::any_of(
      names, [&](const std::string& name) { return std::regex_search(name, wanted); });
}

/// Commands of a page in code, such as those of cells "repeat with": their programs, scripts and
/// tests exist. Tests of their programs run the commands that take seconds.
TEST(DocumentationPages, NamedTestsAndBenchmarksExist) {
  const std::vector<std::string> names = test_names();
  ASSERT_GT(names.size(), 1500U);
  std::string benchmarks;
  for (const fs::path& file : find_files({".txt"})) {
    if (name_of_page(file).starts_with("tests/")) {
      benchmarks += TemporaryFolder::read_content(file);
    }
  }
  std::size_t commands = 0;
  for (const fs::path& page : pages()) {
    const std::string prose = std::regex_replace(read_prose(page), std::regex("\n"), " ");
    for (const std::string& name : matches(prose, "build/tests/benchmarks/([a-z_]+)")) {
      ++commands;
      EXPECT_TRUE(fs::exists(kSource / "tests/benchmarks" / (name + ".cpp")) ||
                  benchmarks.find(name) != std::string::npos)
          << name_of_page(page) << ": " << name;
    }
    for (const std::string& name :
         matches(prose, "[`& ]((?:tests|scripts)/[a-z_/]+\\.(?:py|sh))")) {
      ++commands;
      EXPECT_TRUE(fs::exists(kSource / name)) << name_of_page(page) << ": " << name;
    }
    for (const std::string& test : matches(prose, "ctest [^`]*-R ('[^']+'|[^ `]+)")) {
      ++commands;
      const std::string expression = test.front() == '\'' ? test.substr(1, test.size() - 2) : test;
      EXPECT_TRUE(has_test(names, expression)) << name_of_page(page) << ": " << test;
    }
    for (std::string filter : matches(prose, "--gtest_filter='?([A-Za-z0-9*._]+)")) {
      ++commands;
      filter = std::regex_replace(filter, std::regex("\\."), "\\.");
      filter = std::regex_replace(filter, std::regex("\\*"), ".*");
      EXPECT_TRUE(has_test(names, filter)) << name_of_page(page) << ": " << filter;
    }
  }
  EXPECT_GT(commands, 60U);
}

/// Cells "repeat with" have complete commands, so that they can be typed.
TEST(DocumentationPages, RepeatWithCellsBeginWithCommands) {
  const std::regex command(
      "^`(?:[A-Z_]+=[^ ]+ )*"
      "(?:ctest --test-dir build -R |build/(?:bin|tests)/|tests/|scripts/|for )");
  const auto cells = repeat_with_cells(kSource / "tests/ACCURACY.md");
  EXPECT_GT(cells.size(), 40U);
  for (const std::string& cell : cells) EXPECT_TRUE(std::regex_search(cell, command)) << cell;
}

TEST(DocumentationPages, SectionsOfTheoryCitedInSourcesExist) {
  const auto headings = find_headings(kSource / "lib/THEORY.md");
  std::size_t citations = 0;
  for (const fs::path& file : find_files({".h", ".cpp"})) {
    std::string text = TemporaryFolder::read_content(file);
    text = std::regex_replace(text, std::regex("\n */// ?"), " ");
    for (const std::string& heading : matches(text, "lib/THEORY\\.md, \"([^\"]+)\"")) {
      ++citations;
      EXPECT_THAT(headings, testing::Contains(heading)) << file;
    }
  }
  EXPECT_GE(citations, 7U);
}

}  // namespace
}  // namespace vlp
