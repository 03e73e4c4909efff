// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Checks of the pages of the tree (*.md): commands run as typed, links and paths have targets, and
/// the explained messages are those of the programs.
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <vector>

#include "evaluation/metric.h"
#include "support/program.h"
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

/// The indented command lines that begin with one of our programs or cp, joined where a backslash
/// says so.
std::vector<std::string> commands_in(const fs::path& page) {
  std::vector<std::string> commands;
  bool continues = false;
  for (const std::string& line : lines_in(page)) {
    if (continues) {
      commands.back() += line;
    } else if (line.starts_with("    build/bin/vlp-") || line.starts_with("    vlp-") ||
               line.starts_with("    cp ")) {
      commands.push_back(line.substr(4));
    } else {
      continue;
    }
    continues = line.ends_with('\\');
    if (continues) commands.back().pop_back();
  }
  return commands;
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

TEST(DocumentationPages, CommandsRunAsTyped) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "hundreds of images; the programs' own tests run under the sanitizers";
#endif
  const TemporaryFolder folder;
  fs::create_directories(folder / "build");
  fs::create_directories(folder / "out");
  fs::create_directory_symlink(VLP_PROGRAMS_DIR, folder / "build/bin");
  for (const char* name : {"datasets", "scripts"}) {
    fs::create_directory_symlink(kSource / name, folder / name);
  }
  std::set<std::string> ran, programs;
  for (const fs::path& page : pages_in_reading_order()) {
    for (const std::string& command : commands_in(page)) {
      if (!ran.insert(command).second) continue;
      const auto result = run_program("cd '" + (folder / "").string() + "' && " + command);
      EXPECT_EQ(result.exit_code, 0) << name_of_page(page) << ": " << command << "\n"
                                     << result.errors;
      programs.insert(command.substr(0, command.find(' ')));
    }
  }
  for (const auto& program : fs::directory_iterator(VLP_PROGRAMS_DIR)) {
    const std::string name = program.path().filename().string();
    EXPECT_TRUE(programs.contains("build/bin/" + name)) << name << " is shown by no page";
  }
  expect_formats_to_name_columns(folder / "out");
}

/// Names of the programs, such as "vlp-locate".
std::vector<std::string> program_names() {
  std::vector<std::string> names;
  for (const auto& program : fs::directory_iterator(VLP_PROGRAMS_DIR)) {
    names.push_back(program.path().filename().string());
  }
  return names;
}

TEST(DocumentationPages, ExistForEachProgram) {
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

TEST(DocumentationPages, NameOptionsOfTheirPrograms) {
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
  EXPECT_GT(checked, 60U);
}

TEST(DocumentationPages, NamedOptionsAreFoundInCode) {
  EXPECT_THAT(named_options("vlp-locate FOLDER --camera-on-robot"),
              testing::ElementsAre("--camera-on-robot"));
  EXPECT_THAT(named_options("--gate missing_fraction=0 --json=out/no--option.json"),
              testing::ElementsAre("--gate", "--json"));
  EXPECT_THAT(listed_options("\n  -o,--output TEXT\n  --row-time-s FLOAT\n      as --other\n"),
              testing::ElementsAre("--output", "--row-time-s"));
}

/// Each metric has one row in "Choosing gates", marked if its gate is a minimum or not of the
/// camera.
TEST(DocumentationPages, DefineEachMetricOnce) {
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
      EXPECT_EQ(kind->of_camera, of_camera) << name;
    }
  }
  for (const MetricKind& kind : list_metric_kinds(
           {MetricSource::station, MetricSource::lens, MetricSource::rotation,
            MetricSource::dispersion, MetricSource::evaluation, MetricSource::reference})) {
    kinds.emplace_back(kind.name);
  }
  EXPECT_THAT(defined, testing::UnorderedElementsAreArray(kinds));
}

TEST(DocumentationPages, ReadmeFitsOnOnePage) {
  EXPECT_LE(fs::file_size(kSource / "README.md"), 6000U);
}

