#include "pointflight/core/owned_files.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <random>
#include <thread>

#include "pointflight/core/output_file.hpp"
#include "tests/support.hpp"

/// What programs of ours remove, and what they never do.
namespace pointflight {
namespace {

namespace fs = std::filesystem;
using testing::error_of;
using testing::expect_contains;
using testing::read_file;
using testing::snapshot;
using testing::TemporaryFolder;
using testing::write_file;

/// A folder to work in, and one of somebody else's that must stay as it is.
class OwnedFiles : public ::testing::Test {
 protected:
  OwnedFiles() {
    fs::create_directories(all_ / "theirs/deep");
    fs::create_directory(all_ / "ours");
    write_file(all_ / "theirs/a", "precious");
    write_file(all_ / "theirs/deep/b", "precious, too");
    write_file(all_ / "theirs/two\nlines", "and this");
    before_ = snapshot(all_ / "theirs");
  }
  ~OwnedFiles() override { EXPECT_EQ(snapshot(all_ / "theirs"), before_); }
  [[nodiscard]] std::string in(const std::string& name) const { return all_ / ("ours/" + name); }
  [[nodiscard]] Folder ours() const { return Folder(all_ / "ours"); }

  TemporaryFolder all_;

 private:
  std::map<std::string, std::string> before_;
};

TEST_F(OwnedFiles, NamesLeadNeitherUpwardsNorThroughLinks) {
  write_file(in("file"), "text");
  fs::create_directories(in("folder/below"));
  write_file(in("folder/below/c"), "text");
  fs::create_directory_symlink("../theirs", in("link"));
  fs::create_symlink("nowhere", in("dangling"));
  fs::create_symlink("loop", in("loop"));
  fs::create_directory_symlink("..", in("folder/up"));
  ASSERT_EQ(::mkfifo(in("pipe").c_str(), 0600), 0);
  const Folder folder = ours();
  EXPECT_EQ(folder.entry("file"), Entry::kFile);
  EXPECT_EQ(folder.entry("folder"), Entry::kFolder);
  EXPECT_EQ(folder.entry("folder/below/c"), Entry::kFile);
  EXPECT_EQ(folder.entry("nothing"), Entry::kNothing);
  EXPECT_EQ(folder.entry("folder/nothing/below"), Entry::kNothing);
  for (const char* link : {"link", "dangling", "loop", "folder/up"}) {
    EXPECT_EQ(folder.entry(link), Entry::kLink) << link;
  }
  for (const char* elsewhere : {"link/a",
                                "folder/up/file",
                                "file/below",
                                "pipe",
                                "..",
                                "../theirs/a",
                                "",
                                "folder/",
                                "folder/../file",
                                "./file",
                                "folder//below",
                                "/etc/hostname"}) {
    EXPECT_EQ(folder.entry(elsewhere), Entry::kOther) << elsewhere;
    EXPECT_FALSE(folder.remove_file(elsewhere)) << elsewhere;
    EXPECT_FALSE(folder.below(elsewhere)) << elsewhere;
    EXPECT_FALSE(folder.read(elsewhere, 100)) << elsewhere;
  }
  EXPECT_FALSE(folder.make("link/new"));
  EXPECT_FALSE(folder.read("link", 100));
  EXPECT_NE(folder.rename("file", folder, "link/file"), 0);
  EXPECT_EQ(folder.rename("file", folder, "folder/below/c"), EEXIST);
  EXPECT_EQ(folder.rename("file", folder, "new/file"), 0);
  EXPECT_EQ(folder.read("new/file", 100), "text");
  EXPECT_FALSE(folder.read("new/file", 3));
  EXPECT_FALSE(folder.remove_file("folder"));
  EXPECT_FALSE(folder.remove_empty_folder("folder"));
  EXPECT_FALSE(folder.remove_empty_folder("link"));
}

TEST_F(OwnedFiles, ListsAreReadAsTheyWereWritten) {
  std::mt19937 random(7);
  for (int round = 0; round < 2000; ++round) {
    std::vector<ListedFile> files;
    for (unsigned i = 0; i < random() % 5; ++i) {
      std::string name;
      for (unsigned k = 0; k <= random() % 6; ++k) name += "ab/\n\\@#n \xff\t"[random() % 11];
      files.push_back({name, random() % 2 == 0});
    }
    std::ranges::sort(files, {}, &ListedFile::name);
    const auto same = [](const ListedFile& a, const ListedFile& b) { return a.name == b.name; };
    files.erase(std::unique(files.begin(), files.end(), same), files.end());
    EXPECT_EQ(parse_file_list(file_list_text(files)), files);
  }
}

TEST_F(OwnedFiles, AListOfSomebodyElseIsNone) {
  for (const char* text : {"a\nb\n", "# files\na\n", "\n", " # pointflight: files that"}) {
    EXPECT_FALSE(parse_file_list(text)) << text;
  }
  // one that was begun when its process was killed lists what it has, half a line not
  EXPECT_EQ(parse_file_list("# pointfl"), std::vector<ListedFile>());
  const std::string text = file_list_text({{"a", false}, {"bcd", false}});
  EXPECT_EQ(parse_file_list(text.substr(0, text.size() - 2)),
            (std::vector<ListedFile>{{"a", false}}));
}

TEST_F(OwnedFiles, WhatAListNamesGoesAndNothingElse) {
  const Folder folder = ours();
  {
    OwnedFolder run(folder, "run");
    for (const char* name : {"a", "scans/1", "scans/deep/2", "two\nlines", "gone", "replaced"}) {
      write_file(run.file(name), "ours");
    }
    fs::create_symlink("../../theirs/a", run.link("map"));
    fs::create_symlink("../../theirs/a", run.file("was a file"));
    write_file(run.file("a"), "the same, asked for again");
    EXPECT_EQ(run.files().size(), 8u);
  }
  write_file(in("run/unfinished.partial"), "not of a listed file");
  write_file(in("run/scans/mine"), "theirs");
  write_file(in("run/lines"), "theirs");
  fs::remove(in("run/gone"));
  fs::remove(in("run/replaced"));
  fs::create_directory(in("run/replaced"));
  fs::create_hard_link(in("run/scans/deep/2"), in("kept"));
  EXPECT_FALSE(remove_owned(folder, "run"));
  const std::map<std::string, std::string> left = {
      {"replaced", "folder"},
      {"was a file", "link to ../../theirs/a"},
      {"unfinished.partial", "file not of a listed file"},
      {"scans", "folder"},
      {"scans/mine", "file theirs"},
      {"lines", "file theirs"}};
  EXPECT_EQ(snapshot(in("run")), left);
  EXPECT_EQ(read_file(in("kept")), "ours");
  // without its list it is nobody's
  EXPECT_FALSE(is_owned(folder, "run"));
  EXPECT_FALSE(remove_owned(folder, "run"));
  EXPECT_EQ(snapshot(in("run")), left);
}

TEST_F(OwnedFiles, AFolderGoesWithAllThatAKilledProcessWrote) {
  const Folder folder = ours();
  {
    OwnedFolder run(folder, "run");
    write_file(run.file("scans/1") + ".partial", "half of it");
  }
  EXPECT_TRUE(is_owned(folder, "run"));
  EXPECT_TRUE(remove_owned(folder, "run"));
  fs::create_directory(in("begun"));
  write_file(in("begun/" + Folder::temporary_name(kFileList)), "# poi");
  EXPECT_TRUE(is_owned(folder, "begun"));
  EXPECT_TRUE(remove_owned(folder, "begun"));
  fs::create_directory_symlink("../theirs", in("link"));
  EXPECT_FALSE(is_owned(folder, "link"));
  EXPECT_FALSE(remove_owned(folder, "link"));
  expect_contains(error_of([&] { OwnedFolder(folder, "link"); }), "is there already");
}

TEST_F(OwnedFiles, ALinkThatComesBetweenCheckAndUseLeadsNowhere) {
  // theirs/a and ours/real/a have one name; another process swaps their folders all the time
  fs::create_directory(in("real"));
  fs::create_directory_symlink("../theirs", in("link"));
  fs::rename(in("real"), in("d"));
  std::atomic<bool> over = false;
  std::thread swapper([&] {
    while (!over) {
      ::renameat2(AT_FDCWD, in("d").c_str(), AT_FDCWD, in("link").c_str(), RENAME_EXCHANGE);
    }
  });
  const Folder folder = ours();
  int removed = 0;
  for (int i = 0; i < testing::repeats(20000); ++i) {
    if (folder.entry("d/a") == Entry::kNothing)
      static_cast<void>(folder.rename("f", folder, "d/a"));
    if (i % 10 == 0) write_file(in("f"), "ours");
    removed += folder.remove_file("d/a") ? 1 : 0;
  }
  over = true;
  swapper.join();
  EXPECT_GT(removed, 0);
}

TEST_F(OwnedFiles, MountsAreNotEntered) {
  const Folder root("/");
  if (!fs::exists("/proc/version")) GTEST_SKIP() << "no /proc here, which would be a mount";
  EXPECT_EQ(root.entry("proc"), Entry::kOther);
  EXPECT_EQ(root.entry("proc/version"), Entry::kOther);
  EXPECT_FALSE(root.below("proc"));
}

TEST_F(OwnedFiles, OutputsWriteThroughNoLink) {
  fs::create_symlink("../theirs/a", in("link.txt"));
  fs::create_symlink("../theirs/new", in("dangling.txt"));
  for (const char* name : {"link.txt", "dangling.txt"}) {
    expect_contains(error_of([&] { OutputFile(in(name)); }), "is a symbolic link");
  }
  fs::create_symlink("../theirs/a", in("a.txt.partial"));
  fs::create_hard_link(all_ / "theirs/deep/b", in("b.txt.partial"));
  ASSERT_EQ(::mkfifo(in("c.txt.partial").c_str(), 0600), 0);
  for (const char* name : {"a.txt", "b.txt", "c.txt"}) {
    expect_contains(error_of([&] { OutputFile(in(name)); }),
                    "is there and was not left by a program of ours");
  }
}

TEST_F(OwnedFiles, WhatAppearsInAnOutputsPlaceStays) {
  {
    OutputFile file(in("new.txt"));
    file.write("ours");
    write_file(in("new.txt"), "theirs");
    expect_contains(error_of([&] { file.commit(); }), "somebody has put something there meanwhile");
  }
  {
    write_file(in("old.txt"), "earlier");
    OutputFile file(in("old.txt"));
    fs::remove(in("old.txt"));
    fs::create_symlink("../theirs/a", in("old.txt"));
    expect_contains(error_of([&] { file.commit(); }), "somebody has put something there meanwhile");
  }
  {
    OutputFile file(in("swapped.txt"));
    fs::remove(in("swapped.txt.partial"));
    fs::create_hard_link(all_ / "theirs/a", in("swapped.txt.partial"));
    expect_contains(error_of([&] { file.commit(); }), "somebody has put something there meanwhile");
  }
  EXPECT_EQ(read_file(in("new.txt")), "theirs");
  EXPECT_TRUE(fs::is_symlink(in("old.txt")));
  EXPECT_TRUE(fs::exists(in("swapped.txt.partial")));
  EXPECT_FALSE(fs::exists(in("new.txt.partial")));
}

}  // namespace
}  // namespace pointflight
