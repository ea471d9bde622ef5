#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace pointflight {

/// Numbers of an array.
struct NumberArray {
  std::vector<std::size_t> shape;  ///< Lengths of its dimensions; empty: one number.
  std::vector<float> values;       ///< The last index runs fastest.
};

/// All arrays of a .npz by name, without .npy: floats and whole numbers in C's order, a million in
/// each at most. Throws InputError.
std::map<std::string, NumberArray> read_npz_arrays(const std::string& path);

}  // namespace pointflight
