// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/gnuplot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// File descriptor that is closed at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int number() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

[[noreturn]] void fail_without_script(const fs::path& file) {
  throw InputError(file, std::string("cannot be drawn: gnuplot's script cannot be made: ") +
                             std::strerror(errno));
}

[[noreturn]] void fail_without_image(const fs::path& file) {
  throw InputError(file, "cannot be drawn: gnuplot failed; is it installed?");
}

/// Writes the script into memory that gnuplot reads as its stdin, which avoids a temporary file.
void write_script(const Descriptor& script, std::string_view text, const fs::path& file) {
  while (!text.empty()) {
    const ssize_t count = ::write(script.number(), text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_without_script(file);
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  ::lseek(script.number(), 0, SEEK_SET);
}

/// Starts gnuplot with these descriptors as stdin and stdout. Returns std::nullopt if it cannot be
/// started. The option -d skips ~/.gnuplot, which may run commands and change the plot. The script
/// is named as a file, because gnuplot reads stdin itself byte by byte.
std::optional<pid_t> start_gnuplot(int script, int output) {
  std::string words[] = {"gnuplot", "-d", "/dev/stdin"}, locale = "LC_ALL=C.UTF-8";
  std::array<char*, std::size(words) + 1> arguments{};
  std::ranges::transform(words, arguments.begin(), [](std::string& word) { return word.data(); });
  std::vector<char*> environment{locale.data()};
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (!std::string_view(*variable).starts_with("LC_ALL=")) environment.push_back(*variable);
  }
  environment.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, script, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  // Discards warnings of gnuplot, which concern only plots.
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t process = 0;
  const int failure = ::posix_spawnp(&process, arguments[0], &actions, nullptr, arguments.data(),
                                     environment.data());
  ::posix_spawn_file_actions_destroy(&actions);
  return failure == 0 ? std::optional(process) : std::nullopt;
}

std::string read_all_output(const Descriptor& pipe) {
  std::string content;
  char block[65536];
  for (;;) {
    const ssize_t count = ::read(pipe.number(), block, sizeof block);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return content;
    content.append(block, static_cast<std::size_t>(count));
  }
}

bool has_gnuplot_succeeded(pid_t process) {
  int status = 0;
  while (::waitpid(process, &status, 0) < 0) {
    if (errno != EINTR) return false;
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/// Returns the commands of a drawing for a gnuplot terminal.
std::string make_script(const std::string& terminal, const Drawing& drawing) {
  return "set terminal " + terminal + " size " + std::to_string(drawing.width_px) + "," +
         std::to_string(drawing.height_px) + "\n" + drawing.commands;
}

/// Runs a script and returns the output. `file` appears in messages only.
std::string run_gnuplot(const std::string& text, const fs::path& file) {
  const Descriptor script(::memfd_create("vlp-plot", MFD_CLOEXEC));
  int ends[2] = {-1, -1};
  if (script.number() < 0 || ::pipe2(ends, O_CLOEXEC) != 0) fail_without_script(file);
  const Descriptor output(ends[0]);
  Descriptor input(ends[1]);
  write_script(script, text, file);
  const auto process = start_gnuplot(script.number(), input.number());
  if (!process)
    throw InputError(file, "cannot be drawn: gnuplot cannot be started; is it installed?");
  input.close();  // leaves gnuplot's end as the only one
  std::string image = read_all_output(output);
  if (!has_gnuplot_succeeded(*process) || image.empty()) fail_without_image(file);
  return image;
}

/// Returns the SVG terminal. Two fallback fonts follow, for machines without the first.
std::string make_svg_terminal(const Drawing& drawing) {
  return "svg background 'white' name '" + drawing.name +
         "' font 'DejaVu Sans,Verdana,sans-serif,13'";
}

}  // namespace

void write_plot(const fs::path& file, const Drawing& drawing) {
  if (file.extension() == ".png") {
    write_file(file, run_gnuplot(make_script("pngcairo font 'DejaVu Sans,13'", drawing), file));
  } else if (file.extension() == ".svg") {
    write_file(file, run_gnuplot(make_script(make_svg_terminal(drawing), drawing), file));
  } else {
    throw InputError(file, "a picture's name should end in .png or .svg");
  }
}

std::vector<std::string> render_plots_as_svg(std::span<const Drawing> drawings) {
  constexpr std::string_view beginning = "<?xml";
  if (drawings.empty()) return {};
  std::string script, names;
  for (const Drawing& drawing : drawings) {
    script += "reset\n" + make_script(make_svg_terminal(drawing), drawing) + "\n";
    names += (names.empty() ? "" : ", ") + drawing.name;
  }
  const std::string output = run_gnuplot(script, names);
  std::vector<std::string> images;
  for (std::size_t begin = output.find(beginning); begin != std::string::npos;) {
    const std::size_t end = output.find(beginning, begin + 1);
    images.push_back(output.substr(begin, end - begin));
    begin = end;
  }
  if (images.size() != drawings.size()) fail_without_image(names);
  return images;
}

std::string render_plot_as_svg(const Drawing& drawing) {
  return render_plots_as_svg({&drawing, 1}).front();
}

}  // namespace vlp
