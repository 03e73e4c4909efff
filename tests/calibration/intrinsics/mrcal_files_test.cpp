// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/mrcal_files.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calibration/intrinsics/numpy_archive.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

std::uint32_t number_at(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = size; i-- > 0;) {
    value = value * 256 + static_cast<unsigned char>(bytes.at(at + i));
  }
  return value;
}

/// CRC-32 by division of the polynomials, bit by bit from the highest power.
std::uint32_t crc32_by_division(std::string_view bytes) {
  std::uint64_t remainder = 0xffffffffU;
  for (const char byte : bytes) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      const std::uint64_t next = static_cast<unsigned char>(byte) >> bit & 1U;
      const std::uint64_t top = (remainder >> 31 & 1U) ^ next;
      remainder = (remainder << 1 & 0xffffffffU) ^ (top != 0 ? 0x04c11db7U : 0U);
    }
  }
  std::uint32_t reversed = 0;
  for (unsigned bit = 0; bit < 32; ++bit) {
    reversed |= static_cast<std::uint32_t>(remainder >> bit & 1U) << (31 - bit);
  }
  return ~reversed;
}

struct Entry {
  std::string header, data;
};

/// Returns the entries of an archive by name, and checks all fields of its records.
std::map<std::string, Entry> read_archive(const std::string& bytes) {
  std::map<std::string, Entry> entries;
  const std::size_t end = bytes.size() - 22;
  EXPECT_EQ(bytes.substr(end, 4), "PK\x05\x06");
  EXPECT_EQ(number_at(bytes, end + 4, 4), 0U) << "numbers of disks";
  const std::uint32_t count = number_at(bytes, end + 8, 2);
  EXPECT_EQ(number_at(bytes, end + 10, 2), count);
  const std::size_t directory = number_at(bytes, end + 16, 4);
  EXPECT_EQ(directory + number_at(bytes, end + 12, 4), end);
  EXPECT_EQ(number_at(bytes, end + 20, 2), 0U) << "length of the comment";
  std::size_t at = directory, next_file = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    EXPECT_EQ(bytes.substr(at, 4), "PK\x01\x02");
    EXPECT_EQ(number_at(bytes, at + 4, 2), 20U) << "version of the writer";
    EXPECT_EQ(number_at(bytes, at + 32, 4), 0U) << "comment, disk";
    EXPECT_EQ(number_at(bytes, at + 36, 2), 0U) << "attributes";
    EXPECT_EQ(number_at(bytes, at + 38, 4), 0U) << "attributes";
    const std::size_t file = number_at(bytes, at + 42, 4), name_size = number_at(bytes, at + 28, 2);
    EXPECT_EQ(file, next_file);
    EXPECT_EQ(bytes.substr(file, 4), "PK\x03\x04");
    EXPECT_EQ(bytes.substr(file + 4, 26), bytes.substr(at + 6, 26)) << "common fields";
    EXPECT_EQ(number_at(bytes, file + 4, 2), 20U) << "version for readers";
    EXPECT_EQ(number_at(bytes, file + 6, 2), 0U) << "flags";
    EXPECT_EQ(number_at(bytes, file + 8, 2), 0U) << "not compressed";
    EXPECT_EQ(number_at(bytes, file + 10, 4), 0x210000U) << "first of January 1980";
    const std::size_t size = number_at(bytes, file + 18, 4);
    EXPECT_EQ(number_at(bytes, file + 22, 4), size);
    EXPECT_EQ(number_at(bytes, file + 28, 2), 0U) << "extra field";
    const std::string name = bytes.substr(file + 30, name_size);
    EXPECT_EQ(bytes.substr(at + 46, name_size), name);
    const std::string content = bytes.substr(file + 30 + name_size, size);
    EXPECT_EQ(number_at(bytes, file + 14, 4), crc32_by_division(content)) << name;
    EXPECT_EQ(content.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
    const std::size_t header_size = number_at(content, 8, 2);
    EXPECT_EQ((10 + header_size) % 64, 0U);
    const std::string header = content.substr(10, header_size);
    EXPECT_EQ(header.back(), '\n');
    const std::size_t last = header.find_last_not_of(" \n");
    EXPECT_LT(header.size() - 2 - last, 64U) << "no more blanks than needed";
    entries[name] = {header.substr(0, last + 1), content.substr(10 + header_size)};
    next_file = file + 30 + name_size + size;
    at += 46 + name_size;
  }
  EXPECT_EQ(at, end);
  EXPECT_EQ(next_file, directory);
  EXPECT_EQ(entries.size(), count);
  return entries;
}

std::string numpy_header(const std::string& type, const std::string& shape) {
  return "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
}

template <typename Number>
std::vector<Number> numbers_in(const Entry& entry) {
  std::vector<Number> numbers(entry.data.size() / sizeof(Number));
  std::memcpy(numbers.data(), entry.data.data(), entry.data.size());
  return numbers;
}