TEST(DocumentationPages, LinksHaveTargets) {
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

TEST(DocumentationPages, NameExistingPaths) {
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
    {"Why is no lamp found?", "apps/MESSAGES.md", "Lamps in images", "wrong row time"},
    {"Why is there no fix?", "apps/MESSAGES.md", "Fixes", "Hang more lamps"},
    {"My lamp map is not exact.", "apps/vlp-adjust.md", "vlp-adjust", "--refine-map"},
    {"Does it work while driving, or in a hand?", "apps/vlp-locate.md", "Inclination and motion",
     "hand-held camera"},
    {"What do exit codes mean?", "apps/README.md", "Conventions", "Exit code 0: done"},
    {"What is in fixes.csv?", "datasets/README.md", "Formats", "yaw_sd_rad"},
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

TEST(DocumentationPages, AnswerQuestionsWithinTwoClicks) {
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

TEST(DocumentationPages, EachJsonDocumentHasSchema) {
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

TEST(DocumentationPages, NamedTestsAndBenchmarksExist) {
  std::string tests;
  for (const fs::path& file : find_files({".cpp", ".txt", ".sh"})) {
    if (name_of_page(file).starts_with("tests/")) tests += TemporaryFolder::read_content(file);
  }
  std::size_t programs = 0;
  for (const fs::path& page : pages()) {
    const std::string prose = read_prose(page);
    for (const std::string& name : matches(prose, "build/tests/benchmarks/([a-z_]+)")) {
      ++programs;
      EXPECT_TRUE(fs::exists(kSource / "tests/benchmarks" / (name + ".cpp")) ||
                  tests.find(name) != std::string::npos)
          << name_of_page(page) << ": " << name;
    }
    for (const std::string& suite : matches(prose, "ctest [^`]*-R ([A-Za-z]+)")) {
      EXPECT_NE(tests.find(suite), std::string::npos) << name_of_page(page) << ": " << suite;
    }
  }
  EXPECT_GT(programs, 5U);
}

TEST(DocumentationPages, TheoryHasCitedSections) {
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

/// A literal of a source, those that stand side by side as one, and where its statement begins.
struct Literal {
  std::string text;
  std::size_t statement;
};

/// In their order. What is no literal stands in `code`, with the literals empty.
std::vector<Literal> find_literals(const std::string& source, std::string& code) {
  std::vector<Literal> literals;
  std::size_t statement = 0;
  bool joins = false;  // nothing but blanks since the literal before
  for (std::size_t i = 0; i < source.size(); ++i) {
    const char letter = source[i];
    if (letter == '/' && source.compare(i, 2, "//") == 0) {
      i = std::min(source.find('\n', i), source.size());
      code += '\n';
    } else if (letter == '\'' && source.size() > i + 3 &&
               (source[i + 2] == '\'' || source[i + 1] == '\\')) {
      i = source.find('\'', i + 2);
      joins = false;
    } else if (letter == '"') {
      const std::size_t begin = i + 1;
      for (++i; source[i] != '"'; ++i) {
        if (source[i] == '\\') ++i;
      }
      const std::string text = source.substr(begin, i - begin);
      if (joins) {
        literals.back().text += text;
      } else {
        literals.push_back({text, statement});
      }
      joins = true;
    } else {
      code += letter;
      if (std::isspace(static_cast<unsigned char>(letter)) == 0) joins = false;
      const bool ends_block = (letter == '{' || letter == '}') && source[i + 1] == '\n';
      if (letter == ';' || ends_block) statement = code.size();
    }
    if (joins && !literals.empty() && literals.back().statement != statement) joins = false;
  }
  return literals;
}

std::size_t words_in(const std::string& text) {
  return matches(std::regex_replace(text, std::regex("[.]{3}"), " "), "([^ ]+)").size();
}

/// Returns the messages of a source about errors and doubts: literals in statements that throw,
/// fail or warn, and, in the library below programs, questions and advice. Values between the
/// literals of a message are "...".
std::vector<std::string> messages_in(const fs::path& file) {
  static const std::regex tells(
      "\\bthrow\\b|\\bfail\\(|\\berror\\(|\\bwarn\\(|\\bwarnings\\b|Error\\(");
  static const std::regex asks("\\?( [A-Z]| ?$)|\\badd\\b|[:;] take ");
  static const std::regex goes_on("^[ ,;:'?)]");
  const std::string name = name_of_page(file);
  const bool of_library = name.starts_with("lib/") && !name.starts_with("lib/program/");
  std::string code;
  std::vector<std::string> messages;
  std::size_t last = std::string::npos;
  for (const Literal& literal : find_literals(TemporaryFolder::read_content(file), code)) {
    const auto end = std::min(code.find_first_of(";", literal.statement), code.size());
    const std::string statement = code.substr(literal.statement, end - literal.statement);
    if (!std::regex_search(statement, tells) &&
        !(of_library && std::regex_search(literal.text, asks))) {
      continue;
    }
    if (last == literal.statement && std::regex_search(literal.text, goes_on)) {
      messages.back() += "..." + literal.text;
    } else {
      messages.push_back(literal.text);
    }
    last = literal.statement;
  }
  std::erase_if(messages, [](const std::string& message) { return words_in(message) < 3; });
  return messages;
}

/// The scripts of reprocessing, which are programs, too.
std::vector<fs::path> scripts_of_programs() {
  auto files = find_files({".py", ".sh"});
  std::erase_if(files, [](const fs::path& file) {
    return !name_of_page(file).starts_with("scripts/reprocess");
  });
  return files;
}

/// Returns the error messages of a script: the literals of lines that print an error in its name.
/// Values are "...".
std::vector<std::string> messages_in_script(const fs::path& file) {
  static const std::regex tells("\\b(refuse|usage|fail)\\b|ValueError\\(|reprocess\\.sh: |>&2");
  static const std::regex python_value("\\{\\{|\\}\\}|\\{[^{}]*\\}");
  static const std::regex shell_value("\\$\\{[^}]*\\}|\\$[a-z0-9_]+");
  const bool python = file.extension() == ".py";
  std::vector<std::string> messages;
  for (const std::string& line : lines_in(file)) {
    if (!std::regex_search(line, tells)) continue;
    const std::string words = std::regex_replace(line, python ? python_value : shell_value, "...");
    for (std::string& message : matches(words, "\"([^\"]+)\""))
      messages.push_back(std::move(message));
  }
  std::erase_if(messages, [](const std::string& message) { return words_in(message) < 3; });
  return messages;
}

/// Returns true if the parts of a message, separated by "...", occur in their order.
bool is_said_in(const std::string& text, const std::string& message) {
  std::size_t at = 0;
  for (std::size_t begin = 0; begin <= message.size();) {
    const auto end = std::min(message.find("...", begin), message.size());
    const std::string part = message.substr(begin, end - begin);
    at = text.find(part, at);
    if (at == std::string::npos) return false;
    at += part.size();
    begin = end + 3;
  }
  return true;
}

/// Those of the first column of apps/MESSAGES.md.
std::vector<std::string> explained_messages() {
  std::vector<std::string> messages;
  for (const std::string& line : lines_in(kSource / "apps/MESSAGES.md")) {
    if (!line.starts_with("| `")) continue;
    for (auto& message : matches(line.substr(0, line.find(" | ")), "`([^`]+)`")) {
      messages.push_back(std::move(message));
    }
  }
  return messages;
}

/// Parts of messages that need no entry in apps/MESSAGES.md, because they state what is allowed or
/// missing, or because the cause implies the remedy. Separated by '|'.
const std::string kClearParts =
    "'@' is %40|a quote |alarms, the last|along rows or columns|and {} more|"
    "another run is at work|are missing| are: |at odd addresses|"
    "boards with corner squares|built with pybind11|calibration's camera has|camera.yaml takes "
    "precedence|"
    "cannot be computed|cannot be deleted|cannot be drawn|cannot be encoded|"
    "do not fit on|do not have it|does not fit on|effect of print_sd|estimates both|"
    "gate '|"
    "gives no frame|barely visible|has a frequency_hz|has neither|has no |"
    "has two different values|have to be equal|contains no|"
    "is a board of squares|is a folder|is a link|is a pipe or a device|is a video|"
    "is also an input|is empty|is in the archive|is larger than|is missing|"
    "is named twice|is neither|is no folder|is not a |is not above|is not below|is not judged|"
    "is not known|is not valid YAML|is not within|is not YAML|is now called|"
    "is of a |is of no |is too old|is where lamp|lacks '|lacks a right|left out: |"
    "less than a row|may not void|more than|names no gate|needs|neither of ours|"
    "no calibration|no judged run|no line |no name of a file|"
    "no regular expression|no such status|no view is held out|none of the folders|"
    "not colSpacingMeters|not in the map|of letters, digits|of the golden unit|outside the room|"
    "parameters, not|run writes there|scene has |should|smaller than the square|can be stored "
    "neither|exit code of|"
    "occurs twice|stdin: a line|"
    "string of keywords|has four|the board's white|the brightest lamp|"
    "has moved: |there are no|there is no|too small for|rotation in place|"
    "two black bits|views with the board|wants a value|was not judged|"
    "weights go up to|of the drive are equal|without the other|works on this camera";

/// Returns true if a message asks a question that names the likely cause, or if it has the form
/// "<what is wrong>; <what to do>".
bool states_remedy(const std::string& message) {
  static const std::regex remedy(
      "\\?|(^|[;:,] )(or )?(add|begin|change|choose|clean|correct|empty|expose|fit|give|have|"
      "install|leave|lower|make|measure|move|name|remove|rename|restore|run|save|say|see|set|state|"
      "swap|take|train|turn|use|void)\\b");
  return std::regex_search(message, remedy);
}

std::vector<fs::path> sources_of_programs() {
  auto files = find_files({".cpp", ".h"});
  std::erase_if(files,
                [](const fs::path& file) { return name_of_page(file).starts_with("tests/"); });
  return files;
}

TEST(Messages, ExplainedOnesCanOccur) {
  std::vector<std::string> sources;  // the literals of each
  for (const fs::path& file : sources_of_programs()) {
    sources.emplace_back();
    std::string code;
    for (const Literal& literal : find_literals(TemporaryFolder::read_content(file), code)) {
      sources.back().append(literal.text).append("\n");
    }
  }
  for (const fs::path& file : scripts_of_programs()) {
    sources.push_back(TemporaryFolder::read_content(file));
  }
  const auto said = [&](const std::string& message) {
    return std::any_of(sources.begin(), sources.end(),
                       [&](const std::string& source) { return is_said_in(source, message); });
  };
  const auto messages = explained_messages();
  for (const std::string& message : messages) EXPECT_TRUE(said(message)) << message;
  EXPECT_GT(messages.size(), 100U);
  EXPECT_FALSE(said("no lamp has ... such a message"));
}

TEST(Messages, StateRemedyOrHaveEntry) {
  const auto explained = explained_messages();
  const auto clear = matches(kClearParts, "([^|]+)");
  std::set<std::string> unused(clear.begin(), clear.end());
  const auto expect_clear = [&](const fs::path& file, const auto& messages) {
    for (const std::string& message : messages) {
      const auto has = [&](const std::string& words) { return is_said_in(message, words); };
      const bool is_clear = std::any_of(clear.begin(), clear.end(), has);
      std::erase_if(unused, has);
      EXPECT_TRUE(is_clear || states_remedy(message) ||
                  std::any_of(explained.begin(), explained.end(), has))
          << name_of_page(file)
          << ": states no remedy, and apps/MESSAGES.md has no entry for: " << message;
    }
    return messages.size();
  };
  std::size_t messages = 0, of_scripts = 0;
  for (const fs::path& file : sources_of_programs()) {
    messages += expect_clear(file, messages_in(file));
  }
  for (const fs::path& file : scripts_of_programs()) {
    of_scripts += expect_clear(file, messages_in_script(file));
  }
  EXPECT_GT(messages, 350U);
  EXPECT_GT(of_scripts, 30U);
  EXPECT_THAT(unused, testing::IsEmpty()) << "parts of kClearParts that no message has";
}

TEST(Messages, RemediesAreFound) {
  EXPECT_TRUE(states_remedy("the captures span less than 90 degrees: add captures"));
  EXPECT_TRUE(states_remedy("there is no such camera: is it connected?"));
  EXPECT_FALSE(states_remedy("the address has been changed; nothing else"));
}

TEST(Messages, AreFoundInSources) {
  const TemporaryFolder folder;
  const auto file =
      folder.file("a.cpp",
                  "f(\"no message at all\");\n"
                  "throw InputError(file, \"lamp \" + id + \" is loose: \"\n"
                  "    \"fasten it\");  // \"not this one here\"\n"
                  "warnings.push_back(c == '\"' ? \"one or two words\" : \"two\");\n");
  EXPECT_THAT(messages_in(file),
              testing::ElementsAre("lamp ... is loose: fasten it", "one or two words"));
  const auto shell = folder.file(
      "a.sh", "refuse \"$file: is not ${what[0]} of ours\"\necho \"all is well there\"\n");
  EXPECT_THAT(messages_in_script(shell), testing::ElementsAre("...: is not ... of ours"));
  const auto python = folder.file(
      "a.py", "    fail(f\"{names[0]}: holds no {kind:s} here\")\nsay(\"all is well there\")\n");
  EXPECT_THAT(messages_in_script(python), testing::ElementsAre("...: holds no ... here"));
}

}  // namespace
}  // namespace vlp
