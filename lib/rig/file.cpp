// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "rig/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>

#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Errors name the file that the user specified.
[[noreturn]] void throw_write_error(const fs::path& wanted) {
  // [FILE-1] `cannot be written`
  throw InputError(wanted, std::string("cannot be written: ") + std::strerror(errno));
}

/// Returns the target of a symbolic link, which need not exist. Stops at a link in `descriptors`,
/// the folder of this process' open descriptors, if it is given.
fs::path resolve_symbolic_links(fs::path path, const std::optional<fs::path>& descriptors) {
  std::error_code error;
  const fs::path wanted = path;
  for (int max_links = 40; fs::is_symlink(fs::symlink_status(path, error)); --max_links) {
    if (max_links == 0) throw InputError(wanted, "is a link that leads to itself");
    if (descriptors && fs::canonical(path.parent_path(), error) == *descriptors) break;
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  return path;
}

/// Path with symbolic links resolved.
struct Target {
  fs::path path;
  /// Descriptor of this process that the path names, as /dev/stdout does.
  std::optional<int> descriptor;
};

bool is_number(const fs::path& name) {
  return !name.empty() && std::ranges::all_of(name.native(), [](char character) {
    return character >= '0' && character <= '9';
  });
}

/// Returns true for the paths by which the system names the descriptors of a process. A link
/// elsewhere, such as in /dev/shm, may be of another user, and does not lead to a descriptor.
bool can_name_file_descriptor(const fs::path& path) {
  if (path == "/dev/stdin" || path == "/dev/stdout" || path == "/dev/stderr") return true;
  if (!is_number(path.filename())) return false;
  const fs::path folder = path.parent_path(), process = folder.parent_path();
  if (folder == "/dev/fd") return true;
  return folder.filename() == "fd" && process.parent_path() == "/proc" &&
         (process.filename() == "self" || is_number(process.filename()));
}

Target resolve_write_target(const fs::path& path) {
  std::error_code error;
  std::optional<fs::path> descriptors;
  if (can_name_file_descriptor(path)) descriptors = fs::canonical("/proc/self/fd", error);
  if (error) descriptors.reset();
  Target target{resolve_symbolic_links(path, descriptors), std::nullopt};
  if (!descriptors || !fs::is_symlink(fs::symlink_status(target.path, error))) return target;
  const std::string name = target.path.filename().string();
  int number = 0;
  std::from_chars(name.data(), name.data() + name.size(), number);  // the system names them
  target.descriptor = number;
  return target;
}

std::string describe_bytes(std::size_t bytes) {
  constexpr std::size_t mebibyte = std::size_t{1} << 20;
  return bytes < mebibyte ? std::to_string(bytes) + " bytes"
                          : std::to_string(bytes / mebibyte) + " MiB";
}

[[noreturn]] void throw_file_too_long(const fs::path& path, std::size_t max_bytes) {
  // [FILE-2] `is it the right file?` | other kind of file (line `format`), newer version, or above
  //   the [limits](security.md) | name the right file
  throw InputError(path, "is longer than " + describe_bytes(max_bytes) + ": is it the right file?");
}

/// Checks that an open file is a regular one, or the stream that `path` names, and returns its
/// size; 0 for a stream.
std::size_t check_file_kind(const fs::path& path, int descriptor, std::size_t max_bytes) {
  struct stat status {};
  // [FILE-1] `cannot be read` | system error, stated at the end | correct path or permission, free
  //   space
  if (::fstat(descriptor, &status) != 0) throw InputError(path, "cannot be read");
  if (S_ISDIR(status.st_mode)) throw InputError(path, "is a folder, not a file");
  if (!S_ISREG(status.st_mode)) {
    if (resolve_write_target(path).descriptor) return 0;
    throw InputError(path, "is a pipe or a device, not a file");
  }
  const auto bytes = static_cast<std::size_t>(status.st_size);
  if (bytes > max_bytes) throw_file_too_long(path, max_bytes);
  return bytes;
}

/// Locks an open file against other processes until it is closed. Returns false if it is locked or
/// was removed. A file system without locks counts as locked for `is_required`.
bool lock_file(int descriptor, const fs::path& path, bool is_required) {
  struct stat opened {
  }, present{};
  return (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 || (!is_required && errno != EWOULDBLOCK)) &&
         ::fstat(descriptor, &opened) == 0 && ::lstat(path.c_str(), &present) == 0 &&
         opened.st_dev == present.st_dev && opened.st_ino == present.st_ino;
}

/// Removes the temporary file of a killed process: its writer would hold the lock.
bool remove_abandoned_file(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool is_removed = lock_file(descriptor, path, true) && ::unlink(path.c_str()) == 0;
  ::close(descriptor);
  return is_removed;
}

/// Creates a file in the folder of `target` with a name that is unique among processes and threads,
/// and locks it.
int create_temporary(const fs::path& target, mode_t mode, fs::path& temporary) {
  constexpr std::size_t max_bytes = 200;  // of the 255 of a file name
  const std::string name = "." + target.filename().string().substr(0, max_bytes) + ".tmp-";
  for (int number = 0;; ++number) {
    temporary = target.parent_path() / (name + std::to_string(number));
    int descriptor = -1;
    do {
      descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
      if (descriptor < 0 && errno != EEXIST) return descriptor;
    } while (descriptor < 0 && remove_abandoned_file(temporary));
    if (descriptor < 0) continue;
    if (lock_file(descriptor, temporary, false)) return descriptor;
    ::close(descriptor);
  }
}

/// Creates the file that will replace `target`, with its permissions, and its owner and group as
/// far as the system allows. Until then only the owner can read it.
int create_replacement(const fs::path& target, fs::path& temporary) {
  constexpr mode_t as_user_set = 0666, private_to_owner = 0600;
  struct stat old {};
  if (::lstat(target.c_str(), &old) != 0 || !S_ISREG(old.st_mode)) {
    return create_temporary(target, as_user_set, temporary);
  }
  const int descriptor = create_temporary(target, private_to_owner, temporary);
  if (descriptor < 0) return descriptor;
  if (copy_owner(descriptor, old)) return descriptor;
  const int reason = errno;
  ::close(descriptor);
  ::unlink(temporary.c_str());
  errno = reason;
  return -1;
}

/// Makes a rename durable against a power failure. Not every file system supports this; the file is
/// complete in any case.
void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

bool is_special_file(const fs::path& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

bool is_control_character(char character) {
  const auto byte = static_cast<unsigned char>(character);
  return byte < 0x20 && byte != '\n' && byte != '\r' && byte != '\t';
}

/// Checks all characters without an early exit, which lets the compiler vectorize the loop.
bool has_control_characters(const std::string& text) {
  bool found = false;
  for (const char character : text) found |= is_control_character(character);
  return found;
}

}  // namespace

// Opening a pipe would wait for its writer without O_NONBLOCK; a stream's data are waited for.
InputFile::InputFile(const fs::path& path, std::size_t max_bytes)
    : InputFile(path, ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC),
                max_bytes) {}

