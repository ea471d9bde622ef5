#include "pointflight/recording/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <deque>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/recording/internal/mcap_chunk.hpp"
#include "pointflight/recording/internal/mcap_format.hpp"

namespace pointflight {
namespace {

using mcap::Opcode;
using mcap::RecordReader;

/// Walks over records and counts.
class Reading {
 public:
  Reading(RecordingInfo& info, const std::function<void(const RecordedMessage&)>& on_message)
      : info_(info), on_message_(on_message) {}

  /// All whole records of `bytes`.
  void records(std::span<const std::byte> bytes, bool in_chunk) {
    std::size_t at = 0;
    while (step(bytes, at, in_chunk)) {
    }
  }

  /// The record at `at`, which moves on; false if there is no whole one, and after the footer.
  bool step(std::span<const std::byte> bytes, std::size_t& at, bool in_chunk) {
    if (ended_ || bytes.size() - at < mcap::kRecordHead) return false;
    const auto opcode = static_cast<Opcode>(bytes[at]);
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + 1, sizeof(length));
    if (length > bytes.size() - at - mcap::kRecordHead) return false;
    record(opcode, bytes.subspan(at + mcap::kRecordHead, length), in_chunk);
    at += mcap::kRecordHead + length;
    if (!in_chunk) {
      data_ended_ = data_ended_ || opcode == Opcode::kDataEnd;
      ended_ = opcode == Opcode::kFooter;
    }
    return true;
  }

  [[nodiscard]] bool ended() const { return ended_; }

  void finish() {
    for (const auto& entry : channels_) {
      const Channel& channel = entry.second;
      if (!channel.known) continue;
      const auto same = std::find_if(info_.topics.begin(), info_.topics.end(), [&](const auto& t) {
        return t.name == channel.topic && t.type == channel.type;
      });
      if (same != info_.topics.end()) {
        same->messages += channel.messages;
      } else {
        info_.topics.push_back({channel.topic, channel.type, channel.messages});
      }
    }
    std::sort(info_.topics.begin(), info_.topics.end(), [](const auto& a, const auto& b) {
      return a.name < b.name;
    });
    for (const std::string& how : compressions_) {
      info_.compression += (info_.compression.empty() ? "" : ", ") + (how.empty() ? "none" : how);
    }
  }

 private:
  struct Channel {
    std::string topic, type;
    std::uint64_t messages = 0;
    bool known = false;
  };

  void record(Opcode opcode, std::span<const std::byte> content, bool in_chunk) {
    RecordReader reader(content);
    switch (opcode) {
      case Opcode::kHeader: {
        const std::string profile = reader.text();
        info_.format = profile.empty() ? "MCAP" : "MCAP, profile " + profile;
        info_.library = reader.text();
        break;
      }
      case Opcode::kSchema: {
        const auto id = reader.number<std::uint16_t>();
        std::string name = reader.text();
        if (reader.ok()) schemas_[id] = std::move(name);
        break;
      }
      case Opcode::kChannel: {
        const auto id = reader.number<std::uint16_t>();
        const auto schema = reader.number<std::uint16_t>();
        std::string topic = reader.text();
        if (!reader.ok()) break;
        Channel& channel = channels_[id];
        channel.topic = std::move(topic);
        channel.type = schemas_[schema];
        channel.known = true;
        break;
      }
      case Opcode::kMessage:
        if (!data_ended_) message(reader);
        break;
      case Opcode::kChunk:
        if (!in_chunk && !data_ended_) chunk(reader);
        break;
      case Opcode::kAttachment: {
        static_cast<void>(reader.take(16));  // times
        RecordingInfo::Attachment attachment;
        attachment.name = reader.text();
        attachment.media_type = reader.text();
        attachment.size = reader.number<std::uint64_t>();
        if (reader.ok()) info_.attachments.push_back(std::move(attachment));
        break;
      }
      default:
        break;
    }
  }

  void message(RecordReader& reader) {
    const auto id = reader.number<std::uint16_t>();
    static_cast<void>(reader.take(4));  // sequence
    const auto time = static_cast<std::int64_t>(reader.number<std::uint64_t>());
    static_cast<void>(reader.take(8));  // publish time
    const auto channel = channels_.find(id);
    if (!reader.ok() || channel == channels_.end()) return;
    ++channel->second.messages;
    if (info_.messages++ == 0) info_.start = info_.end = time;
    info_.start = std::min(info_.start, time);
    info_.end = std::max(info_.end, time);
    if (on_message_) {
      on_message_({channel->second.topic, channel->second.type, time, reader.take(reader.left())});
    }
  }

