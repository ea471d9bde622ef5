#include "pointflight/recording/internal/mcap_timeline.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace pointflight::mcap {
namespace {

/// Of unpacked chunks that are merged by time; a recorder's overlap by one or two.
constexpr std::size_t kMostUnpacked = std::size_t{256} << 20;

/// The next message from an offset on, which goes behind it.
std::optional<Message> next_message(std::span<const std::byte> records, std::size_t& at) {
  while (const auto record = record_at(records, at)) {
    if (record->opcode != Opcode::kMessage) continue;
    if (const auto message = message_of(record->content)) return message;
  }
  return std::nullopt;
}

}  // namespace

struct Timeline::Open {
  /// Where a message is, of a piece whose messages are not in the order of time.
  struct Entry {
    std::int64_t time;
    std::uint32_t offset;
  };
  std::size_t piece = 0;
  Unpacked bytes;
  std::span<const std::byte> records;
  std::vector<Entry> entries;  ///< By time; none: they lie in order, and nothing is kept of them.
  std::size_t at = 0;          ///< In the entries, else in the records: of the one after `now`.
  Message now;                 ///< Given next.
};

bool Timeline::IsLater::operator()(const std::shared_ptr<Open>& a,
                                   const std::shared_ptr<Open>& b) const {
  return std::pair(a->now.time, a->piece) > std::pair(b->now.time, b->piece);
}

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
  open_ = {};
  held_.reset();
}

bool Timeline::next(TimedMessage& message) {
  const std::vector<Piece>& pieces = outline_.pieces();
  for (; next_piece_ < pieces.size(); ++next_piece_) {
    const Piece& piece = pieces[next_piece_];
    if (piece.end < from_) continue;
    const bool is_due = open_.empty() || piece.start <= open_.top()->now.time;
    if (!is_due || (unpacked_bytes_ > kMostUnpacked && !open_.empty())) break;
    open(next_piece_);
  }
  if (open_.empty()) return false;
  const auto first = open_.top();
  open_.pop();
  held_ = first->bytes;
  message = {*outline_.number_of(first->now.channel), first->now.time, first->now.data};
  if (advance(*first)) open_.push(first);
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
  // where the last message of each is: its piece, and the offset there
  struct Last {
    std::size_t piece = 0;
    std::size_t offset = 0;
    std::int64_t time = 0;
  };
  std::map<std::size_t, Last> last;
  for (std::size_t i = pieces.size(); i-- > 0 && !wanted.empty();) {
    // pieces overlap: one is the last if none that is left comes up to it
    std::erase_if(wanted, [&](std::size_t channel) {
      const auto found = last.find(channel);
      return found != last.end() && found->second.time > reach[i];
    });
    if (pieces[i].start > time || !has_one_of(pieces[i], wanted)) continue;
    const Unpacked bytes = unpack(pieces[i]);
    const auto records = bytes ? std::span(*bytes) : pieces[i].records;
    std::size_t at = 0;
    for (std::size_t offset = 0; const auto message = next_message(records, at); offset = at) {
      const auto channel = outline_.number_of(message->channel);
      if (!channel || !wanted.contains(*channel) || message->time >= time) continue;
      const auto known = last.find(*channel);
      if (known == last.end() || message->time >= known->second.time) {
        last[*channel] = {i, offset, message->time};
      }
    }
  }
  // one chunk at a time, however many channels have theirs in another
  std::map<std::size_t, std::vector<std::pair<std::size_t, std::size_t>>> by_piece;
  for (const auto& [channel, found] : last) {
    by_piece[found.piece].emplace_back(channel, found.offset);
  }
  for (const auto& [piece, found] : by_piece) {
    const Unpacked bytes = unpack(pieces[piece]);
    const auto records = bytes ? std::span(*bytes) : pieces[piece].records;
    for (auto [channel, offset] : found) {
      const auto message = next_message(records, offset);
      take({channel, message->time, message->data});
    }
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

/// Makes a piece's messages wait for their times.
void Timeline::open(std::size_t number) {
  const Piece& piece = outline_.pieces()[number];
  const auto opened = std::make_shared<Open>();
  opened->piece = number;
  opened->bytes = unpack(piece);
  if (opened->bytes) {
    ++chunks_;
    compressions_.insert(piece.chunk->compression);
  }
  opened->records = opened->bytes ? std::span(*opened->bytes) : piece.records;
  // recorders write in the order of time, nearly always: then there is nothing to sort
  std::int64_t latest = std::numeric_limits<std::int64_t>::min();
  bool is_sorted = true;
  std::size_t at = 0;
  while (const auto message = next_message(opened->records, at)) {
    is_sorted = is_sorted && message->time >= latest;
    latest = message->time;
  }
  if (!is_sorted) {
    at = 0;
    for (std::size_t offset = 0; const auto message = next_message(opened->records, at);
         offset = at) {
      if (!is_wanted(*message)) continue;
      opened->entries.push_back({message->time, static_cast<std::uint32_t>(offset)});
    }
    std::stable_sort(opened->entries.begin(),
                     opened->entries.end(),
                     [](const auto& a, const auto& b) { return a.time < b.time; });
    if (opened->entries.empty()) return;
  }
  if (advance(*opened)) open_.push(opened);
}

/// Goes to the piece's next message. False if there are none left.
bool Timeline::advance(Open& open) const {
  if (!open.entries.empty()) {
    if (open.at == open.entries.size()) return false;
    std::size_t offset = open.entries[open.at++].offset;
    open.now = *next_message(open.records, offset);
    return true;
  }
  while (const auto message = next_message(open.records, open.at)) {
    if (!is_wanted(*message)) continue;
    open.now = *message;
    return true;
  }
  return false;
}

}  // namespace pointflight::mcap
