// A recording read from any time on: of files cut anywhere, with chunks
// that overlap or with none.
#include <gtest/gtest.h>

#include <algorithm>

#include "pointflight/recording/internal/mcap_format.hpp"
#include "pointflight/recording/mcap_reader.hpp"
#include "pointflight/recording/mcap_writer.hpp"
#include "pointflight/ros/common/description.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using mcap::Opcode;
using mcap::RecordWriter;
using testing::error_of;
using testing::expect_contains;
using testing::read_file;
using testing::TemporaryFolder;

Bytes tick_bytes(int i) {
  return std::make_shared<const std::vector<std::byte>>(encode<Wire::kCdr>(msg::Clock{{i, 0}}));
}

/// Messages at 1000, 1010, ...: three of /a to one of the latched /b.
void record(const std::string& path, int count, const std::string& compression = "zstd") {
  McapWriter writer(path, {compression, 900});
  const int a = writer.advertise({"/a", message_type<msg::Clock>()});
  const int b = writer.advertise({"/b", message_type<msg::Clock>(), true, 1});
  for (int i = 0; i < count; ++i) writer.send(i % 4 == 0 ? b : a, tick_bytes(i), 1000 + 10 * i);
  writer.close();
}

/// Times of the messages that come from here on.
std::vector<std::int64_t> times_of(TimedRecording& recording) {
  std::vector<std::int64_t> times;
  TimedMessage message;
  while (recording.next(message)) times.push_back(message.time);
  return times;
}

/// A file without a summary, record by record.
class RawFile {
 public:
  RawFile() {
    const auto magic = std::as_bytes(std::span(mcap::kMagic));
    bytes_.assign(magic.begin(), magic.end());
    add(Opcode::kHeader, RecordWriter().text("").text("test"));
  }
  RawFile& add(Opcode opcode, const RecordWriter& content) {
    append(bytes_, opcode, content);
    return *this;
  }
  RawFile& describe(std::uint16_t id, const std::string& topic, bool latched = false) {
    return add(Opcode::kSchema, schema(id)).add(Opcode::kChannel, channel(id, topic, latched));
  }
  /// A chunk of messages of a channel, not packed.
  RawFile& chunk(std::uint16_t id, const std::vector<std::uint64_t>& times) {
    std::vector<std::byte> records;
    for (const std::uint64_t time : times) append(records, Opcode::kMessage, message(id, time));
    const auto [low, high] = std::minmax_element(times.begin(), times.end());
    RecordWriter content;
    content.number(*low).number(*high);
    content.number<std::uint64_t>(records.size()).number<std::uint32_t>(0).text("");
    content.number<std::uint64_t>(records.size()).raw(records);
    return add(Opcode::kChunk, content);
  }
  static RecordWriter message(std::uint16_t id, std::uint64_t time) {
    RecordWriter content;
    content.number(id).number<std::uint32_t>(0).number(time).number(time).raw({});
    return content;
  }
  static RecordWriter schema(std::uint16_t id, const std::string& text = "int32 x") {
    RecordWriter content;
    content.number(id).text("a/msg/B").text("ros2msg").text(text);
    return content;
  }
  static RecordWriter channel(std::uint16_t id, const std::string& topic, bool latched = false) {
    mcap::StringMap metadata;
    if (latched) metadata["offered_qos_profiles"] = "- durability: 1";
    RecordWriter content;
    content.number(id).number(id).text(topic).text("cdr").map(metadata);
    return content;
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  static void append(std::vector<std::byte>& to, Opcode opcode, const RecordWriter& content) {
    to.push_back(static_cast<std::byte>(opcode));
    RecordWriter length;
    length.number<std::uint64_t>(content.bytes().size());
    to.insert(to.end(), length.bytes().begin(), length.bytes().end());
    to.insert(to.end(), content.bytes().begin(), content.bytes().end());
  }
  std::vector<std::byte> bytes_;
};

TEST(McapTimeline, GivesWhatWasRecorded) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", 200);
  const auto recording = open_timed_mcap(folder / "a.mcap");
  ASSERT_EQ(recording->channels().size(), 2u);
  const RecordedChannel& a = recording->channels()[0];
  EXPECT_EQ(a.topic, "/a");
  EXPECT_EQ(a.encoding, "cdr");
  EXPECT_EQ(a.schema_name, "rosgraph_msgs/msg/Clock");
  EXPECT_EQ(a.schema_encoding, "ros2msg");
  expect_contains(a.schema, "builtin_interfaces/Time clock");
  EXPECT_FALSE(a.latched);
  EXPECT_TRUE(recording->channels()[1].latched);
  EXPECT_EQ(recording->range(), std::pair(std::int64_t{1000}, std::int64_t{2990}));
  TimedMessage message;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(recording->next(message));
    EXPECT_EQ(message.channel, i % 4 == 0 ? 1u : 0u);
    EXPECT_EQ(message.time, 1000 + 10 * i);
    EXPECT_TRUE(std::ranges::equal(message.data, *tick_bytes(i)));
  }
  EXPECT_FALSE(recording->next(message));
}

