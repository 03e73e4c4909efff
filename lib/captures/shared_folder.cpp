// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/shared_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>
#include <vector>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr int kFolderFlags = O_RDONLY | O_DIRECTORY | O_CLOEXEC;
constexpr const char* kLink =
    "is a symbolic link, which is not followed in a folder that others can write to: remove it if "
    "it is not yours, else use a bind mount in its place";

/// Reports the system's reason, errno.
[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw InputError(file, what + ": " + std::generic_category().message(errno));
}

/// Descriptor that is closed when it goes out of scope.
class OpenFile {
 public:
  explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
  ~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Returns the status of a file, or of a link itself; std::nullopt if it does not exist.
std::optional<struct stat> read_status(int folder, const std::string& name) {
  struct stat status {};
  if (::fstatat(folder, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) return std::nullopt;
  return status;
}

void write_all(int descriptor, std::string_view content, const fs::path& file) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(file, "cannot be written");
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// Temporary file in the folder of the replaced one; removed unless it was renamed.
class TemporaryFile {
 public:
  TemporaryFile(int folder, const std::string& name) : folder_(folder) {
    constexpr std::size_t max_bytes = 200;  // of the 255 of a file name
    const std::string begin =
        "." + name.substr(0, max_bytes) + ".tmp-" + std::to_string(::getpid()) + "-";
    constexpr int flags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
    for (int number = 0;; ++number) {
      name_ = begin + std::to_string(number);
      descriptor_ = ::openat(folder, name_.c_str(), flags, 0666);
      if (descriptor_ >= 0 || errno != EEXIST) return;
    }
  }
  ~TemporaryFile() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    if (!is_renamed_) ::unlinkat(folder_, name_.c_str(), 0);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  int descriptor() const { return descriptor_; }
  bool rename_to(const std::string& name) {
    is_renamed_ = ::renameat(folder_, name_.c_str(), folder_, name.c_str()) == 0;
    return is_renamed_;
  }

 private:
  int folder_, descriptor_;
  std::string name_;
  bool is_renamed_ = false;
};

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

void SharedFolder::check_place() const {
  const auto present = read_status(AT_FDCWD, path_.string());
  struct stat opened {};
  if (present && ::fstat(descriptor_, &opened) == 0 && present->st_dev == opened.st_dev &&
      present->st_ino == opened.st_ino) {
    return;
  }
  throw InputError(path_, "was moved or replaced while it was in use: restore it, then run again");
}

fs::path SharedFolder::checked(const std::string& name) const {
  const bool is_one_part = !name.empty() && name != "." && name != ".." &&
                           name.find('/') == std::string::npos &&
                           name.find('\0') == std::string::npos;
  if (!is_one_part) throw InputError(path_, "'" + name + "' is no name of a file in it");
  return path_ / name;
}

std::optional<SharedFolder> SharedFolder::find_folder(const Id& name) const {
  fs::path path = path_ / name.text();
  const int found = ::openat(descriptor_, name.text().c_str(), kFolderFlags | O_NOFOLLOW);
  if (found >= 0) return SharedFolder(std::move(path), found);
  const int reason = errno;
  const auto status = read_status(descriptor_, name.text());
  if (!status) return std::nullopt;
  if (S_ISLNK(status->st_mode)) throw InputError(path, kLink);
  errno = reason;
  fail(path, "cannot be opened");
}

SharedFolder SharedFolder::make_folder(const Id& name) const {
  constexpr mode_t mode = 0777;
  const int made = ::mkdirat(descriptor_, name.text().c_str(), mode);
  const int reason = errno;
  auto folder = find_folder(name);
  if (folder) return std::move(*folder);
  errno = made == 0 ? ENOENT : reason;
  fail(path_ / name.text(), "cannot be made");
}

bool SharedFolder::has(const std::string& name) const {
  checked(name);
  return read_status(descriptor_, name).has_value();
}

int SharedFolder::open(const std::string& name, int flags) const {
  const fs::path path = checked(name);
  constexpr mode_t mode = 0666;
  // Without waiting for the other end of a pipe.
  const int descriptor =
      ::openat(descriptor_, name.c_str(), flags | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, mode);
  if (descriptor < 0) {
    const int reason = errno;
    const auto there = read_status(descriptor_, name);
    if (there && S_ISLNK(there->st_mode)) throw InputError(path, kLink);
    if (there && S_ISFIFO(there->st_mode)) throw InputError(path, "is no regular file");
    errno = reason;
    return -1;
  }
  struct stat status {};
  if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode)) return descriptor;
  ::close(descriptor);
  throw InputError(path, "is no regular file");
}