  void chunk(RecordReader& reader) {
    const auto packed = mcap::chunk_of(reader);
    if (!packed) return;
    auto bytes = mcap::unpack(*packed);
    if (!bytes) {
      info_.complete = false;
      return;
    }
    chunk_ = std::move(*bytes);
    ++info_.chunks;
    compressions_.insert(packed->compression);
    records(chunk_, true);
  }

  RecordingInfo& info_;
  const std::function<void(const RecordedMessage&)>& on_message_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::set<std::string> compressions_;
  std::vector<std::byte> chunk_;  ///< The last one: messages lie in it.
  bool ended_ = false;
  bool data_ended_ = false;
};

void check_magic(std::span<const std::byte> bytes, const std::string& name) {
  const auto magic = std::as_bytes(std::span(mcap::kMagic));
  if (bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin())) return;
  throw InputError(fmt::format("{}: is not an MCAP file (it does not begin with its magic)", name));
}

/// Record by record; the messages of a chunk wait in a queue.
class McapMessages : public MessageReader {
 public:
  explicit McapMessages(const std::string& path) : file_(path) { check_magic(file_.bytes(), path); }

  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  [[nodiscard]] double share_read() const override {
    return static_cast<double>(at_) / static_cast<double>(file_.bytes().size());
  }
  bool next(Recorded& message) override {
    while (waiting_.empty()) {
      if (!reading_.step(file_.bytes(), at_, false)) return false;
    }
    message = waiting_.front();
    waiting_.pop_front();
    return true;
  }

 private:
  MappedFile file_;
  std::size_t at_ = mcap::kMagic.size();
  std::deque<Recorded> waiting_;
  RecordingInfo info_;
  std::function<void(const RecordedMessage&)> keep_ = [this](const RecordedMessage& m) {
    waiting_.push_back({m.topic, m.type, m.time, m.data.data(), m.data.size()});
  };
  Reading reading_{info_, keep_};
};

/// File after file.
class McapSeries : public MessageReader {
 public:
  explicit McapSeries(const std::vector<std::string>& paths) {
    for (const std::string& path : paths) {
      files_.push_back(std::make_unique<McapMessages>(path));  // mapped: costs nothing
    }
  }

  [[nodiscard]] Wire wire() const override { return Wire::kCdr; }
  [[nodiscard]] double share_read() const override {
    if (now_ == files_.size()) return 1.0;
    return (static_cast<double>(now_) + files_[now_]->share_read()) /
           static_cast<double>(files_.size());
  }
  bool next(Recorded& message) override {
    while (now_ < files_.size()) {
      if (files_[now_]->next(message)) return true;
      ++now_;
    }
    return false;
  }

 private:
  std::vector<std::unique_ptr<McapMessages>> files_;
  std::size_t now_ = 0;
};

}  // namespace

std::unique_ptr<MessageReader> open_mcap(const std::vector<std::string>& paths) {
  return std::make_unique<McapSeries>(paths);
}

RecordingInfo read_mcap_bytes(std::span<const std::byte> bytes,
                              const std::string& name,
                              const std::function<void(const RecordedMessage&)>& on_message) {
  check_magic(bytes, name);
  RecordingInfo info;
  info.format = "MCAP";
  Reading reading(info, on_message);
  reading.records(bytes.subspan(mcap::kMagic.size()), false);
  info.complete = info.complete && reading.ended();
  reading.finish();
  return info;
}

RecordingInfo read_mcap(const std::string& path,
                        const std::function<void(const RecordedMessage&)>& on_message) {
  const MappedFile file(path);
  return read_mcap_bytes(file.bytes(), path, on_message);
}

std::string read_mcap_attachment(const std::string& path, const std::string& attachment) {
  const MappedFile file(path);
  const auto bytes = file.bytes();
  std::size_t at = mcap::kMagic.size();
  while (at < bytes.size() && bytes.size() - at >= mcap::kRecordHead) {
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + 1, sizeof(length));
    if (length > bytes.size() - at - mcap::kRecordHead) break;
    RecordReader reader(bytes.subspan(at + mcap::kRecordHead, length));
    if (static_cast<Opcode>(bytes[at]) == Opcode::kAttachment) {
      static_cast<void>(reader.take(16));
      const std::string name = reader.text();
      static_cast<void>(reader.text());
      const auto data = reader.take(reader.number<std::uint64_t>());
      if (reader.ok() && name == attachment) {
        return {reinterpret_cast<const char*>(data.data()), data.size()};
      }
    }
    at += mcap::kRecordHead + length;
  }
  throw InputError(fmt::format("{}: has no attachment '{}'", path, attachment));
}

}  // namespace pointflight