TEST(McapTimeline, IsReadFromAnyTimeOn) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", 100);
  const auto recording = open_timed_mcap(folder / "a.mcap");
  for (const std::int64_t time : {0, 1000, 1001, 1500, 1555, 1990, 1991, 1200}) {
    recording->seek(time);
    const auto times = times_of(*recording);
    const auto skipped =
        static_cast<std::size_t>(std::clamp<std::int64_t>((time - 991) / 10, 0, 100));
    ASSERT_EQ(times.size(), 100 - skipped) << "from " << time;
    if (!times.empty()) {
      EXPECT_GE(times.front(), time);
    }
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
    // what the latched topic, every fourth message, held then
    std::vector<std::int64_t> held;
    recording->latched_before(time, [&](const TimedMessage& m) {
      EXPECT_EQ(m.channel, 1u);
      held.push_back(m.time);
    });
    ASSERT_EQ(held.size(), time > 1000 ? 1u : 0u) << time;
    if (time > 1000) {
      EXPECT_EQ(held[0], 1000 + (std::min<std::int64_t>(time, 1991) - 1001) / 40 * 40);
    }
  }
}

TEST(McapTimeline, CutAtAnyByteItGivesAllWholeChunks) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", 30, "none");
  const std::string bytes = read_file(folder / "a.mcap");
  const auto all = std::as_bytes(std::span(bytes));
  std::size_t most = 0;
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    const auto part = all.first(cut);
    std::uint64_t expected = 0;
    if (cut >= 8) expected = read_mcap_bytes(part, "a").messages;
    if (expected == 0) {
      EXPECT_NE(error_of([&] { timed_mcap(part, "a"); }), "");
      continue;
    }
    const auto times = times_of(*timed_mcap(part, "a"));
    ASSERT_EQ(times.size(), expected) << "cut at " << cut;
    most = times.size();
  }
  EXPECT_EQ(most, 30u);
}

TEST(McapTimeline, MergesChunksThatOverlap) {
  RawFile file;
  file.describe(1, "/a").describe(2, "/b");
  file.chunk(2, {50, 70, 90}).chunk(1, {10, 60, 80, 40}).chunk(1, {85, 200});
  const auto recording = timed_mcap(file.bytes(), "raw");
  EXPECT_EQ(times_of(*recording), (std::vector<std::int64_t>{10, 40, 50, 60, 70, 80, 85, 90, 200}));
  recording->seek(75);
  EXPECT_EQ(times_of(*recording), (std::vector<std::int64_t>{80, 85, 90, 200}));
}

/// Times of what latched topics held.
std::vector<std::int64_t> held_before(TimedRecording& recording, std::int64_t time) {
  std::vector<std::int64_t> times;
  recording.latched_before(time, [&](const TimedMessage& m) { times.push_back(m.time); });
  return times;
}

