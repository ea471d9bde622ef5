#include "pointflight/io/npz_arrays.hpp"

#include <gtest/gtest.h>

#include "tests/io/numpy_files.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::bytes_of;
using testing::error_of;
using testing::expect_contains;
using testing::npy;
using testing::TemporaryFolder;
using testing::write_npz;

TEST(NpzArrays, NumbersOfAllKindsAndShapes) {
  const TemporaryFolder folder;
  write_npz(folder / "a.npz",
            {{"weight.npy",
              npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }",
                  bytes_of<float>({1, 2, 3, 4, 5, 6.5}))},
             {"bias.npy",
              npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }",
                  bytes_of<double>({-0.25, 7}))},
             {"one.npy",
              npy("{'descr': '<i2', 'fortran_order': False, 'shape': (), }",
                  bytes_of<std::int16_t>({-3}))},
             {"text.npy", npy("{'descr': '|u1', 'fortran_order': False, 'shape': (2,), }", "ok")},
             {"readme.txt", "x"}});
  const auto arrays = read_npz_arrays(folder / "a.npz");
  ASSERT_EQ(arrays.size(), 4u);
  EXPECT_EQ(arrays.at("weight").shape, (std::vector<std::size_t>{2, 3}));
  EXPECT_EQ(arrays.at("weight").values, (std::vector<float>{1, 2, 3, 4, 5, 6.5}));
  EXPECT_EQ(arrays.at("bias").values, (std::vector<float>{-0.25, 7}));
  EXPECT_TRUE(arrays.at("one").shape.empty());
  EXPECT_EQ(arrays.at("one").values, std::vector<float>{-3});
  EXPECT_EQ(arrays.at("text").values, (std::vector<float>{'o', 'k'}));
}

TEST(NpzArrays, BadOnesSayWhat) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& array) {
    write_npz(folder / "a.npz", {{"a.npy", array}});
    return error_of([&] { read_npz_arrays(folder / "a.npz"); });
  };
  expect_contains(error(npy("{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }",
                            bytes_of<float>({1, 2}))),
                  "Fortran's order");
  expect_contains(
      error(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }", bytes_of<float>({1}))),
      "fewer numbers than its header promises");
  expect_contains(error(npy("{'descr': '<U3', 'fortran_order': False, 'shape': (), }", "abc")),
                  "type '<U3' are not read");
  expect_contains(
      error(npy("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (0,), }", "")),
      "no plain numbers");
  expect_contains(error("PK"), "a.npz: a.npy: does not begin as NumPy's files do");
}

}  // namespace
}  // namespace pointflight
