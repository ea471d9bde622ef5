#include "pointflight/recording/internal/mcap_timeline.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace pointflight::mcap {
namespace {

/// Of unpacked chunks that are merged by time; a recorder's overlap by one or two.
constexpr std::size_t kMostUnpacked = std::size_t{512} << 20;

template <class Take>
void each_message(const Piece& piece, const std::vector<std::byte>* unpacked, const Take& take) {
  const auto bytes = unpacked != nullptr ? std::span(*unpacked) : piece.records;
  each_record(bytes, [&](Opcode opcode, std::span<const std::byte> content) {
    if (opcode != Opcode::kMessage) return true;
    if (const auto message = message_of(content)) take(*message);
    return true;
  });
}

}  // namespace

Timeline::Timeline(std::span<const std::byte> bytes,
                   const std::string& name,
                   const Progress& progress)
    : outline_(bytes, name, progress) {
  const std::vector<Piece>& pieces = outline_.pieces();
  if (pieces.empty()) return;
  std::int64_t end = pieces.front().end;
  for (const Piece& piece : pieces) end = std::max(end, piece.end);
  range_ = {pieces.front().start, end};
}

Timeline::Timeline(std::unique_ptr<MappedFile> file,
                   const std::string& name,
                   const Progress& progress)
    : Timeline(file->bytes(), name, progress) {
  file_ = std::move(file);
}

void Timeline::seek(std::int64_t time) {
  from_ = time;
  next_piece_ = 0;
  waiting_ = {};
  held_.reset();
}

bool Timeline::next(TimedMessage& message) {
  const std::vector<Piece>& pieces = outline_.pieces();
  for (; next_piece_ < pieces.size(); ++next_piece_) {
    const Piece& piece = pieces[next_piece_];
    if (piece.end < from_) continue;
    const bool is_due = waiting_.empty() || piece.start <= waiting_.top().message.time;
    if (!is_due || (unpacked_bytes_ > kMostUnpacked && !waiting_.empty())) break;
    load(piece);
  }
  if (waiting_.empty()) return false;
  held_ = waiting_.top().bytes;
  const Message& first = waiting_.top().message;
  message = {*outline_.number_of(first.channel), first.time, first.data};
  waiting_.pop();
  return true;
}

void Timeline::latched_before(std::int64_t time,
                              const std::function<void(const TimedMessage&)>& take) {
  std::set<std::size_t> wanted;
  for (std::size_t i = 0; i < channels().size(); ++i) {
    if (channels()[i].latched) wanted.insert(i);
  }
  const std::vector<Piece>& pieces = outline_.pieces();
  std::vector<std::int64_t> reach;  // the latest end of each piece and all before it
  reach.reserve(pieces.size());
  for (const Piece& piece : pieces) {
    reach.push_back(reach.empty() ? piece.end : std::max(reach.back(), piece.end));
  }
  struct Last {
    Message message;
    Unpacked bytes;
  };
  std::map<std::size_t, Last> last;
  for (std::size_t i = pieces.size(); i-- > 0 && !wanted.empty();) {
    // pieces overlap: one is the last if none that is left comes up to it
    std::erase_if(wanted, [&](std::size_t channel) {
      const auto found = last.find(channel);
      return found != last.end() && found->second.message.time > reach[i];
    });
    if (pieces[i].start > time || !has_one_of(pieces[i], wanted)) continue;
    const Unpacked bytes = unpack(pieces[i]);
    each_message(pieces[i], bytes.get(), [&](const Message& message) {
      const auto channel = outline_.number_of(message.channel);
      if (!channel || !wanted.contains(*channel) || message.time >= time) return;
      const auto known = last.find(*channel);
      if (known == last.end() || message.time >= known->second.message.time) {
        last[*channel] = {message, bytes};
      }
    });
  }
  for (const auto& [channel, found] : last) {
    take({channel, found.message.time, found.message.data});
  }
}

RecordingInfo Timeline::info() const {
  RecordingInfo info = outline_.info();
  info.chunks = chunks_;
  info.complete = info.complete && !has_broken_chunks_;
  for (const std::string& how : compressions_) {
    info.compression += (info.compression.empty() ? "" : ", ") + (how.empty() ? "none" : how);
  }
  return info;
}

bool Timeline::has_one_of(const Piece& piece, const std::set<std::size_t>& wanted) const {
  if (piece.channels.empty()) return true;  // who knows
  return std::any_of(piece.channels.begin(), piece.channels.end(), [&](ChannelId id) {
    const auto number = outline_.number_of(id);
    return number && wanted.contains(*number);
  });
}

/// Null if there is nothing to unpack, or it does not.
Timeline::Unpacked Timeline::unpack(const Piece& piece) {
  if (!piece.chunk) return nullptr;
  auto bytes = mcap::unpack(*piece.chunk);
  if (!bytes) {
    has_broken_chunks_ = true;
    return nullptr;
  }
  unpacked_bytes_ += bytes->size();
  return {new std::vector<std::byte>(std::move(*bytes)), [this](const auto* gone) {
            unpacked_bytes_ -= gone->size();
            delete gone;
          }};
}

void Timeline::load(const Piece& piece) {
  const auto bytes = unpack(piece);
  if (bytes) {
    ++chunks_;
    compressions_.insert(piece.chunk->compression);
  }
  each_message(piece, bytes.get(), [&](const Message& message) {
    if (message.time < from_ || !outline_.number_of(message.channel)) return;
    waiting_.push({message, order_++, bytes});
  });
}

}  // namespace pointflight::mcap
