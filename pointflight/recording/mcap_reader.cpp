#include "pointflight/recording/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/recording/internal/mcap_timeline.hpp"

namespace pointflight {
namespace {

/// A file whose messages were never described, or with none, cannot be shown.
std::unique_ptr<TimedRecording> with_messages(std::unique_ptr<mcap::Timeline> timeline,
                                              const std::string& name) {
  if (timeline->is_empty()) throw InputError(fmt::format("{}: holds no message", name));
  return timeline;
}

std::unique_ptr<mcap::Timeline> timeline_of(const std::string& path, const Progress& progress) {
  return std::make_unique<mcap::Timeline>(std::make_unique<MappedFile>(path), path, progress);
}

/// How much of a file's time is before `time`, 0 to 1.
double share_before(const mcap::Timeline& file, std::int64_t time) {
  const auto [first, last] = file.range();
  return last > first ? static_cast<double>(time - first) / static_cast<double>(last - first) : 0.0;
}

/// File after file.
class McapSeries : public MessageReader {
 public:
  McapSeries(const std::vector<std::string>& paths, const Progress& progress) {
    for (const std::string& path : paths) files_.push_back(timeline_of(path, progress));
  }

  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  [[nodiscard]] double share_read() const override {
    return (static_cast<double>(now_) + share_of_file_) / static_cast<double>(files_.size());
  }
  bool next(Recorded& message) override {
    for (; now_ < files_.size(); ++now_) {
      mcap::Timeline& file = *files_[now_];
      TimedMessage found;
      if (!file.next(found)) {
        share_of_file_ = 0.0;
        continue;
      }
      const RecordedChannel& channel = file.channels()[found.channel];
      message = {
          channel.topic, channel.schema_name, found.time, found.data.data(), found.data.size()};
      share_of_file_ = share_before(file, found.time);
      return true;
    }
    return false;
  }

 private:
  std::vector<std::unique_ptr<mcap::Timeline>> files_;
  std::size_t now_ = 0;
  double share_of_file_ = 0.0;
};

RecordingInfo count(mcap::Timeline& file, const Progress& progress) {
  std::map<std::pair<std::string, std::string>, std::uint64_t> topics;
  for (const RecordedChannel& channel : file.channels()) {
    topics[{channel.topic, channel.schema_name}];
  }
  std::uint64_t messages = 0;
  std::int64_t start = 0;
  std::int64_t end = 0;
  TimedMessage message;
  while (file.next(message)) {
    report(progress, "counting messages", share_before(file, message.time));
    const RecordedChannel& channel = file.channels()[message.channel];
    ++topics[{channel.topic, channel.schema_name}];
    if (messages++ == 0) start = end = message.time;
    start = std::min(start, message.time);
    end = std::max(end, message.time);
  }
  RecordingInfo info = file.info();
  info.messages = messages;
  info.start = start;
  info.end = end;
  for (const auto& [name, count] : topics) info.topics.push_back({name.first, name.second, count});
  return info;
}

}  // namespace

std::unique_ptr<TimedRecording> open_timed_mcap(const std::string& path, const Progress& progress) {
  return with_messages(timeline_of(path, progress), path);
}

std::unique_ptr<TimedRecording> timed_mcap(std::span<const std::byte> bytes,
                                           const std::string& name,
                                           const Progress& progress) {
  return with_messages(std::make_unique<mcap::Timeline>(bytes, name, progress), name);
}

std::unique_ptr<MessageReader> open_mcap(const std::vector<std::string>& paths,
                                         const Progress& progress) {
  return std::make_unique<McapSeries>(paths, progress);
}

RecordingInfo read_mcap(const std::string& path, const Progress& progress) {
  return count(*timeline_of(path, progress), progress);
}

RecordingInfo read_mcap_bytes(std::span<const std::byte> bytes, const std::string& name) {
  mcap::Timeline timeline(bytes, name, {});
  return count(timeline, {});
}

}  // namespace pointflight
