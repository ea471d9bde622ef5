// Recordings of rosbag2 in SQLite: the messages of an MCAP file in its tables.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "pointflight/recording/sqlite_reader.hpp"
#include "tests/recording/database.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::Database;
using testing::error_of;
using testing::expect_contains;
using testing::TemporaryFolder;
using testing::write_file;

std::vector<std::string> messages_of(const std::vector<std::string>& paths,
                                     const std::vector<std::string>& topics = {}) {
  std::vector<std::string> found;
  const auto reader = open_sqlite(paths, topics);
  for (Recorded message; reader->next(message);) {
    found.push_back(
        fmt::format("{} {} {} {}",
                    message.topic,
                    message.type,
                    message.time,
                    std::string(reinterpret_cast<const char*>(message.data), message.size)));
  }
  EXPECT_EQ(reader->share_read(), 1.0);
  return found;
}

TEST(Sqlite, MessagesComeInTheOrderOfTimeFileAfterFile) {
  const TemporaryFolder folder;
  const std::string first = folder / "run 0%?#.db3";  // a name that is no URI as it stands
  {
    Database file(first);
    file.make_tables();
    file.add_topic(1, "/imu", "sensor_msgs/msg/Imu");
    file.add_topic(7, "/points", "sensor_msgs/msg/PointCloud2");
    file.add_topic(8, "/empty", "std_msgs/msg/Empty");
    file.add_message(7, 2000, "41");
    file.add_message(1, 1000, "4243");
    file.add_message(1, 2000, "44");
    file.add_message(99, 3000, "45");  // of no topic
  }
  const std::string second = folder / "1.db3";
  {
    Database file(second);
    file.make_tables();
    file.add_topic(1, "/points", "sensor_msgs/msg/PointCloud2");
    file.add_message(1, 1500, "46");
  }
  EXPECT_EQ(messages_of({first, second}),
            (std::vector<std::string>{"/imu sensor_msgs/msg/Imu 1000 BC",
                                      "/points sensor_msgs/msg/PointCloud2 2000 A",
                                      "/imu sensor_msgs/msg/Imu 2000 D",
                                      "/points sensor_msgs/msg/PointCloud2 1500 F"}));
  EXPECT_EQ(messages_of({first}, {"/points"}).size(), 1u);
  const RecordingInfo info = read_sqlite(first);
  EXPECT_EQ(info.messages, 3u);
  EXPECT_EQ(info.start, 1000);
  EXPECT_EQ(info.end, 2000);
  ASSERT_EQ(info.topics.size(), 3u);
  EXPECT_EQ(info.topics[1].name, "/imu");
  EXPECT_EQ(info.topics[1].messages, 2u);
  EXPECT_EQ(info.topics[0].messages, 0u);
  // nothing was made beside them
  int files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    ++files;
  }
  EXPECT_EQ(files, 2);
}

TEST(Sqlite, WhatIsNoRecordingIsRefused) {
  const TemporaryFolder folder;
  write_file(folder / "a.db3", "no database");
  expect_contains(error_of([&] { read_sqlite(folder / "a.db3"); }), "file is not a database");
  {
    Database file(folder / "b.db3");
    file.run("CREATE TABLE topics(id INTEGER)");
  }
  expect_contains(error_of([&] { read_sqlite(folder / "b.db3"); }), "without the tables");
  {  // a view that never ends
    Database file(folder / "c.db3");
    file.run(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
        "CREATE VIEW messages(id, topic_id, timestamp, data) AS WITH RECURSIVE n(i) AS "
        "(SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i, 1, i, x'00' FROM n");
  }
  expect_contains(error_of([&] { read_sqlite(folder / "c.db3"); }), "without the tables");
  {
    Database file(folder / "d.db3");
    file.make_tables();
    file.add_topic(1, "/a", "std_msgs/msg/Empty");
    for (int i = 0; i < 2000; ++i) file.add_message(1, i, "0102030405060708");
  }
  std::string cut = testing::read_file(folder / "d.db3");
  write_file(folder / "e.db3", cut.substr(0, cut.size() / 2));
  expect_contains(error_of([&] { messages_of({folder / "e.db3"}); }), "cannot be read");
  expect_contains(error_of([&] { read_sqlite(folder / "nothing.db3"); }), "nothing.db3");
  // interrupted while it is sorted
  const Progress stop = [](std::string_view, double) { throw InputError("stopped"); };
  {
    Database file(folder / "f.db3");
    file.make_tables();
    file.run("DROP INDEX timestamp_idx");
    file.add_topic(1, "/a", "std_msgs/msg/Empty");
    file.run(
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n LIMIT 50000) "
        "INSERT INTO messages SELECT i, 1, -i, x'00' FROM n");
  }
  expect_contains(error_of([&] { read_sqlite(folder / "f.db3", stop); }), "stopped");
}

}  // namespace
}  // namespace pointflight
