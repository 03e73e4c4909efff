// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace vlp {

/// The whole of a text file. Throws InputError when it cannot be read, is a folder, is empty, is
/// longer than `max_bytes`, holds control characters (a binary file), or when its last line has
/// no end: that is how a file cut short looks.
std::string read_text_file(const std::filesystem::path& path, std::size_t max_bytes);

/// Replaces `path` by `content` as a whole: a temporary file beside it, fsync, rename. Whatever
/// interrupts it, `path` holds the old content or the new. A symbolic link is followed; a pipe
/// or device is written to as it is. Throws InputError when it cannot be written. Killed, it may
/// leave its temporary file, ".NAME.tmp-PID-N", which nothing reads.
void write_file(const std::filesystem::path& path, std::string_view content);

}  // namespace vlp