std::optional<std::string> SharedFolder::read(const std::string& name,
                                              std::size_t max_bytes) const {
  const fs::path path = checked(name);
  const OpenFile file(open(name, O_RDONLY));
  if (file.get() < 0) {
    if (errno == ENOENT) return std::nullopt;
    fail(path, "cannot be opened");
  }
  std::string content;
  struct stat status {};
  if (::fstat(file.get(), &status) == 0) {
    content.reserve(std::min(static_cast<std::size_t>(status.st_size), max_bytes) + 1);
  }
  constexpr std::size_t block_bytes = 1 << 16;
  for (std::array<char, block_bytes> block{};;) {
    const ssize_t count = ::read(file.get(), block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, "cannot be read");
    if (count == 0) return content;
    content.append(block.data(), static_cast<std::size_t>(count));
    if (content.size() > max_bytes) {
      constexpr int mebibyte_bits = 20;
      const std::size_t mebibytes = max_bytes >> mebibyte_bits;
      const std::string limit =
          mebibytes > 0 ? std::to_string(mebibytes) + " MiB" : std::to_string(max_bytes) + " bytes";
      throw InputError(path, "is longer than " + limit + ": is it the right file?");
    }
  }
}

void SharedFolder::replace(const std::string& name, std::string_view content) const {
  const fs::path path = checked(name);
  const auto former = read_status(descriptor_, name);
  TemporaryFile file(descriptor_, name);
  if (file.descriptor() < 0) fail(path, "cannot be written");
  if (former && S_ISREG(former->st_mode) && !keep_mode_and_owner(file.descriptor(), *former)) {
    fail(path, "cannot be written");
  }
  write_all(file.descriptor(), content, path);
  if (::fsync(file.descriptor()) != 0) fail(path, "cannot be written");
  if (!file.rename_to(name)) fail(path, "cannot be written");
  ::fsync(descriptor_);  // not every file system supports it; the file is complete in any case
}

bool SharedFolder::rename(const std::string& from, const std::string& to) const {
  const fs::path path = checked(from);
  checked(to);
  if (::renameat(descriptor_, from.c_str(), descriptor_, to.c_str()) == 0) return true;
  if (errno == ENOENT) return false;
  fail(path, "cannot be renamed");
}

void SharedFolder::remove(const std::string& name) const {
  const fs::path path = checked(name);
  if (::unlinkat(descriptor_, name.c_str(), 0) != 0 && errno != ENOENT) {
    fail(path, "cannot be removed");
  }
}

void SharedFolder::remove_folder(const Id& name) const {
  if (::unlinkat(descriptor_, name.text().c_str(), AT_REMOVEDIR) != 0) {
    fail(path_ / name.text(), "cannot be deleted");
  }
}

void SharedFolder::remove_content() const {
  // Uses the open folder, whose name may refer to another one by now.
  const fs::path open = "/proc/self/fd/" + std::to_string(descriptor_);
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator entry(open, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    entries.push_back(entry->path());
  }
  for (auto entry = entries.begin(); !error && entry != entries.end(); ++entry) {
    fs::remove_all(*entry, error);
  }
  if (error) throw InputError(path_, "cannot be deleted: " + error.message());
}

}  // namespace vlp