InputFile::InputFile(const fs::path& path, int descriptor, std::size_t max_bytes)
    : path_(path), max_bytes_(max_bytes), descriptor_(descriptor) {
  if (descriptor_ < 0) {
    // [FILE-1] `cannot be opened`
    throw InputError(path, std::string("cannot be opened: ") + std::strerror(errno));
  }
  try {
    bytes_ = check_file_kind(path, descriptor_, max_bytes);
  } catch (const InputError&) {
    ::close(descriptor_);
    throw;
  }
  ::fcntl(descriptor_, F_SETFL, 0);
}

InputFile::~InputFile() { ::close(descriptor_); }

std::size_t InputFile::read(char* data, std::size_t bytes) {
  for (;;) {
    const ssize_t count = ::read(descriptor_, data, bytes);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw InputError(path_, std::string("cannot be read: ") + std::strerror(errno));
    read_bytes_ += static_cast<std::size_t>(count);
    if (read_bytes_ > max_bytes_) throw_file_too_long(path_, max_bytes_);
    return static_cast<std::size_t>(count);
  }
}

std::string read_file(const fs::path& path, std::size_t max_bytes) {
  InputFile file(path, max_bytes);
  return read_file(file);
}

std::string read_file(InputFile& file) {
  constexpr std::size_t block_bytes = 1 << 16;
  std::string content;
  content.reserve(file.file_size_bytes() + block_bytes);
  for (;;) {
    const std::size_t before = content.size();
    const std::size_t wanted =
        before < file.file_size_bytes() ? file.file_size_bytes() - before : block_bytes;
    content.resize(before + wanted);
    const std::size_t count = file.read(content.data() + before, wanted);
    content.resize(before + count);
    if (count == 0) return content;
  }
}

std::string read_text_file(const fs::path& path, std::size_t max_bytes) {
  std::string content = read_file(path, max_bytes);
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
                     "the last line has no end: is the file cut short? If it is complete, end it "
                     "with a newline");
  }
  return content;
}

AtomicFileWriter::AtomicFileWriter(const fs::path& path) : path_(path) {
  const Target target = resolve_write_target(path);
  if (target.descriptor) {
    descriptor_ = ::fcntl(*target.descriptor, F_DUPFD_CLOEXEC, 0);
  } else if (is_special_file(path)) {
    descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    target_ = target.path;
    descriptor_ = create_replacement(target_, temporary_);
  }
  if (descriptor_ < 0) {
    temporary_.clear();
    throw_write_error(path_);
  }
}

AtomicFileWriter::AtomicFileWriter(const fs::path& folder, const std::string& name,
                                   const fs::path& shown)
    : path_(shown), target_(folder / name), descriptor_(create_replacement(target_, temporary_)) {
  if (descriptor_ < 0) throw_write_error(path_);
}

void AtomicFileWriter::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_write_error(path_);
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

void AtomicFileWriter::save_file() {
  if (temporary_.empty()) return;
  if (::fsync(descriptor_) != 0) throw_write_error(path_);
  save_without_fsync();
  sync_folder(target_.has_parent_path() ? target_.parent_path() : ".");
}

void AtomicFileWriter::save_without_fsync() {
  if (temporary_.empty()) return;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) throw_write_error(path_);
  temporary_.clear();
}

AtomicFileWriter::~AtomicFileWriter() {
  ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void write_file(const fs::path& path, std::string_view content) {
  AtomicFileWriter file(path);
  file.write(content);
  file.save_file();
}

bool copy_owner(int descriptor, const struct stat& former) {
  constexpr auto same_owner = static_cast<uid_t>(-1);
  constexpr mode_t permissions = 0777, group_permissions = 0070;
  if (::fchown(descriptor, former.st_uid, former.st_gid) != 0) {
    [[maybe_unused]] const int kept = ::fchown(descriptor, same_owner, former.st_gid);
  }
  struct stat present {};
  if (::fstat(descriptor, &present) != 0) return false;
  // Another group must not get the permissions of the former one.
  const bool has_group = present.st_gid == former.st_gid;
  const mode_t mode = former.st_mode & permissions & (has_group ? permissions : ~group_permissions);
  // A file system without modes, such as FAT, refuses to set them.
  return (present.st_mode & permissions) == mode || ::fchmod(descriptor, mode) == 0;
}

}  // namespace vlp