TEST(NumpyArchive, SerializesArraysStringsAndFlags) {
  ASSERT_EQ(crc32_by_division("123456789"), 0xcbf43926U);
  NumpyArchive archive;
  const std::array values{1.5, -2.0, 3.0, 4.0, 5.0, 6.0};
  const std::array<std::int32_t, 2> counts{-7, 1 << 20};
  archive.add_npz_array("matrix", {2, 3}, values);
  archive.add_npz_array("counts", {2}, counts);
  archive.add_npz_array("scalar", 0.25);
  archive.add_npz_array("yes", true);
  archive.add_npz_array("no", false);
  archive.add_npz_array("text", "ab");
  archive.add_npz_array("empty", "");
  const auto entries = read_archive(archive.serialize_npz_archive());
  ASSERT_EQ(entries.size(), 7U);
  EXPECT_EQ(entries.at("matrix.npy").header, numpy_header("<f8", "2,3,"));
  EXPECT_EQ(numbers_in<double>(entries.at("matrix.npy")),
            (std::vector<double>{1.5, -2, 3, 4, 5, 6}));
  EXPECT_EQ(entries.at("counts.npy").header, numpy_header("<i4", "2,"));
  EXPECT_EQ(numbers_in<std::int32_t>(entries.at("counts.npy")),
            (std::vector<std::int32_t>{-7, 1 << 20}));
  EXPECT_EQ(entries.at("scalar.npy").header, numpy_header("<f8", ""));
  EXPECT_EQ(numbers_in<double>(entries.at("scalar.npy")), std::vector<double>{0.25});
  EXPECT_EQ(entries.at("yes.npy").header, numpy_header("|b1", ""));
  EXPECT_EQ(entries.at("yes.npy").data, "\x01");
  EXPECT_EQ(entries.at("no.npy").data, std::string(1, '\0'));
  EXPECT_EQ(entries.at("text.npy").header, numpy_header("<U2", ""));
  EXPECT_EQ(entries.at("text.npy").data, std::string("a\0\0\0b\0\0\0", 8));
  EXPECT_EQ(entries.at("empty.npy").header, numpy_header("<U1", ""));
  EXPECT_EQ(entries.at("empty.npy").data, std::string(4, '\0'));
}

TEST(NumpyArchive, HeaderEndsAtMultipleOf64BytesForAnyShape) {
  NumpyArchive archive;
  NumpyArchive::Shape shape;
  const double value = 1;
  for (int i = 0; i < 40; ++i) {
    archive.add_npz_array(std::to_string(i), shape, std::span(&value, 1));
    shape.push_back(1);
  }
  const auto entries = read_archive(archive.serialize_npz_archive());
  ASSERT_EQ(entries.size(), 40U);
  EXPECT_EQ(entries.at("3.npy").header, numpy_header("<f8", "1,1,1,"));
}

std::string decode_base85(std::string_view text) {
  constexpr std::string_view digits =
      "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
  std::string bytes;
  for (std::size_t from = 0; from < text.size(); from += 5) {
    const std::string_view group = text.substr(from, 5);
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < 5; ++k) {
      value = value * 85 + (k < group.size() ? digits.find(group[k]) : 84);
    }
    for (std::size_t k = 0; k + 1 < group.size(); ++k) {
      bytes += static_cast<char>(value >> (24 - 8 * k) & 0xffU);
    }
  }
  return bytes;
}

TEST(EncodeBase85, DecodesToSameBytesForAnyLength) {
  std::string bytes;
  for (int i = 0; i < 23; ++i) {
    EXPECT_EQ(encode_base85(bytes).size(), (bytes.size() * 5 + 3) / 4);
    EXPECT_EQ(decode_base85(encode_base85(bytes)), bytes);
    bytes += static_cast<char>(37 * i + 201);
  }
}

/// Returns a solution of 3 x 2 points on two boards.
IntrinsicsSolution make_small_solution(LensModel model, std::vector<double> intrinsics) {
  IntrinsicsSolution solution{};
  BoardProblem& problem = solution.problem;
  problem.lens_model = model;
  problem.intrinsics = std::move(intrinsics);
  problem.imager_px = {800, 600};
  problem.cols = 3;
  problem.rows = 2;
  problem.spacing_m = 0.025;
  problem.warp_m = {0.001, -0.002};
  problem.noise_px = 0.5;
  problem.poses = {{{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}}, {{-0.1, -0.2, -0.3}, {-0.4, -0.5, 0.7}}};
  for (int i = 0; i < 12; ++i) {
    problem.points.emplace_back(100 + 50 * (i % 3) + i, 120 + 70 * (i / 3), i == 4 ? -1 : 0.25);
  }
  return solution;
}

/// Writes a solution and returns the text of the file.
std::string written_cameramodel(const IntrinsicsSolution& solution) {
  const TemporaryFolder folder;
  write_mrcal_cameramodel(folder / "a.cameramodel", solution, {});
  return TemporaryFolder::read_content(folder / "a.cameramodel");
}

std::map<std::string, Entry> optimization_inputs_in(const std::string& text) {
  const std::string key = "    'optimization_inputs': b'";
  const std::size_t from = text.find(key) + key.size();
  return read_archive(decode_base85(text.substr(from, text.find('\'', from) - from)));
}

