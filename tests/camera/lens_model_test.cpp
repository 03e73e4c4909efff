// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_model.h"

#include <gmock/gmock.h>

#include "camera/random_lens.h"

namespace vlp {
namespace {

TEST(LensModelNames, AreMrcals) {
  EXPECT_EQ(name_of(LensModel::pinhole), "LENSMODEL_PINHOLE");
  EXPECT_EQ(name_of(LensModel::stereographic), "LENSMODEL_STEREOGRAPHIC");
  EXPECT_EQ(name_of(LensModel::opencv4), "LENSMODEL_OPENCV4");
  EXPECT_EQ(name_of(LensModel::opencv5), "LENSMODEL_OPENCV5");
  EXPECT_EQ(name_of(LensModel::opencv8), "LENSMODEL_OPENCV8");
  EXPECT_EQ(name_of(LensModel::opencv12), "LENSMODEL_OPENCV12");
}

TEST(LensModelNames, AreReadBack) {
  for (const LensModel model : kEveryModel) EXPECT_EQ(lens_model_from_name(name_of(model)), model);
}

TEST(LensModelNames, AreReadExactly) {
  for (const char* name : {"", "LENSMODEL_", "LENSMODEL_OPENCV", "LENSMODEL_OPENCV88", "OPENCV8",
                           "lensmodel_opencv8", "LENSMODEL_OPENCV8 ", "LENSMODEL_CAHVOR"}) {
    EXPECT_FALSE(lens_model_from_name(name)) << name;
  }
}

TEST(LensModelNames, AreAllListedForMessages) {
  EXPECT_EQ(lens_model_names(),
            "LENSMODEL_PINHOLE, LENSMODEL_STEREOGRAPHIC, LENSMODEL_OPENCV4, LENSMODEL_OPENCV5, "
            "LENSMODEL_OPENCV8, LENSMODEL_OPENCV12, OPENCV_FISHEYE");
}

TEST(LensModelParameters, AreAsManyAsMrcals) {
  for (const LensModel model : kMrcalModels) {
    const std::vector<double> parameters(parameter_count(model), 1.0);
    EXPECT_NO_THROW(oracle_of(model, parameters)) << name_of(model);
    EXPECT_ANY_THROW(oracle_of(model, std::vector<double>(parameters.size() + 1, 1.0)));
  }
}

}  // namespace
}  // namespace vlp
