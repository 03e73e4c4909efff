// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/file_mode.h"

#include <unistd.h>

namespace vlp {

bool keep_mode_and_owner(int descriptor, const struct stat& former) {
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
