// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/shared_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr int kFolderFlags = O_RDONLY | O_DIRECTORY | O_CLOEXEC;
// [STATION-13] `is not followed` | link, pipe or device in `captures`, `results`, `spool` or
//   `.state`, where others can write | remove it
constexpr const char* kLink =
    "is a symbolic link, which is not followed in a folder that others can write to: remove it if "
    "it is not yours, otherwise use a bind mount";

/// Reports the system's reason, errno.
[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw InputError(file, what + ": " + std::generic_category().message(errno));
}

/// Returns the status of a file, or of a link itself; std::nullopt if it does not exist.
std::optional<struct stat> read_status(int folder, const std::string& name) {
  struct stat status {};
  if (::fstatat(folder, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) return std::nullopt;
  return status;
}

}  // namespace

SharedFolder::SharedFolder(const fs::path& path)
    : path_(path), descriptor_(::open(path.c_str(), kFolderFlags)) {
  if (descriptor_ < 0) fail(path_, "cannot be opened");
}

SharedFolder::SharedFolder(fs::path path, int descriptor)
    : path_(std::move(path)), descriptor_(descriptor) {}

SharedFolder::SharedFolder(SharedFolder&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

SharedFolder::~SharedFolder() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void SharedFolder::check_not_replaced() const {
  const auto present = read_status(AT_FDCWD, path_.string());
  struct stat opened {};
  if (present && ::fstat(descriptor_, &opened) == 0 && present->st_dev == opened.st_dev &&
      present->st_ino == opened.st_ino) {
    return;
  }
  throw InputError(path_, "was moved or replaced while it was in use: restore it, then run again");
}

fs::path SharedFolder::descriptor_path() const {
  return "/proc/self/fd/" + std::to_string(descriptor_);
}

fs::path SharedFolder::require_entry_path(const std::string& name) const {
  const bool is_one_part = !name.empty() && name != "." && name != ".." &&
                           name.find('/') == std::string::npos &&
                           name.find('\0') == std::string::npos;
  if (!is_one_part) throw InputError(path_, "'" + name + "' is no name of a file in it");
  return path_ / name;
}

std::optional<SharedFolder> SharedFolder::open_if_exists(const Id& name) const {
  fs::path path = path_ / name.id_text();
  const int found = ::openat(descriptor_, name.id_text().c_str(), kFolderFlags | O_NOFOLLOW);
  if (found >= 0) return SharedFolder(std::move(path), found);
  const int reason = errno;
  const auto status = read_status(descriptor_, name.id_text());
  if (!status) return std::nullopt;
  if (S_ISLNK(status->st_mode)) throw InputError(path, kLink);
  errno = reason;
  fail(path, "cannot be opened");
}

SharedFolder SharedFolder::open_or_create(const Id& name) const {
  constexpr mode_t mode = 0777;
  const int made = ::mkdirat(descriptor_, name.id_text().c_str(), mode);
  const int reason = errno;
  auto folder = open_if_exists(name);
  if (folder) return std::move(*folder);
  errno = made == 0 ? ENOENT : reason;
  fail(path_ / name.id_text(), "cannot be made");
}

bool SharedFolder::contains(const std::string& name) const {
  require_entry_path(name);
  return read_status(descriptor_, name).has_value();
}

int SharedFolder::open_regular_file(const std::string& name, int flags) const {
  const fs::path path = require_entry_path(name);
  constexpr mode_t mode = 0666;
  // Without waiting for the other end of a pipe.
  const int descriptor =
      ::openat(descriptor_, name.c_str(), flags | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, mode);
  if (descriptor < 0) {
    const int reason = errno;
    const auto there = read_status(descriptor_, name);
    if (there && S_ISLNK(there->st_mode)) throw InputError(path, kLink);
    // [STATION-13] `no regular file`
    if (there && S_ISFIFO(there->st_mode)) throw InputError(path, "is no regular file");
    errno = reason;
    return -1;
  }
  struct stat status {};
  if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode)) return descriptor;
  ::close(descriptor);
  throw InputError(path, "is no regular file");
}

std::optional<std::string> SharedFolder::read_if_exists(const std::string& name,
                                                        std::size_t max_bytes) const {
  const fs::path path = require_entry_path(name);
  const int descriptor = open_regular_file(name, O_RDONLY);
  if (descriptor < 0) {
    if (errno == ENOENT) return std::nullopt;
    fail(path, "cannot be opened");
  }
  InputFile file(path, descriptor, max_bytes);
  return read_file(file);
}

void SharedFolder::replace_file(const std::string& name, std::string_view content) const {
  AtomicFileWriter file(descriptor_path(), name, require_entry_path(name));
  file.write(content);
  file.save_file();
}

bool SharedFolder::rename_file(const std::string& from, const std::string& to) const {
  const fs::path path = require_entry_path(from);
  require_entry_path(to);
  if (::renameat(descriptor_, from.c_str(), descriptor_, to.c_str()) == 0) return true;
  if (errno == ENOENT) return false;
  // [FILE-1] `cannot be renamed`, `cannot be removed`
  fail(path, "cannot be renamed");
}

void SharedFolder::remove_file(const std::string& name) const {
  const fs::path path = require_entry_path(name);
  if (::unlinkat(descriptor_, name.c_str(), 0) != 0 && errno != ENOENT) {
    fail(path, "cannot be removed");
  }
}

void SharedFolder::remove_subfolder(const Id& name) const {
  if (::unlinkat(descriptor_, name.id_text().c_str(), AT_REMOVEDIR) != 0) {
    fail(path_ / name.id_text(), "cannot be deleted");
  }
}

void SharedFolder::remove_all() const {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator entry(descriptor_path(), error);
       !error && entry != fs::directory_iterator(); entry.increment(error)) {
    entries.push_back(entry->path());
  }
  for (auto entry = entries.begin(); !error && entry != entries.end(); ++entry) {
    fs::remove_all(*entry, error);
  }
  if (error) throw InputError(path_, "cannot be deleted: " + error.message());
}

void check_json_limits(std::string_view text) {
  constexpr std::size_t max_levels = 16, max_values = 1'000'000;
  std::size_t levels = 0, values = 0;
  bool is_in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_string) {
      if (c == '\\') ++i;
      if (c == '"') is_in_string = false;
      continue;
    }
    if (c == '"') is_in_string = true;
    if (c == '[' || c == '{') ++levels;
    if ((c == ']' || c == '}') && levels > 0) --levels;
    if (c == '[' || c == '{' || c == ',') ++values;
    // [STATION-12] `it has more than`
    if (levels > max_levels) throw std::runtime_error("it has more than 16 levels");
    if (values > max_values) throw std::runtime_error("it has more than a million values");
  }
}

}  // namespace vlp
