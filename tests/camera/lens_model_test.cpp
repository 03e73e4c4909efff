// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_model.h"

#include <gmock/gmock.h>

#include "camera/random_lens.h"

namespace vlp {
namespace {

TEST(LensModelName, ReturnsLensModelNamesOfMrcal) {
  EXPECT_EQ(lens_model_name(LensModel::pinhole), "LENSMODEL_PINHOLE");
  EXPECT_EQ(lens_model_name(LensModel::stereographic), "LENSMODEL_STEREOGRAPHIC");
  EXPECT_EQ(lens_model_name(LensModel::opencv4), "LENSMODEL_OPENCV4");
  EXPECT_EQ(lens_model_name(LensModel::opencv5), "LENSMODEL_OPENCV5");
  EXPECT_EQ(lens_model_name(LensModel::opencv8), "LENSMODEL_OPENCV8");
  EXPECT_EQ(lens_model_name(LensModel::opencv12), "LENSMODEL_OPENCV12");
}

TEST(LensModelFromName, InvertsLensModelNameForEachModel) {
  for (const LensModel model : kEveryModel)
    EXPECT_EQ(lens_model_from_name(lens_model_name(model)), model);
}

TEST(LensModelFromName, ReturnsNulloptForUnknownOrInexactNames) {
  for (const char* name :
       {"",
        "LENSMODEL_",
        "LENSMODEL_OPENCV",
        "LENSMODEL_OPENCV88",
        "OPENCV8",
        "lensmodel_opencv8",
        "LENSMODEL_OPENCV8 ",
        "LENSMODEL_CAHVOR",
        "LENSMODEL_SPLINED_STEREOGRAPHIC",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190 ",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=016_Ny=14_fov_x_deg=190",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=4_Nx=16_Ny=14_fov_x_deg=190",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=1_Nx=16_Ny=14_fov_x_deg=190",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=3_Ny=14_fov_x_deg=190",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=256_fov_x_deg=190",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=-16_Ny=14_fov_x_deg=190",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=0",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=360",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=99999999999"}) {
    EXPECT_FALSE(lens_model_from_name(name)) << name;
  }
}

TEST(ListLensModelNames, ReturnsNamesOfAllModelsInOneString) {
  EXPECT_EQ(list_lens_model_names(),
            "LENSMODEL_PINHOLE, LENSMODEL_STEREOGRAPHIC, LENSMODEL_OPENCV4, LENSMODEL_OPENCV5, "
            "LENSMODEL_OPENCV8, LENSMODEL_OPENCV12, OPENCV_FISHEYE, "
            "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190 and its like");
}

TEST(SplinedLensModel, ReturnsModelWithGridNameAndParameterCount) {
  for (const SplineGrid& grid : {SplineGrid{2, 3, 3, 1}, SplineGrid{3, 4, 4, 359},
                                 SplineGrid{2, 255, 255, 359}, SplineGrid{3, 30, 20, 170}}) {
    const LensModel model = splined_lens_model(grid);
    EXPECT_TRUE(is_splined_lens_model(model));
    EXPECT_EQ(spline_grid_of(model), grid);
    EXPECT_EQ(lens_model_from_name(lens_model_name(model)), model);
    EXPECT_EQ(num_lens_parameters(model), 4U + 2U * static_cast<unsigned>(grid.nx * grid.ny));
  }
  EXPECT_EQ(lens_model_name(splined_lens_model({3, 30, 20, 170})),
            "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=20_fov_x_deg=170");
}

TEST(NumLensParameters, EqualsOnlyCountAcceptedByMrcal) {
  for (const LensModel model : kMrcalModels) {
    const std::vector<double> parameters(num_lens_parameters(model), 1.0);
    EXPECT_NO_THROW(make_oracle(model, parameters)) << lens_model_name(model);
    EXPECT_ANY_THROW(make_oracle(model, std::vector<double>(parameters.size() + 1, 1.0)));
  }
}

}  // namespace
}  // namespace vlp
