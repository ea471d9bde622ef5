// The messages that ROS 1 and ROS 2 share: a struct and a table of its fields each. Codecs
// (codec.hpp) and definitions, md5 sums and type hashes (description.hpp) walk the tables, so that
// they cannot disagree.
//
// To add one: a struct with `kType` and `fields` in wire order, an entry in message_test.cpp
// with its published md5 and hash, one line where it is published or read.
#pragma once

#include "ros_common/messages/commands.hpp"
#include "ros_common/messages/display.hpp"
#include "ros_common/messages/geometry.hpp"
#include "ros_common/messages/sensors.hpp"
#include "ros_common/messages/services.hpp"
#include "ros_common/messages/standard.hpp"