TEST(McapTimeline, KnowsWhatLatchedTopicsHeldInFilesWithoutIndex) {
  using Times = std::vector<std::int64_t>;
  RawFile loose;  // no chunks, as rosbag2 writes with storage preset "fastwrite"
  loose.describe(1, "/tf_static", true).describe(2, "/a");
  loose.add(Opcode::kMessage, RawFile::message(1, 30));
  for (std::uint64_t t = 40; t < 90; ++t) loose.add(Opcode::kMessage, RawFile::message(2, t));
  EXPECT_EQ(held_before(*timed_mcap(loose.bytes(), "raw"), 80), Times({30}));
  EXPECT_EQ(held_before(*timed_mcap(loose.bytes(), "raw"), 30), Times());
  RawFile chunks;  // that overlap: the one that begins later does not hold what is latest
  chunks.describe(1, "/tf_static", true).describe(2, "/a");
  chunks.chunk(1, {20, 95, 70}).chunk(2, {30, 40}).chunk(1, {50, 60});
  const auto recording = timed_mcap(chunks.bytes(), "raw");
  EXPECT_EQ(held_before(*recording, 100), Times({95}));
  EXPECT_EQ(held_before(*recording, 95), Times({70}));
  EXPECT_EQ(held_before(*recording, 65), Times({60}));
  EXPECT_EQ(held_before(*recording, 50), Times({20}));
}

TEST(McapTimeline, LongFilesWithoutChunksAreTakenInPieces) {
  RawFile file;
  file.describe(1, "/a");
  std::vector<std::byte> large(std::size_t{1} << 20);
  for (std::uint64_t t = 100; t < 112; ++t) {
    RecordWriter content = RawFile::message(1, t);
    content.raw(large);
    file.add(Opcode::kMessage, content);
  }
  const auto recording = timed_mcap(file.bytes(), "raw");
  EXPECT_EQ(times_of(*recording).size(), 12u);
  recording->seek(109);
  EXPECT_EQ(times_of(*recording), (std::vector<std::int64_t>{109, 110, 111}));
}

TEST(McapTimeline, AChunkWithoutMessagesHasNoTime) {
  RawFile file;
  RecordWriter nothing;  // as the specification has it: both times are 0
  nothing.number<std::uint64_t>(0).number<std::uint64_t>(0);
  nothing.number<std::uint64_t>(0).number<std::uint32_t>(0).text("").number<std::uint64_t>(0);
  file.describe(1, "/a").add(Opcode::kChunk, nothing).chunk(1, {1000, 2000});
  EXPECT_EQ(timed_mcap(file.bytes(), "raw")->range(),
            std::pair(std::int64_t{1000}, std::int64_t{2000}));
}

TEST(McapTimeline, TakesMessagesBesideChunks) {
  RawFile file;
  file.describe(1, "/a");
  file.add(Opcode::kMessage, RawFile::message(1, 30))
      .add(Opcode::kMessage, RawFile::message(1, 20));
  file.chunk(1, {25, 40});
  file.add(Opcode::kMessage, RawFile::message(7, 35));  // of a channel that nobody described
  file.add(Opcode::kMessage, RawFile::message(1, 50));
  const auto recording = timed_mcap(file.bytes(), "raw");
  EXPECT_EQ(times_of(*recording), (std::vector<std::int64_t>{20, 25, 30, 40, 50}));
}

TEST(McapTimeline, RefusesWhatIsNone) {
  const std::vector<std::byte> nothing(20);
  expect_contains(error_of([&] { timed_mcap(nothing, "x.mcap"); }), "x.mcap: is not an MCAP file");
  const RawFile empty;
  expect_contains(error_of([&] { timed_mcap(empty.bytes(), "x.mcap"); }), "holds no message");
  RawFile bomb;  // a type of 1 MB, named by a hundred channels
  bomb.add(Opcode::kSchema, RawFile::schema(1, std::string(std::size_t{1} << 20, 'x')));
  for (std::uint16_t id = 1; id < 100; ++id) {
    RecordWriter channel;
    channel.number(id).number<std::uint16_t>(1).text("/t").text("cdr").map({});
    bomb.add(Opcode::kChannel, channel);
  }
  expect_contains(error_of([&] { timed_mcap(bomb.bytes(), "x.mcap"); }), "longer than 64 MiB");
  RawFile types;  // a hundred of them that nobody uses
  for (std::uint16_t id = 1; id < 100; ++id) {
    types.add(Opcode::kSchema, RawFile::schema(id, std::string(std::size_t{1} << 20, 'x')));
  }
  expect_contains(error_of([&] { timed_mcap(types.bytes(), "x.mcap"); }), "longer than 64 MiB");
}

