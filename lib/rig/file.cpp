// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Every failure names the file the user asked for.
[[noreturn]] void fail(const fs::path& wanted) {
  throw InputError(wanted, std::string("cannot be written: ") + std::strerror(errno));
}

/// Where a symbolic link leads, though nothing may be there yet.
fs::path without_links(fs::path path) {
  std::error_code error;
  const fs::path wanted = path;
  for (int most_links = 40; fs::is_symlink(fs::symlink_status(path, error)); --most_links) {
    if (most_links == 0) throw InputError(wanted, "is a link that leads to itself");
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  return path;
}

/// Opens a file with a name that nobody else has, not even another thread, beside `target`.
int create_beside(const fs::path& target, fs::path& temporary) {
  constexpr std::size_t most_bytes = 200;  // of the 255 of a file name
  const std::string name = "." + target.filename().string().substr(0, most_bytes) + ".tmp-" +
                           std::to_string(::getpid()) + "-";
  for (int number = 0;; ++number) {
    temporary = target.parent_path() / (name + std::to_string(number));
    const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
}

/// Makes a rename last through a power cut. Not every file system can; the file is whole anyway.
void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

bool is_special(const fs::path& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

bool is_control_character(char character) {
  const auto byte = static_cast<unsigned char>(character);
  return byte < 0x20 && byte != '\n' && byte != '\r' && byte != '\t';
}

/// Looks at all of it: without a way out of the loop the compiler takes many characters at a time.
bool has_control_characters(const std::string& text) {
  bool found = false;
  for (const char character : text) found |= is_control_character(character);
  return found;
}

}  // namespace

std::string read_text_file(const fs::path& path, std::size_t max_bytes) {
  std::error_code error;
  if (fs::is_directory(path, error)) throw InputError(path, "is a folder, not a file");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path, std::string("cannot be opened: ") + std::strerror(errno));
  std::string content;
  const auto bytes = fs::file_size(path, error);
  if (!error) content.reserve(std::min<std::size_t>(bytes, max_bytes) + 1);
  for (char block[65536]; stream.read(block, sizeof block), stream.gcount() > 0;) {
    content.append(block, static_cast<std::size_t>(stream.gcount()));
    if (content.size() > max_bytes) {
      throw InputError(path, "is longer than " + std::to_string(max_bytes >> 20) +
                                 " MiB: is it the right file?");
    }
  }
  if (stream.bad()) throw InputError(path, "cannot be read");
  if (content.empty()) throw InputError(path, "is empty");
  const auto line_at = [&](std::string::const_iterator end) {
    return static_cast<std::size_t>(std::count(content.cbegin(), end, '\n')) + 1;
  };
  if (has_control_characters(content)) {
    const auto first = std::find_if(content.cbegin(), content.cend(), is_control_character);
    throw InputError(path, line_at(first), "", "is not a text file");
  }
  if (content.back() != '\n') {
    throw InputError(path, line_at(content.cend()), "",
                     "the last line has no end: is the file cut short? "
                     "If it is whole, end it with a newline");
  }
  return content;
}

WholeFile::WholeFile(const fs::path& path) : path_(path) {
  if (is_special(path)) {
    descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    target_ = without_links(path);
    descriptor_ = create_beside(target_, temporary_);
  }
  if (descriptor_ < 0) {
    temporary_.clear();
    fail(path_);
  }
}

void WholeFile::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path_);
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

void WholeFile::save() {
  if (temporary_.empty()) return;
  if (::fsync(descriptor_) != 0) fail(path_);
  save_unsynced();
  sync_folder(target_.has_parent_path() ? target_.parent_path() : ".");
}

void WholeFile::save_unsynced() {
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(path_);
  temporary_.clear();
}

WholeFile::~WholeFile() {
  ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void write_file(const fs::path& path, std::string_view content) {
  WholeFile file(path);
  file.write(content);
  file.save();
}

}  // namespace vlp
