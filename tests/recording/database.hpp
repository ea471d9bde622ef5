#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstdint>
#include <string>

namespace pointflight::testing {

/// A database that is written.
class Database {
 public:
  explicit Database(const std::string& path) {
    EXPECT_EQ(sqlite3_open(path.c_str(), &file_), SQLITE_OK);
  }
  ~Database() { sqlite3_close(file_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  void run(const std::string& sql) {
    char* error = nullptr;
    EXPECT_EQ(sqlite3_exec(file_, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK)
        << sql << ": " << error;
  }
  /// As rosbag2 of Humble makes them (rosbag2_storage_sqlite3, sqlite_storage.cpp).
  void make_tables() {
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        "timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);");
  }
  void add_topic(int id, const std::string& name, const std::string& type) {
    run(fmt::format("INSERT INTO topics VALUES ({}, '{}', '{}', 'cdr', '')", id, name, type));
  }
  void add_message(int topic, std::int64_t time, const std::string& hex) {
    run(fmt::format("INSERT INTO messages (topic_id, timestamp, data) VALUES ({}, {}, x'{}')",
                    topic,
                    time,
                    hex));
  }

 private:
  sqlite3* file_ = nullptr;
};

}  // namespace pointflight::testing
