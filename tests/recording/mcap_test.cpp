// Recordings read back; cut at any byte; with wrong bytes. An independent reader checks them in
// tests/integration.
#include <gtest/gtest.h>

#include "pointflight/recording/mcap_reader.hpp"
#include "pointflight/recording/mcap_writer.hpp"
#include "pointflight/ros/common/description.hpp"
#include "tests/support.hpp"

namespace pointflight {
namespace {

using testing::error_of;
using testing::expect_contains;
using testing::FullDisk;
using testing::read_file;
using testing::TemporaryFolder;
using testing::write_file;

Bytes clock_bytes(int i) {
  return std::make_shared<const std::vector<std::byte>>(encode<Wire::kCdr>(msg::Clock{{i, 0}}));
}

/// Messages 0 .. count - 1 on two topics in turn, a chunk each few.
void record(const std::string& path, const std::string& compression, int count, bool close) {
  McapWriter writer(path, {compression, 1200});
  const int a = writer.advertise({"/a", message_type<msg::Clock>()});
  const int b = writer.advertise({"/b", message_type<msg::Clock>(), true, 1});
  writer.attach("scenario.yaml", "application/yaml", "map: x.pfmap\n", 1000);
  for (int i = 0; i < count; ++i) writer.send(i % 2 == 0 ? a : b, clock_bytes(i), 1000 + i);
  if (close) writer.close();
}

std::vector<int> seconds_in(std::span<const std::byte> bytes) {
  std::vector<int> seconds;
  if (read_mcap_bytes(bytes, "test").messages == 0) return seconds;
  const auto recording = timed_mcap(bytes, "test");
  TimedMessage m;
  while (recording->next(m)) {
    const auto clock = decode<Wire::kCdr, msg::Clock>(m.data);
    EXPECT_TRUE(clock);
    if (!clock) break;
    EXPECT_EQ(m.time, 1000 + clock->clock.sec);
    EXPECT_EQ(recording->channels()[m.channel].topic, clock->clock.sec % 2 == 0 ? "/a" : "/b");
    seconds.push_back(clock->clock.sec);
  }
  return seconds;
}

TEST(Mcap, GivesBackWhatWasRecorded) {
  const TemporaryFolder folder;
  for (const char* compression : {"zstd", "lz4", "none"}) {
    const std::string path = folder / (std::string(compression) + ".mcap");
    record(path, compression, 101, true);
    EXPECT_FALSE(std::filesystem::exists(path + ".active"));
    const std::string bytes = read_file(path);
    const auto seconds = seconds_in(std::as_bytes(std::span(bytes)));
    ASSERT_EQ(seconds.size(), 101u) << compression;
    for (int i = 0; i < 101; ++i) EXPECT_EQ(seconds[static_cast<std::size_t>(i)], i);
    const RecordingInfo info = read_mcap(path);
    EXPECT_TRUE(info.complete);
    EXPECT_EQ(info.format, "MCAP, profile ros2");
    EXPECT_EQ(info.compression, compression);
    EXPECT_GT(info.chunks, 3u);
    ASSERT_EQ(info.topics.size(), 2u);
    EXPECT_EQ(info.topics[0].type, "rosgraph_msgs/msg/Clock");
    EXPECT_EQ(info.topics[0].messages, 51u);
    EXPECT_EQ(info.start, 1000);
    EXPECT_EQ(info.end, 1100);
    ASSERT_EQ(info.attachments.size(), 1u);
    EXPECT_EQ(info.attachments[0].name, "scenario.yaml");
    EXPECT_EQ(info.attachments[0].size, 13u);
  }
  expect_contains(error_of([&] { McapWriter(folder / "x.mcap", {"rar", 1}); }), "zstd, lz4");
}

TEST(Mcap, TheSameMessagesGiveTheSameBytes) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", "zstd", 50, true);
  record(folder / "b.mcap", "zstd", 50, true);
  EXPECT_EQ(read_file(folder / "a.mcap"), read_file(folder / "b.mcap"));
}

TEST(Mcap, Slow_CutAtAnyByteItKeepsAllWholeChunks) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", "lz4", 60, true);
  const std::string bytes = read_file(folder / "a.mcap");
  const auto all = std::as_bytes(std::span(bytes));
  // where chunks end: by walking over the records
  std::vector<std::pair<std::size_t, std::size_t>> ends;  // byte, messages until there
  std::size_t messages = 0;
  for (std::size_t at = 8; at + 9 <= all.size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, all.data() + at + 1, 8);
    const auto end = at + 9 + length;
    if (all[at] == std::byte{0x06}) {
      messages = seconds_in(all.first(end)).size();
      ends.emplace_back(end, messages);
    }
    if (all[at] == std::byte{0x02}) break;
    at = end;
  }
  ASSERT_GT(ends.size(), 3u);
  EXPECT_EQ(messages, 60u);
  for (std::size_t cut = 8; cut < all.size(); ++cut) {
    std::size_t expected = 0;
    for (const auto& [end, count] : ends) {
      if (cut >= end) expected = count;
    }
    const auto seconds = seconds_in(all.first(cut));
    ASSERT_EQ(seconds.size(), expected) << "cut at " << cut;
    for (std::size_t i = 0; i < seconds.size(); ++i) EXPECT_EQ(seconds[i], static_cast<int>(i));
  }
}

TEST(Mcap, WithoutAnEndItStaysActiveAndReadable) {
  const TemporaryFolder folder;
  record(folder / "a.mcap", "zstd", 30, false);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.mcap"));
  const RecordingInfo info = read_mcap(folder / "a.mcap.active");
  EXPECT_FALSE(info.complete);
  EXPECT_EQ(info.messages, 30u);
}

TEST(Mcap, WrongBytesAreSaidOrLeftOut) {
  const TemporaryFolder folder;
  write_file(folder / "a.mcap", "not a recording");
  expect_contains(error_of([&] { read_mcap(folder / "a.mcap"); }), "not an MCAP file");
  record(folder / "b.mcap", "zstd", 60, true);
  const std::string good = read_file(folder / "b.mcap");
  for (std::size_t at = 8; at < good.size(); at += 3) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x55);
    EXPECT_LE(read_mcap_bytes(std::as_bytes(std::span(bad)), "b").messages, 60u);
  }
}

TEST(Mcap, ADiskThatIsFullIsSaidAndWhatIsThereStays) {
  const TemporaryFolder folder;
  const FullDisk full(100);
  expect_contains(error_of([&] { record(folder / "a.mcap", "none", 5, true); }),
                  "a.mcap.active: writing failed: File too large");
}

}  // namespace
}  // namespace pointflight
