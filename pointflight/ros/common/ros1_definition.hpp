#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace pointflight {

/// The numbers of a ROS 1 message by their full names ("position.x", "kx[2]"), read by the
/// definition that came with its connection: how a message is understood whose md5 nobody here
/// knows. Arrays of unknown length are skipped. Nothing if definition and bytes do not fit
/// together.
std::optional<std::map<std::string, double>> numbers_of(const std::string& definition,
                                                        std::span<const std::byte> bytes);

}  // namespace pointflight
