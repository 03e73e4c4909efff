// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// What the pages of the tree (*.md) say holds: their commands work as typed, their links and paths
/// lead somewhere, the messages that they explain are those of the programs.
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = VLP_SOURCE_DIR;

/// Folders of the tree; others there, such as build and out, are nobody's but the user's.
constexpr const char* kFolders[] = {"apps", "datasets", "lib", "scripts", "tests"};

/// The files of the tree whose names end like this, in order; those at the top first.
std::vector<fs::path> files_of(const std::vector<std::string>& endings) {
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
std::vector<fs::path> pages() { return files_of({".md"}); }

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
    } else if (line.starts_with("    build/bin/vlp-") || line.starts_with("    cp ")) {
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
std::string prose_of(const fs::path& page) {
  std::string prose;
  bool code = false;
  for (const std::string& line : lines_in(page)) {
    if (line.starts_with("```")) code = !code;
    if (!code && !line.starts_with("    ")) prose.append(line).append("\n");
  }
  return prose;
}

/// What a pattern's first group matches.
std::vector<std::string> matches(const std::string& text, const char* pattern) {
  const std::regex expression(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), expression), end; at != end; ++at) {
    found.push_back((*at)[1]);
  }
  return found;
}

std::vector<std::string> headings_of(const fs::path& page) {
  std::vector<std::string> headings;
  for (const std::string& line : lines_in(page)) {
    const auto begin = line.find_first_not_of('#');
    if (line.starts_with('#') && line[begin] == ' ') headings.push_back(line.substr(begin + 1));
  }
  return headings;
}

/// As GitHub makes them: small letters, digits, '-' and '_', blanks as '-'.
std::string anchor_of(const std::string& heading) {
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
  const auto headings = headings_of(page);
  return std::any_of(headings.begin(), headings.end(),
                     [&](const std::string& heading) { return anchor_of(heading) == anchor; });
}

/// Whether a page may name this file so: from the top, from its own folder, or from lib.
bool is_there(const fs::path& page, const std::string& path) {
  const fs::path folders[] = {kSource, page.parent_path(), kSource / "lib"};
  return std::any_of(std::begin(folders), std::end(folders),
                     [&](const fs::path& folder) { return fs::exists(folder / path); });
}

TEST(Pages, CommandsWorkAsTyped) {
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
  for (const fs::path& page : pages()) {
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
}

TEST(Pages, HaveASectionForEachProgram) {
  const auto headings = headings_of(kSource / "apps/README.md");
  for (const auto& program : fs::directory_iterator(VLP_PROGRAMS_DIR)) {
    const std::string name = program.path().filename().string();
    EXPECT_THAT(headings, testing::Contains(name));
    EXPECT_THAT(prose_of(kSource / "README.md"), testing::HasSubstr("apps/README.md#" + name));
  }
}

TEST(Pages, ReadmeIsOfOnePage) { EXPECT_LE(fs::file_size(kSource / "README.md"), 6000U); }

TEST(Pages, LinksLeadSomewhere) {
  std::size_t links = 0;
  for (const fs::path& page : pages()) {
    for (const std::string& link : matches(prose_of(page), "\\]\\(([^)\\s]+)\\)")) {
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

TEST(Pages, PathsAreThere) {
  // A file of source, with a folder, or anything in a folder of the tree; not with * or such.
  const char* path =
      "`([A-Za-z0-9_.-]+/[A-Za-z0-9_./-]*\\.(?:h|cpp|md|py|sh)"
      "|(?:apps|datasets|lib|scripts|tests)/[A-Za-z0-9_./-]*)[` ]";
  std::size_t paths = 0;
  for (const fs::path& page : pages()) {
    if (name_of_page(page) == "CHANGELOG.md") continue;  // of what has been
    for (const std::string& name : matches(prose_of(page), path)) {
      ++paths;
      EXPECT_TRUE(is_there(page, name)) << name_of_page(page) << ": " << name;
    }
  }
  EXPECT_GT(paths, 50U);
}

TEST(Pages, TestsAndBenchmarksThatTheyNameAreThere) {
  std::string tests;
  for (const fs::path& file : files_of({".cpp", ".txt", ".sh"})) {
    if (name_of_page(file).starts_with("tests/")) tests += TemporaryFolder::content_of(file);
  }
  std::size_t programs = 0;
  for (const fs::path& page : pages()) {
    const std::string prose = prose_of(page);
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

TEST(Pages, TheoryHasWhatTheSourcesCite) {
  const auto headings = headings_of(kSource / "lib/THEORY.md");
  std::size_t citations = 0;
  for (const fs::path& file : files_of({".h", ".cpp"})) {
    std::string text = TemporaryFolder::content_of(file);
    text = std::regex_replace(text, std::regex("\n */// ?"), " ");
    for (const std::string& heading : matches(text, "lib/THEORY\\.md, \"([^\"]+)\"")) {
      ++citations;
      EXPECT_THAT(headings, testing::Contains(heading)) << file;
    }
  }
  EXPECT_GE(citations, 7U);
}

/// The literals of the programs and the library, those that stand side by side as one.
std::vector<std::string> sources_with_joined_literals() {
  std::vector<std::string> sources;
  for (const fs::path& file : files_of({".cpp", ".h"})) {
    if (name_of_page(file).starts_with("tests/")) continue;
    const std::string text = TemporaryFolder::content_of(file);
    std::string joined;
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool quote = text[i] == '"' && (i == 0 || text[i - 1] != '\\');
      const auto next = quote ? text.find_first_not_of(" \n", i + 1) : std::string::npos;
      if (next != std::string::npos && next > i + 1 && text[next] == '"') {
        i = next;
      } else {
        joined += text[i];
      }
    }
    sources.push_back(std::move(joined));
  }
  return sources;
}

/// Whether the parts of a message, "..." between them, stand in one file, in their order.
bool is_said_in(const std::string& source, const std::string& message) {
  std::size_t at = 0;
  for (std::size_t begin = 0; begin <= message.size();) {
    const auto end = std::min(message.find("...", begin), message.size());
    const std::string part = message.substr(begin, end - begin);
    at = source.find(part, at);
    if (at == std::string::npos) return false;
    at += part.size();
    begin = end + 3;
  }
  return true;
}

TEST(Pages, MessagesThatTheyExplainAreThose) {
  const auto sources = sources_with_joined_literals();
  const auto said = [&](const std::string& message) {
    return std::any_of(sources.begin(), sources.end(),
                       [&](const std::string& source) { return is_said_in(source, message); });
  };
  std::size_t messages = 0;
  for (const std::string& line : lines_in(kSource / "apps/MESSAGES.md")) {
    if (!line.starts_with("| `")) continue;
    const std::string message = line.substr(3, line.find('`', 3) - 3);
    ++messages;
    EXPECT_TRUE(said(message)) << message;
  }
  EXPECT_GT(messages, 40U);
  EXPECT_FALSE(said("no lamp has ... such a message"));
}

}  // namespace
}  // namespace vlp