TEST(WriteMrcalCameramodel, WritesLensWith17DigitsAndImageSize) {
  const std::string text =
      written_cameramodel(make_small_solution(LensModel::pinhole, {500.1, 501, 400, 300}));
  EXPECT_TRUE(
      text.starts_with("{\n"
                       "    'lensmodel':  'LENSMODEL_PINHOLE',\n"
                       "    'intrinsics': [ 500.10000000000002, 501, 400, 300,],\n"
                       "    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n"
                       "    'imagersize': [ 800, 600 ],\n"
                       "    'icam_intrinsics': 0,\n"))
      << text;
  EXPECT_TRUE(text.ends_with("',\n}\n"));
}

TEST(WriteMrcalCameramodel, WritesSolvedProblem) {
  const std::vector<double> intrinsics{500, 501, 400, 300, 0.1, 0.2, 0.003, 0.004};
  const IntrinsicsSolution solution = make_small_solution(LensModel::opencv4, intrinsics);
  const auto entries = optimization_inputs_in(written_cameramodel(solution));
  const auto expect_flag = [&](const std::string& name, bool value) {
    const Entry& entry = entries.at(name + ".npy");
    EXPECT_EQ(entry.header, numpy_header("|b1", "")) << name;
    EXPECT_EQ(entry.data, std::string(1, value ? '\1' : '\0')) << name;
  };
  ASSERT_EQ(entries.size(), 20U);
  EXPECT_EQ(entries.at("lensmodel.npy").header, numpy_header("<U17", ""));
  EXPECT_EQ(entries.at("intrinsics.npy").header, numpy_header("<f8", "1,8,"));
  EXPECT_EQ(numbers_in<double>(entries.at("intrinsics.npy")), intrinsics);
  EXPECT_EQ(entries.at("extrinsics_rt_fromref.npy").header, numpy_header("<f8", "0,6,"));
  EXPECT_EQ(entries.at("extrinsics_rt_fromref.npy").data, "");
  EXPECT_EQ(entries.at("frames_rt_toref.npy").header, numpy_header("<f8", "2,6,"));
  EXPECT_EQ(numbers_in<double>(entries.at("frames_rt_toref.npy")),
            (std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, -0.1, -0.2, -0.3, -0.4, -0.5, 0.7}));
  EXPECT_EQ(entries.at("observations_board.npy").header, numpy_header("<f8", "2,2,3,3,"));
  const auto points = numbers_in<double>(entries.at("observations_board.npy"));
  ASSERT_EQ(points.size(), 36U);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(points[3 * i], solution.problem.points[i].x());
    EXPECT_EQ(points[3 * i + 1], solution.problem.points[i].y());
    EXPECT_EQ(points[3 * i + 2], i == 4 ? -2 : 0.5) << "weight divided by the noise";
  }
  const Entry& indices = entries.at("indices_frame_camintrinsics_camextrinsics.npy");
  EXPECT_EQ(indices.header, numpy_header("<i4", "2,3,"));
  EXPECT_EQ(numbers_in<std::int32_t>(indices), (std::vector<std::int32_t>{0, 0, -1, 1, 0, -1}));
  EXPECT_EQ(entries.at("calobject_warp.npy").header, numpy_header("<f8", "2,"));
  EXPECT_EQ(numbers_in<double>(entries.at("calobject_warp.npy")),
            (std::vector<double>{0.001, -0.002}));
  EXPECT_EQ(entries.at("imagersizes.npy").header, numpy_header("<i4", "1,2,"));
  EXPECT_EQ(numbers_in<std::int32_t>(entries.at("imagersizes.npy")),
            (std::vector<std::int32_t>{800, 600}));
  EXPECT_EQ(numbers_in<double>(entries.at("calibration_object_spacing.npy")),
            std::vector<double>{0.025});
  expect_flag("do_optimize_intrinsics_core", true);
  expect_flag("do_optimize_intrinsics_distortions", true);
  expect_flag("do_optimize_extrinsics", true);
  expect_flag("do_optimize_frames", true);
  expect_flag("do_optimize_calobject_warp", true);
  expect_flag("do_apply_regularization", true);
  expect_flag("do_apply_outlier_rejection", true);
  expect_flag("verbose", false);
  for (const char* const none :
       {"points", "observations_point", "indices_point_camintrinsics_camextrinsics"}) {
    EXPECT_EQ(entries.at(std::string(none) + ".npy").header, numpy_header("<U1", ""));
  }
}

TEST(WriteMrcalCameramodel, FlagsFollowSolvedParametersAndLensModel) {
  IntrinsicsSolution solution = make_small_solution(LensModel::pinhole, {500, 501, 400, 300});
  solution.solved_parameters.core = false;
  solution.solved_parameters.warp = false;
  const auto entries = optimization_inputs_in(written_cameramodel(solution));
  for (const char* const name :
       {"do_optimize_intrinsics_core", "do_optimize_intrinsics_distortions",
        "do_optimize_calobject_warp", "do_apply_regularization"}) {
    ASSERT_TRUE(entries.contains(std::string(name) + ".npy"));
    EXPECT_EQ(entries.at(std::string(name) + ".npy").data, std::string(1, '\0')) << name;
  }
}

}  // namespace
}  // namespace vlp