TEST(McapTimeline, LeavesOutTimesThatNoClockShows) {
  RawFile file;
  file.describe(1, "/a").chunk(1, {10, ~std::uint64_t{0}}).chunk(1, {20, 30});
  file.add(Opcode::kMessage, RawFile::message(1, ~std::uint64_t{0} - 5));
  const auto recording = timed_mcap(file.bytes(), "raw");
  EXPECT_EQ(recording->range(), std::pair(std::int64_t{20}, std::int64_t{30}));
  EXPECT_EQ(times_of(*recording), (std::vector<std::int64_t>{20, 30}));
  // what was left out makes the file incomplete, although it has its end
  file.add(Opcode::kDataEnd, RecordWriter().number<std::uint32_t>(0));
  file.add(Opcode::kFooter, RecordWriter());
  EXPECT_FALSE(read_mcap_bytes(file.bytes(), "raw").complete);
  RawFile whole;
  whole.describe(1, "/a").chunk(1, {20, 30});
  whole.add(Opcode::kDataEnd, RecordWriter().number<std::uint32_t>(0));
  whole.add(Opcode::kFooter, RecordWriter());
  EXPECT_TRUE(read_mcap_bytes(whole.bytes(), "raw").complete);
}

/// A chunk that claims to unpack to so much, of so many packed bytes.
RecordWriter chunk_that_claims(std::uint64_t size, std::size_t packed) {
  RecordWriter content;
  content.number<std::uint64_t>(1).number<std::uint64_t>(2);
  content.number(size).number<std::uint32_t>(0).text("zstd");
  content.number<std::uint64_t>(packed).raw(std::vector<std::byte>(packed));
  return content;
}

TEST(McapTimeline, ASmallFileTakesNoMuchMemory) {
  // what unpacks to more than a thousand times of itself is left out before memory is taken for it
  RawFile file;
  file.describe(1, "/a");
  file.add(Opcode::kChunk, chunk_that_claims(std::uint64_t{200} << 20, 1000));
  file.add(Opcode::kDataEnd, RecordWriter().number<std::uint32_t>(0));
  file.add(Opcode::kFooter, RecordWriter().number<std::uint64_t>(0));
  const RecordingInfo info = read_mcap_bytes(file.bytes(), "raw");
  EXPECT_FALSE(info.complete);
  EXPECT_EQ(info.messages, 0u);
  // topics count as their types do
  RawFile topics;
  const std::string name(std::size_t{20} << 20, 't');
  for (std::uint16_t id = 1; id < 5; ++id) topics.describe(id, name + std::to_string(id));
  expect_contains(error_of([&] { timed_mcap(topics.bytes(), "raw"); }), "longer than 64 MiB");
}

TEST(McapTimeline, GivesTheLatchedOfManyChunksEachOnce) {
  RawFile file;
  for (std::uint16_t id = 1; id <= 40; ++id) file.describe(id, "/l" + std::to_string(id), true);
  for (std::uint16_t id = 1; id <= 40; ++id) {
    file.chunk(id, {std::uint64_t{2} * id, std::uint64_t{2} * id + 1});
  }
  const auto recording = timed_mcap(file.bytes(), "raw");
  auto times = held_before(*recording, 1000);
  std::sort(times.begin(), times.end());
  ASSERT_EQ(times.size(), 40u);
  for (int i = 0; i < 40; ++i) EXPECT_EQ(times[static_cast<std::size_t>(i)], 2 * i + 3);
}

}  // namespace
}  // namespace pointflight
