#include "pointflight/recording/sqlite_reader.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"

// The tables of rosbag2_storage_sqlite3 (ros2/rosbag2): topics (id, name, type,
// serialization_format, ...), messages (id, topic_id, timestamp in ns, data).
namespace pointflight {
namespace {

constexpr int kBlobMost = 256 << 20;           // bytes of a message
constexpr std::int64_t kHeapMost = 512 << 20;  // bytes that SQLite may take, for sorting
constexpr int kStepsBetweenReports = 100'000;  // of SQLite's machine

/// A path as SQLite's URI has it: the file is not locked, and no journal is made beside it.
std::string uri_of(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '/' || c == '.' || c == '_' || c == '-';
    uri += is_plain ? std::string(1, c)
                    : fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  }
  return uri + "?immutable=1";
}

struct StatementDeleter {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, StatementDeleter>;

/// One file.
class SqliteFile {
 public:
  struct Topic {
    std::string name, type, encoding;
    std::uint64_t messages = 0;
  };

  SqliteFile(const std::string& path, const Progress& progress) : path_(path), progress_(progress) {
    require_regular_file(path);
    sqlite3_hard_heap_limit64(kHeapMost);
    sqlite3* file = nullptr;
    const int code = sqlite3_open_v2(
        uri_of(path).c_str(), &file, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    file_.reset(file);
    if (code != SQLITE_OK) fail();
    // a hostile file's views, triggers and functions run nothing
    sqlite3_db_config(file, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(file, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(file, SQLITE_LIMIT_LENGTH, kBlobMost);
    sqlite3_progress_handler(file, kStepsBetweenReports, &SqliteFile::on_progress, this);
    require_tables();
    read_topics();
  }

  [[nodiscard]] std::map<std::int64_t, Topic>& topics() { return topics_; }

  [[nodiscard]] Statement prepare(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(file_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) fail();
    return Statement(statement);
  }

  /// True while there is a row.
  bool step(sqlite3_stmt* statement) {
    const int code = sqlite3_step(statement);
    if (interrupt_) std::rethrow_exception(std::exchange(interrupt_, nullptr));
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail();
    return code == SQLITE_ROW;
  }

 private:
  struct FileDeleter {
    void operator()(sqlite3* file) const { sqlite3_close_v2(file); }
  };

  [[noreturn]] void fail() const {
    const char* words = file_ ? sqlite3_errmsg(file_.get()) : "out of memory";
    throw InputError(fmt::format("{}: cannot be read as a recording in SQLite: {}", path_, words));
  }

  /// What an exception cannot do: pass through SQLite.
  static int on_progress(void* self) {
    auto& file = *static_cast<SqliteFile*>(self);
    try {
      report(file.progress_, "reading the recording", 0.0);  // what it sorts it does not tell
      return 0;
    } catch (...) {
      file.interrupt_ = std::current_exception();
      return 1;
    }
  }

  /// Tables, not views that compute for ever.
  void require_tables() {
    const Statement found = prepare(
        "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', "
        "'messages') "
        "AND sql NOT LIKE '%virtual%'");
    if (step(found.get()) && sqlite3_column_int64(found.get(), 0) == 2) return;
    throw InputError(fmt::format(
        "{}: is a database without the tables of a recording (topics, messages)", path_));
  }

  void read_topics() {
    const Statement rows = prepare("SELECT id, name, type, serialization_format FROM topics");
    constexpr std::size_t kTopicsMost = 100'000;
    while (step(rows.get())) {
      Topic topic;
      topic.name = text(rows.get(), 1);
      topic.type = text(rows.get(), 2);
      topic.encoding = text(rows.get(), 3);
      topics_[sqlite3_column_int64(rows.get(), 0)] = std::move(topic);
      if (topics_.size() > kTopicsMost) {
        throw InputError(fmt::format("{}: has more than {} topics", path_, kTopicsMost));
      }
    }
  }

  static std::string text(sqlite3_stmt* row, int column) {
    const auto* words = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
    return words == nullptr ? std::string() : std::string(words);
  }

  std::string path_;
  const Progress& progress_;
  std::exception_ptr interrupt_;
  std::unique_ptr<sqlite3, FileDeleter> file_;
  std::map<std::int64_t, Topic> topics_;
};

/// File after file.
class SqliteSeries : public MessageReader {
 public:
  SqliteSeries(std::vector<std::string> paths, std::vector<std::string> topics, Progress progress)
      : paths_(std::move(paths)), topics_(std::move(topics)), progress_(std::move(progress)) {
    open();
  }

  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  [[nodiscard]] double share_read() const override {
    const double of_file =
        count_ > 0 ? static_cast<double>(read_) / static_cast<double>(count_) : 0.0;
    return (static_cast<double>(now_) + of_file) / static_cast<double>(paths_.size());
  }

  bool next(Recorded& message) override {
    for (; now_ < paths_.size(); ++now_, open()) {
      while (file_->step(rows_.get())) {
        ++read_;
        const auto topic = file_->topics().find(sqlite3_column_int64(rows_.get(), 0));
        if (topic == file_->topics().end() || !is_wanted(topic->second)) continue;
        message.topic = topic->second.name;
        message.type = topic->second.type;
        message.time = sqlite3_column_int64(rows_.get(), 1);
        message.data = static_cast<const std::byte*>(sqlite3_column_blob(rows_.get(), 2));
        message.size = static_cast<std::size_t>(sqlite3_column_bytes(rows_.get(), 2));
        return true;
      }
    }
    return false;
  }

 private:
  [[nodiscard]] bool is_wanted(const SqliteFile::Topic& topic) const {
    return topic.encoding == "cdr" &&
           (topics_.empty() ||
            std::find(topics_.begin(), topics_.end(), topic.name) != topics_.end());
  }

  void open() {
    rows_.reset();
    file_.reset();
    read_ = count_ = 0;
    if (now_ >= paths_.size()) return;
    file_.emplace(paths_[now_], progress_);
    const Statement counted = file_->prepare("SELECT count(*) FROM messages");
    if (file_->step(counted.get())) {
      count_ = static_cast<std::uint64_t>(sqlite3_column_int64(counted.get(), 0));
    }
    rows_ = file_->prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id");
  }

  std::vector<std::string> paths_;
  std::vector<std::string> topics_;
  Progress progress_;
  std::size_t now_ = 0;
  std::uint64_t read_ = 0, count_ = 0;
  std::optional<SqliteFile> file_;
  Statement rows_;  ///< Ends before its file.
};

}  // namespace

std::unique_ptr<MessageReader> open_sqlite(const std::vector<std::string>& paths,
                                           const std::vector<std::string>& topics,
                                           const Progress& progress) {
  return std::make_unique<SqliteSeries>(paths, topics, progress);
}

RecordingInfo read_sqlite(const std::string& path, const Progress& progress) {
  SqliteFile file(path, progress);
  RecordingInfo info;
  info.format = "rosbag2 in SQLite";
  info.compression = "none";
  const Statement rows = file.prepare(
      "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY topic_id");
  while (file.step(rows.get())) {
    const auto topic = file.topics().find(sqlite3_column_int64(rows.get(), 0));
    if (topic == file.topics().end()) continue;
    const auto count = static_cast<std::uint64_t>(sqlite3_column_int64(rows.get(), 1));
    const std::int64_t first = sqlite3_column_int64(rows.get(), 2);
    const std::int64_t last = sqlite3_column_int64(rows.get(), 3);
    topic->second.messages = count;
    info.start = info.messages == 0 ? first : std::min(info.start, first);
    info.end = info.messages == 0 ? last : std::max(info.end, last);
    info.messages += count;
  }
  for (const auto& [id, topic] : file.topics()) {
    info.topics.push_back({topic.name, topic.type, topic.messages});
  }
  std::sort(info.topics.begin(), info.topics.end(), [](const auto& a, const auto& b) {
    return a.name < b.name;
  });
  return info;
}

}  // namespace pointflight
